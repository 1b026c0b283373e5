"""A real Dask cluster, each part a process of its own, one of which is killed at work."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from heartgen import samples
from heartgen.cohort import Case, Workers, batch

pytestmark = pytest.mark.slow

PATIENCE = 60.0
"""Seconds after which a process that should have come up is given up."""

SPACING = 2.5
"""mm"""

HEARTS = 4


def start(kind, *arguments):
    """Start a scheduler or a worker."""
    module = f"distributed.cli.dask_{kind}"
    command = [sys.executable, "-m", module, *map(str, arguments), "--no-dashboard"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


@pytest.fixture
def cluster(tmp_path):
    """File of a scheduler on loopback, and the two worker processes by their ids."""
    file = tmp_path / "scheduler.json"
    place = ("--host", "127.0.0.1", "--port", "0", "--scheduler-file", file)
    processes = [start("scheduler", *place)]
    try:
        end = time.monotonic() + PATIENCE
        while not file.exists():
            assert time.monotonic() < end, "the scheduler did not start"
            time.sleep(0.05)
        options = ("--nthreads", 1, "--no-nanny", "--local-directory", tmp_path / "scratch")
        for n in range(2):
            processes.append(start("worker", "--scheduler-file", file, "--name", n, *options))
        yield file, {process.pid: process for process in processes[1:]}
    finally:
        for process in processes:
            process.kill()
            process.wait()


def test_a_batch_survives_the_death_of_a_worker(cluster, tmp_path):
    from distributed import Client

    file, workers = cluster
    with Client(scheduler_file=str(file)) as client:
        client.wait_for_workers(2, timeout=PATIENCE)
        assert set(client.run(os.getpid).values()) == set(workers)
    cases = [
        Case(f"heart{n}", samples.lifelike_lv(SPACING, noise=0.02 * n, seed=n).mask)
        for n in range(HEARTS)
    ]
    killed = []

    def kill_one(done, total, rows):
        """Once a case is done, when the others are under way."""
        if done == 1 and not killed:
            victim = next(iter(workers))
            os.kill(victim, signal.SIGKILL)
            killed.append(victim)

    out = tmp_path / "out"
    table = batch(cases, out, workers=Workers(scheduler=str(file)), progress=kill_one)
    assert workers[killed[0]].wait(PATIENCE) == -signal.SIGKILL
    assert list(table["case"]) == [case.name for case in cases]
    assert set(table["status"]) == {"success"}
    assert all((out / "cases" / case.name / "mesh.exf").is_file() for case in cases)


def test_a_cluster_can_be_started_by_name(tmp_path):
    case = Case("block", samples.lifelike_lv(4.0).mask)
    told = []
    table = batch(
        [case],
        tmp_path,
        workers=Workers(jobs=1, cluster="distributed.LocalCluster"),
        progress=lambda *news: told.append(news),
    )
    assert len(table) == 1
    assert told[-1][:2] == (1, 1)


def test_a_case_whose_process_dies_is_told_and_the_others_go_on():
    from heartgen.cohort.cluster import Died, connected, each

    with connected(Workers(1), 2) as client:
        found = dict(each(client, suicidal, [False, True]))
    assert found[False] == "alive"
    assert isinstance(found[True], Died)
    assert "its worker died each time" in found[True].reason


def suicidal(kill):
    """Task that ends its own process."""
    if kill:
        os.kill(os.getpid(), signal.SIGKILL)
    return "alive"
