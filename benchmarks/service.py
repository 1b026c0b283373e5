"""The service under load, under kills, and with a large library.

usage: python -m benchmarks.service load [--clients 20] [--each 10] [--seconds 0.2]
       python -m benchmarks.service kills [--kills 30] [--jobs 60] [--seed 0]
       python -m benchmarks.service library [--models 10000]
       python -m benchmarks.service full [--hearts 4] [--size 96]

Each takes --database postgresql://... instead of an SQLite file. `load` and `kills` start server,
scheduler and two workers as processes of their own, whose fits are light (`load --real` fits
hearts): it is about who does them. `load` tells how fast a state is answered while all submit and
wait. `kills` ends server, worker or scheduler by SIGKILL at random moments, and starts them again;
jobs that are lost, done with no result, or half written are told, and end it with 1. `library`
tells how long pages of a search take. `full` needs root: it puts the data on a disk of `size` MB in
memory, fills it to the last byte while hearts are fitted, and makes room again; the second time
the server is killed as well. Jobs that fail, are lost or half written end it with 1.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from statistics import median, quantiles
from typing import Any, get_args

import httpx
from fastapi.testclient import TestClient

import heartgen
from heartgen import samples
from heartgen.errors import HeartgenError
from heartgen.images.writing import write_mask
from heartgen.service.app import make_app
from heartgen.service.artifacts import Artifacts
from heartgen.service.library import new_identifier
from heartgen.service.metadata import AgeBand, License, Metadata, Sex, words_of
from heartgen.service.settings import Settings
from heartgen.service.tables import Model
from tests.service.running import Running

SPACING = 4.0
"""mm."""

PERIOD = 0.2
"""Seconds between two questions for a state."""

TICK = 0.02
"""Seconds between two looks at a job that is to be caught at work."""

FULL = 25.0
"""Seconds for which there is no room, at least: longer than a server is waited for."""

PATIENCE = 240.0
"""Seconds more until a job comes to write, on a busy machine."""

WORDS = [
    *("basal", "apical", "dense", "sparse", "stack", "cine", "repaired"),
    *("thick", "thin", "dilated", "scar", "control"),
]


def main() -> None:
    """Measure, and tell."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=("load", "kills", "library", "full"))
    parser.add_argument("--database")
    parser.add_argument("--clients", type=int, default=20)
    parser.add_argument("--each", type=int, default=10)
    parser.add_argument("--seconds", type=float, default=0.2)
    parser.add_argument("--real", action="store_true")
    parser.add_argument("--kills", type=int, default=30)
    parser.add_argument("--jobs", type=int, default=60)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--hearts", type=int, default=4)
    parser.add_argument("--size", type=int, default=96)
    parser.add_argument("--models", type=int, default=10_000)
    a = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="heartgen-service-") as place:
        folder = Path(place)
        write_mask(samples.ideal_cup(SPACING).mask, folder / "heart.nii.gz")
        sys.exit(ACTS[a.what](a, folder))


def load(a: argparse.Namespace, folder: Path) -> int:
    """Submit from many clients at once, asking for states meanwhile."""
    told = {} if a.database is None else {"database": a.database}
    light = None if a.real else a.seconds
    with Running(folder, light, scheduler=True, workers=2, **told) as running:
        times: list[float] = []
        start = time.monotonic()

        def act(number: int) -> list[str]:
            client = heartgen.Client(running.url)
            jobs = [
                client.submit(folder / "heart.nii.gz", quality=1 + number + n / 1000)
                for n in range(a.each)
            ]
            left = set(jobs)
            while left:
                for job in tuple(left):
                    before = time.perf_counter()
                    state = client.job(job)["state"]
                    times.append(time.perf_counter() - before)
                    if state in ("done", "failed"):
                        left.discard(job)
                    time.sleep(PERIOD)
            return jobs

        with ThreadPoolExecutor(a.clients) as threads:
            jobs = [job for each in threads.map(act, range(a.clients)) for job in each]
        seconds = time.monotonic() - start
        client = heartgen.Client(running.url)
        states = Counter(client.job(job)["state"] for job in jobs)
        done = begun(folder) if a.real else (folder / "data" / "done.log").read_text().split()[1::2]
    print(f"{len(jobs)} jobs of {a.clients} clients in {seconds:.0f} s: {dict(states)}")
    print(f"done more than once: {len(done) - len(set(done))}")
    print(
        f"states answered in {1000 * median(times):.0f} ms (median), "
        f"{1000 * quantiles(times, n=20)[-1]:.0f} ms (95 %), of {len(times)}"
    )
    return 0 if states == Counter(done=len(jobs)) and len(done) == len(set(done)) else 1


def begun(folder: Path) -> list[str]:
    """What was begun, by the server's log, each as often as it was."""
    lines = (folder / "server.log").read_text().splitlines()
    told = [json.loads(line) for line in lines if line.startswith("{")]
    return [each["job"] for each in told if each["message"] == "begun"]


def kills(a: argparse.Namespace, folder: Path) -> int:
    """Kill at random moments while jobs are done."""
    chance = random.Random(a.seed)
    told = {"starts": 1000} | ({} if a.database is None else {"database": a.database})
    with Running(folder, 0.5, scheduler=True, workers=2, **told) as running:
        client = heartgen.Client(running.url)
        jobs = [client.submit(folder / "heart.nii.gz", quality=1 + n / 1000) for n in range(a.jobs)]
        killed: Counter[str] = Counter()
        while sum(killed.values()) < a.kills:
            time.sleep(chance.uniform(0.0, 3.0))
            name = chance.choice(running.names)
            if running.processes[name].poll() is None:
                running.kill(name)
                killed[name.partition("-")[0]] += 1
            for each in running.names:
                running.start(each)
            if name == "server":
                running.wait()
                extra = client.submit(
                    folder / "heart.nii.gz", quality=2 + sum(killed.values()) / 1000
                )
                jobs.append(extra)
        states = ended(running, client, jobs)
    whole, half = results(folder)
    lost = len(jobs) - states["done"]
    print(f"{sum(killed.values())} kills ({dict(killed)}), {len(jobs)} jobs: {dict(states)}")
    print(f"lost: {lost}, whole results: {whole}, half-written: {half}")
    return 1 if lost or half else 0


def results(folder: Path) -> tuple[int, int]:
    """How many results are whole, and how many are not."""
    artifacts = Artifacts(folder / "data")
    whole = half = 0
    for each in artifacts.results.iterdir():
        if each.name == ".stage":
            continue
        try:
            artifacts.summary(each.name)
            files = {file.name for file in each.iterdir()}
            if files != {"mesh.exf", "mesh.vtu", "report.json", "rows.json"}:
                raise ValueError
            whole += 1
        except (OSError, ValueError, LookupError):
            half += 1
    return whole, half


def full(a: argparse.Namespace, folder: Path) -> int:
    """Fill the disk while hearts are fitted."""
    data = folder / "data"
    data.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={a.size}m", "tmpfs", data], check=True)
    try:
        told = {} if a.database is None else {"database": a.database}
        with Running(folder, workers=2, **told) as running:
            return filled(a, folder, running)
    finally:
        subprocess.run(["umount", "--lazy", data], check=True)


def filled(a: argparse.Namespace, folder: Path, running: Running) -> int:
    """What becomes of jobs while there is no room, and after."""
    client, jobs, amiss = heartgen.Client(running.url), [], 0
    for turn in range(2):
        new = [
            client.submit(folder / "heart.nii.gz", optimize=False, quality=1 + turn + n / 100)
            for n in range(a.hearts)
        ]
        while client.job(new[0])["state"] == "queued":
            time.sleep(TICK)
        ballast = folder / "data" / "ballast"
        fill(ballast)
        if turn:
            running.kill("server")
        seen, answers, end = Counter[str](), Counter[str](), time.monotonic() + FULL
        while time.monotonic() < end or (turn == 0 and not wanted(folder, end)):
            running.start("server")
            fill(ballast)
            with suppress(httpx.HTTPError):
                health = httpx.get(f"{running.url}/healthz", timeout=30)
                answers[f"health {health.status_code}"] += 1
                refused = httpx.post(
                    f"{running.url}/v1/jobs", files={"mask": ("a.nii.gz", bytes(10**5))}, timeout=30
                )
                answers[f"upload {refused.status_code}"] += 1
                for job in new:
                    answer = httpx.get(f"{running.url}/v1/jobs/{job}", timeout=30)
                    answers[f"state {answer.status_code}"] += 1
                    seen[answer.json().get("state", "not told")] += 1
            time.sleep(PERIOD)
        ballast.unlink()
        running.wait()
        jobs += new
        states = ended(running, client, jobs)
        print(f"while there was no room: {dict(seen)}, {dict(answers)}; after: {dict(states)}")
        amiss += seen["failed"] + len(jobs) - states["done"]
    whole, half = results(folder)
    print(f"whole results: {whole}, half-written: {half}")
    return 1 if amiss or half or whole != len(jobs) else 0


def wanted(folder: Path, end: float) -> bool:
    """Whether a job wanted to write something, by the server's log, or never will."""
    log = (folder / "server.log").read_text()
    told = ("the disk is full", "the database does not answer")
    return any(words in log for words in told) or time.monotonic() > end + PATIENCE


def fill(path: Path) -> None:
    """Let a file grow until there is no room."""
    with path.open("ab", buffering=0) as file:
        for size in (2**20, 2**12, 1):
            with suppress(OSError):
                while True:
                    file.write(bytes(size))


def ended(running: Running, client: heartgen.Client, jobs: list[str]) -> Counter[str]:
    """States once all have ended; what ends with another process is started again."""
    while True:
        for each in running.names:
            running.start(each)
        try:
            states = Counter(client.job(job)["state"] for job in jobs)
        except (HeartgenError, httpx.HTTPError):
            continue
        if not states["queued"] + states["running"]:
            return states
        time.sleep(1)


def library(a: argparse.Namespace, folder: Path) -> int:
    """Fill a library with models that have metadata only, and search it."""
    chance = random.Random(a.seed)
    settings = Settings(data=folder / "data", database=a.database, rate_limit=10**9)
    app = make_app(settings)
    with app.state.service.database.writing() as session:
        session.add_all(synthetic(chance, n) for n in range(a.models))
    client = TestClient(app, base_url="http://127.0.0.1:8000")
    for what, place in {
        "page": "/library",
        "page, a word": "/library?q=dilated",
        "page, words and facets": "/library?q=thin+scar&species=human&sex=female",
        "page, far back": f"/library?offset={a.models // 2}",
        "API, a facet": "/v1/models?condition=HCM",
    }.items():
        times, own = [], []
        for _ in range(10):
            start, begun = time.perf_counter(), time.process_time()
            assert client.get(place).status_code == 200
            times.append(time.perf_counter() - start)
            own.append(time.process_time() - begun)
        print(
            f"{what:24} {1000 * median(times):5.0f} ms, of which the processor worked "
            f"{1000 * median(own):.0f} ms (medians of 10)"
        )
    return 0


def synthetic(chance: random.Random, number: int) -> Model:
    """A model without files."""
    told: dict[str, Any] = {
        "title": f"Model {number} {chance.choice(WORDS)}",
        "species": chance.choice(["human", "pig", "dog", "rat", "sheep"]),
        "condition": chance.choice(["healthy", "DCM", "HCM", "MI", "CRT", "unknown"]),
        "modality": chance.choice(["cine MRI", "CT", "DENSE", "3-D echo"]),
        "phase": chance.choice(["ED", "ES", "diastasis"]),
        "sex": chance.choice(get_args(Sex)),
        "age_band": chance.choice(get_args(AgeBand)),
        "study": f"study {chance.randrange(40)}",
        "license": chance.choice(get_args(License)),
        "keywords": chance.sample(WORDS, 3),
        "description": " ".join(chance.choices(WORDS, k=60)),
    }
    identifier = new_identifier()
    return Model(
        **told,
        identifier=identifier,
        version=1,
        latest=True,
        owner="anonymous",
        citation="",
        published=1e9 + number,
        words=words_of(Metadata(**told, no_names=True), identifier),
        provenance={},
    )


ACTS = {"load": load, "kills": kills, "library": library, "full": full}


if __name__ == "__main__":
    main()
