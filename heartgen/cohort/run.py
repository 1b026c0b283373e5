"""Do many jobs: what is done stays done, whatever happens to the others or to this process."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from heartgen.cohort.job import Job, do, give_up
from heartgen.cohort.rows import Row
from heartgen.cohort.store import Tables, done_before, opened
from heartgen.cohort.workers import Workers

if TYPE_CHECKING:
    import pandas as pd

Progress = Callable[[int, int, list[Row]], None]
"""Called with the number of jobs that are done, that of all, and the rows of the last one."""


def quiet(done: int, total: int, rows: list[Row]) -> None:
    """Progress that nobody looks at.

    Parameters
    ----------
    done : int
        Jobs that are done.
    total : int
        All jobs.
    rows : list of Row
        Of the job that was done last.
    """


def run(
    jobs: Sequence[Job],
    out: Path | None = None,
    workers: Workers | None = None,
    *,
    redo: bool = False,
    progress: Progress = quiet,
) -> pd.DataFrame:
    """Do the jobs that are not done yet.

    Parameters
    ----------
    jobs : sequence of Job
        What is to be done.
    out : Path or None
        Folder of all results; None if nothing is to be written.
    workers : Workers or None
        None to work in this process.
    redo : bool
        Do again what failed, or was asked for something else.
    progress : callable
        Called with the number of jobs done, that of all, and the rows of the last one.

    Returns
    -------
    DataFrame
        A row for each job and level, in the order of the jobs.

    Raises
    ------
    HeartgenError
        If results cannot be written, or there are others in their place.
    """
    if out is None:
        return _run(jobs, Tables(None, jobs), workers, progress)
    with opened(out):
        tables = Tables(out, jobs)
        tables.rows = done_before(jobs, redo)
        return _run(jobs, tables, workers, progress)


def _run(
    jobs: Sequence[Job], tables: Tables, workers: Workers | None, progress: Progress
) -> pd.DataFrame:
    """Do what is missing in the tables."""
    todo = [job for job in jobs if job.name not in tables.rows]
    progress(0, len(jobs), [])
    for n, rows in enumerate(tables.rows.values(), start=1):
        progress(n, len(jobs), rows)
    try:
        for job, rows in _each(todo, workers):
            tables.add(job.name, rows)
            progress(len(tables.rows), len(jobs), rows)
    finally:
        table = tables.write()
    return table


def _each(jobs: Sequence[Job], workers: Workers | None) -> Iterator[tuple[Job, list[Row]]]:
    """Jobs and their rows, as they are done."""
    if workers is None or not jobs:
        yield from ((job, do(job)) for job in jobs)
        return
    from heartgen.cohort.cluster import Died, connected, each
    from heartgen.cohort.isolation import MINUTE, do_apart, end_idle

    limit = None if workers.time_limit is None else MINUTE * workers.time_limit
    with connected(workers, len(jobs)) as client:
        try:
            for job, found in each(client, partial(do_apart, limit=limit), jobs):
                yield job, give_up(job, found.reason) if isinstance(found, Died) else found
        finally:
            if workers.scheduler is not None:  # these workers stay, what they started should not
                client.run(end_idle, on_error="ignore")
