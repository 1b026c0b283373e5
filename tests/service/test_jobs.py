"""States of jobs: each transition happens once, whoever else wants it at the same time."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import pytest
from sqlalchemy import update

from heartgen.service.database import Database, upgrade
from heartgen.service.jobs import Jobs
from heartgen.service.settings import Settings
from heartgen.service.tables import Job, State


@pytest.fixture
def jobs(settings: Settings):
    """An empty queue."""
    upgrade(settings.database_url)
    database = Database(settings.database_url)
    yield Jobs(database)
    database.close()


def job(number: int = 0, **changes: object) -> Job:
    """A job as it is submitted."""
    told = {
        "owner": "somebody",
        "fingerprint": f"{number:064x}",
        "title": f"heart {number}",
        "upload": "uploads/0/mask.nii.gz",
        "upload_sha256": "0" * 64,
        "options": {},
        "selection": {},
        "created": float(number),
    }
    return Job(**(told | changes))


def test_oldest_is_done_first_and_place_in_queue_is_told(jobs: Jobs) -> None:
    first, second = (jobs.submit(job(n))[0] for n in (1, 2))
    assert (jobs.place(first), jobs.place(second)) == (1, 2)
    claimed = jobs.claim("a")
    assert claimed is not None
    assert (claimed.id, claimed.state, claimed.starts) == (first.id, State.RUNNING, 1)
    assert (jobs.place(claimed), jobs.place(second)) == (None, 1)


def test_no_job_is_claimed_twice(jobs: Jobs) -> None:
    for n in range(12):
        jobs.submit(job(n))
    with ThreadPoolExecutor(6) as threads:
        claimed = list(threads.map(jobs.claim, [f"server {n % 3}" for n in range(18)]))
    found = [each.id for each in claimed if each is not None]
    assert len(found) <= 12
    assert len(set(found)) == len(found)
    rest = iter(lambda: jobs.claim("last"), None)
    assert len(found) + len(list(rest)) == 12


def test_same_mask_and_options_are_done_once(jobs: Jobs) -> None:
    first = jobs.submit(job(1, owner="a"))[0]
    twin = jobs.submit(job(1, owner="b", created=2.0))[0]
    assert jobs.claim("s") is not None
    assert jobs.claim("s") is None
    jobs.finish(first.id, State.DONE, None, {"status": "success"})
    told = jobs.get(twin.id)
    assert told is not None
    assert (told.state, told.summary) == (State.DONE, {"status": "success"})
    late, new = jobs.submit(job(1, owner="c"))
    assert new
    assert late.state == State.DONE


def test_an_end_is_final(jobs: Jobs) -> None:
    submitted, _ = jobs.submit(job(1))
    assert not jobs.finish(submitted.id, State.DONE, None, None)
    jobs.claim("s")
    assert jobs.cancel(submitted.id)
    assert not jobs.cancel(submitted.id)
    assert not jobs.finish(submitted.id, State.DONE, None, None)
    assert jobs.renew("s", [submitted.id]) == set()
    jobs.put_back("s", [submitted.id])
    told = jobs.get(submitted.id)
    assert told is not None
    assert told.state == State.CANCELLED


def test_jobs_of_a_lost_server_wait_again_and_not_for_ever(jobs: Jobs) -> None:
    submitted, _ = jobs.submit(job(1))
    for start in range(1, 4):
        claimed = jobs.claim(f"server {start}")
        assert claimed is not None
        assert claimed.starts == start
        assert jobs.put_back_lost(3) == 0
        with jobs.database.writing() as session:
            session.execute(update(Job).values(lease=0.0))
        assert jobs.put_back_lost(3) == 1
    told = jobs.get(submitted.id)
    assert told is not None
    assert told.state == State.FAILED
    assert "interrupted 3 times" in (told.reason or "")


def test_another_server_does_not_take_what_is_renewed(jobs: Jobs) -> None:
    submitted, _ = jobs.submit(job(1))
    jobs.claim("a")
    with jobs.database.writing() as session:
        session.execute(update(Job).values(lease=0.0))
    assert jobs.renew("a", [submitted.id]) == {submitted.id}
    assert jobs.put_back_lost(9) == 0
    jobs.tell(submitted.id, "b", "registration", 0.5)
    assert jobs.get(submitted.id).step is None
    jobs.tell(submitted.id, "a", "registration", 0.5)
    assert jobs.get(submitted.id).step == "registration"
