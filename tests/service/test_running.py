"""The service as it is deployed: processes that work, die and come back."""

from __future__ import annotations

import random
import threading
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

pytest.importorskip("distributed")

import heartgen
from heartgen.errors import HeartgenError
from heartgen.service.artifacts import Artifacts
from tests.service.helpers import Postgres
from tests.service.running import Running

pytestmark = pytest.mark.slow

WAITING = 400
"""Seconds for all to end; a busy machine needs them."""


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory):
    """A service with real fits, by the one command that needs no configuration."""
    with Running(tmp_path_factory.mktemp("running")) as service:
        yield service


def test_mask_is_submitted_and_its_mesh_loaded(running: Running, mask: Path, tmp_path: Path):
    client = heartgen.Client(running.url)
    seen: list[dict] = []
    job = client.submit(mask, title="cup", optimize=False)
    told = client.wait(job, timeout=WAITING, progress=seen.append)
    assert told["summary"]["success"]
    assert "running" in {each["state"] for each in seen}
    client.download(job, tmp_path, ("exf",))
    result = heartgen.Personalization.load(tmp_path, mask)
    assert result.report.accuracy.mean == told["summary"]["error_mean"]
    assert client.job(client.submit(mask, optimize=False))["state"] == "done"
    view = client._http.get(f"/v1/jobs/{job}/results/view")  # over the mask, which is kept here
    assert view.status_code == 200, view.text
    assert "sandbox" in view.headers["content-security-policy"]


def test_what_cannot_be_meshed_fails_with_its_reason(running: Running, tmp_path: Path, mask: Path):
    client = heartgen.Client(running.url)
    half = tmp_path / "half.nii.gz"
    half.write_bytes(mask.read_bytes()[:-200])
    with pytest.raises(HeartgenError, match="failed"):
        client.wait(client.submit(half), timeout=WAITING, progress=lambda _: None)


def submit_all(running: Running, mask: Path, clients: int, each: int) -> list[str]:
    """Jobs of several clients at once, all different."""

    def submit(client: int) -> list[str]:
        service = heartgen.Client(running.url)
        return [
            service.submit(mask, key=f"{client}-{n}", quality=1 + client + n / 100)
            for n in range(each)
        ]

    with ThreadPoolExecutor(clients) as threads:
        return [job for jobs in threads.map(submit, range(clients)) for job in jobs]


def wait_for(running: Running, jobs: list[str]) -> Counter[str]:
    """States of all jobs once they have ended, or time is over."""
    client, end = heartgen.Client(running.url), time.monotonic() + WAITING
    while True:
        states = Counter(client.job(job)["state"] for job in jobs)
        if not states["queued"] + states["running"] or time.monotonic() > end:
            return states
        time.sleep(1)


@pytest.mark.parametrize("database", ["postgresql"], indirect=True)
def test_200_submissions_at_once_are_each_done_once(
    database: str, mask: Path, tmp_path: Path
) -> None:
    with Running(tmp_path, 0.05, scheduler=True, workers=2, database=database) as running:
        jobs = submit_all(running, mask, 20, 10)
        assert len(set(jobs)) == 200
        assert wait_for(running, jobs) == Counter(done=200)
        done = (tmp_path / "data" / "done.log").read_text().split("\n")[:-1]
    assert len(done) == len(set(done)) == 200


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_kills_lose_nothing(database: None, mask: Path, tmp_path: Path) -> None:
    """A few here; ``python -m benchmarks.service kills`` kills 30 times."""
    chance = random.Random(0)
    with Running(tmp_path, 0.5, scheduler=True, workers=1) as running:
        jobs = submit_all(running, mask, 2, 6)
        for name in running.names:
            time.sleep(chance.uniform(0, 2))
            running.kill(name)
            running.start(name)
        running.wait()
        mender = threading.Event()

        def mend() -> None:  # workers end with their scheduler
            while not mender.wait(1):
                for name in running.names:
                    running.start(name)

        threading.Thread(target=mend, daemon=True).start()
        states = wait_for(running, jobs)
        mender.set()
    assert states == Counter(done=12)
    artifacts = Artifacts(tmp_path / "data")
    folders = [each for each in artifacts.results.iterdir() if each.name != ".stage"]
    assert len(folders) == 12
    for folder in folders:
        assert artifacts.summary(folder.name)["success"]


def test_database_that_is_gone_for_a_while_loses_nothing(
    postgres: Postgres, mask: Path, tmp_path: Path
) -> None:
    with Running(tmp_path, 3.0, database=postgres.fresh()) as running:
        client = heartgen.Client(running.url)
        jobs = [client.submit(mask, quality=1 + n) for n in range(2)]
        end = time.monotonic() + WAITING
        while client.job(jobs[0])["state"] == "queued" and time.monotonic() < end:
            time.sleep(0.2)
        postgres.stop()
        answer = client._http.get(f"/v1/jobs/{jobs[0]}")
        assert answer.status_code == 503
        assert "nothing is lost" in answer.json()["detail"]
        time.sleep(4)
        postgres.start()
        assert wait_for(running, jobs) == Counter(done=2)
