"""The folder of a batch or a sweep: what is done in it, and the tables of all results."""

from __future__ import annotations

import shutil
import time
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from filelock import FileLock, Timeout

from heartgen.cohort.job import STAGE, Job, is_as_asked, rows_of
from heartgen.cohort.rows import FAILED, Row, table_of
from heartgen.errors import HeartgenError, InputError
from heartgen.files import replacing, results_in
from heartgen.renamed import new_table

if TYPE_CHECKING:
    import pandas as pd

CASES = "cases"
"""Folder of the jobs' folders."""

TABLE = "results"
"""Name of the tables, without the ending."""

LOCK = ".lock"

INTERVAL, SHARE = 2.0, 0.01
"""Least seconds between two writings of the tables, and share of the time that they may take."""


@contextmanager
def opened(out: Path) -> Iterator[None]:
    """Have a folder of results for oneself, without what killed runs left unfinished.

    Parameters
    ----------
    out : Path
        The folder; may be absent.

    Raises
    ------
    HeartgenError
        If it cannot be written, or another run has it.
    """
    with results_in(out):
        try:
            with FileLock(out / LOCK, timeout=0):
                shutil.rmtree(out / CASES / STAGE, ignore_errors=True)
                yield
                shutil.rmtree(out / CASES / STAGE, ignore_errors=True)
        except Timeout:
            raise HeartgenError(
                f"{out}: another run writes its results there: wait for it, or choose another "
                "folder"
            ) from None


def done_before(jobs: Sequence[Job], redo: bool) -> dict[str, list[Row]]:
    """Rows, by name, of the jobs that are done.

    Parameters
    ----------
    jobs : sequence of Job
        Those to look for.
    redo : bool
        Forget those that failed, and those that were asked for something else.

    Raises
    ------
    InputError
        If a job was asked for something else, and is not to be done again.
    """
    done: dict[str, list[Row]] = {}
    for job in jobs:
        rows = rows_of(job)
        if rows is None:
            continue
        same = is_as_asked(job)
        if redo and not (same and all(succeeded(row) for row in rows)):
            _forget(job)
        elif same:
            done[job.name] = rows
        else:
            raise InputError(
                f"{job.home}: these are results of other options, or of a mask that has changed "
                "since: choose another folder, or have it done again with --redo"
            )
    return done


def succeeded(row: Row) -> bool:
    """Whether there is a mesh.

    Parameters
    ----------
    row : Row
        Of a result.
    """
    return not row["status"].startswith(FAILED)


class Tables:
    """The tables of all results, in the order of the jobs, written anew as results come in.

    Parameters
    ----------
    out : Path or None
        Folder of all results; None if nothing is to be written.
    jobs : sequence of Job
        In the order of the tables.
    """

    def __init__(self, out: Path | None, jobs: Sequence[Job]) -> None:
        self.out, self.names = out, [job.name for job in jobs]
        self.rows: dict[str, list[Row]] = {}
        self._next = 0.0

    def add(self, name: str, rows: list[Row]) -> None:
        """Take in the rows of a job.

        Parameters
        ----------
        name : str
            Of the job.
        rows : list of Row
            Of the job.
        """
        self.rows[name] = rows
        if time.monotonic() >= self._next:
            self.write()

    def write(self) -> pd.DataFrame:
        """Write the tables, and return what is in them."""
        start = time.monotonic()
        table = table_of(row for name in self.names for row in self.rows.get(name, ()))
        if self.out is not None:
            with replacing(self.out / f"{TABLE}.csv") as path:
                table.to_csv(path, index=False)
            with replacing(self.out / f"{TABLE}.parquet") as path:
                table.to_parquet(path, index=False)
        end = time.monotonic()
        self._next = end + max(INTERVAL, (end - start) / SHARE)
        return table


def read_results(out: Path) -> pd.DataFrame:
    """Read the table of a folder of results.

    Parameters
    ----------
    out : Path
        Folder of all results.

    Raises
    ------
    InputError
        If there is none.
    """
    import pandas as pd

    path = out / f"{TABLE}.parquet"
    if not path.is_file():
        raise InputError(f"{out}: there is no {path.name}: give a folder that heartgen batch made")
    return new_table(pd.read_parquet(path))


def _forget(job: Job) -> None:
    """Remove the folder of a job, at once for whoever looks at it."""
    if job.folder is None or job.home is None:
        return
    (job.folder / STAGE).mkdir(parents=True, exist_ok=True)
    away = job.folder / STAGE / uuid.uuid4().hex
    job.home.rename(away)
    shutil.rmtree(away, ignore_errors=True)
