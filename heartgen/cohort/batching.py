"""`batch`: many hearts, one mesh each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.cohort.case import Case
from heartgen.cohort.cases import check_names, find_cases
from heartgen.cohort.job import Job
from heartgen.cohort.run import Progress, quiet, run
from heartgen.cohort.store import CASES
from heartgen.cohort.workers import Workers
from heartgen.options import Options
from heartgen.renamed import new_options

if TYPE_CHECKING:
    import pandas as pd

FORMATS = ("exf", "vtu")


def batch(
    hearts: str | Path | Iterable[Case],
    out: str | Path,
    options: Options | None = None,
    *,
    workers: Workers | None = None,
    formats: tuple[str, ...] = FORMATS,
    redo: bool = False,
    progress: Progress = quiet,
    **choices: Any,
) -> pd.DataFrame:
    """Fit a mesh to each heart of a cohort.

    What is done is not done again: a run that was stopped, or killed, goes on where it was.

    Parameters
    ----------
    hearts : path, or iterable of Case
        A folder of masks, a table, or cases; see `find_cases`.
    out : path
        Gets a folder for each case in ``cases``, with its meshes, ``report.json`` and
        ``rows.json``, and all results as ``results.csv`` and ``results.parquet``.
    options : Options, optional
        Of all cases; options of their own come first.
    workers : Workers, optional
        One process for each core of this machine if not given. In a script, the call has to be
        under ``if __name__ == "__main__":``, for the processes read the script anew.
    formats : tuple of str
        Of the meshes.
    redo : bool
        Do again what failed, or was done with other options or of another mask.
    progress : callable
        Called with the number of cases that are done, that of all, and the rows of the last one.

    **choices : object
        Single options that replace those of `options`.

    Returns
    -------
    DataFrame
        A row for each case; ``status`` begins with ``failed:`` where there is no mesh.

    Raises
    ------
    HeartgenError
        If there are no cases, the results cannot be written, or there are others in their place.
        What is wrong with a single case is in its row.
    """
    common = replace(options or Options(), **new_options(choices))
    cases = find_cases(Path(hearts)) if isinstance(hearts, (str, Path)) else list(hearts)
    check_names(cases)
    out = Path(out).absolute()
    jobs = [_job(case, common, out / CASES, formats) for case in cases]
    return run(jobs, out, workers or Workers(), redo=redo, progress=progress)


def _job(case: Case, common: Options, folder: Path, formats: tuple[str, ...]) -> Job:
    """The work on a case."""
    options = replace(common, **new_options(case.choices))
    return Job(case.name, case, options, (options.lod,), folder, formats)
