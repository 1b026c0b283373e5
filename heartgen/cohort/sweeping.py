"""`sweep`: hearts meshed with all combinations of options, to see what each is worth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.cohort.case import Case
from heartgen.cohort.cases import check_names, find_cases
from heartgen.cohort.job import Job
from heartgen.cohort.run import Progress, quiet, run
from heartgen.cohort.store import CASES
from heartgen.cohort.workers import Workers
from heartgen.images import Mask
from heartgen.options import Options, as_text
from heartgen.renamed import new_options

if TYPE_CHECKING:
    import pandas as pd

LEVELS = [1, 2, 3, 4, 5]


def sweep(
    hearts: Mask | str | Path | Iterable[Mask | Case],
    *,
    lod: int | list[int] = LEVELS,
    options: Options | None = None,
    out: str | Path | None = None,
    workers: Workers | None = None,
    redo: bool = False,
    progress: Progress = quiet,
    **choices: Any,
) -> pd.DataFrame:
    """Fit hearts with every combination of options; levels of detail share their work.

    Parameters
    ----------
    hearts : Mask, path, or iterable of masks or cases
        One heart or many; a path as of `find_cases`.
    lod : int, or list of int
        Levels of detail.
    options : Options, optional
        Of all fits, where nothing else is asked for.
    out : path, optional
        Folder for ``results.csv`` and ``results.parquet``. What is done is then not done again.
    workers : Workers, optional
        Of `batch`; this process alone if not given.
    redo : bool
        As of `batch`.
    progress : callable
        Called with the number of fits that are done, that of all, and the rows of the last one,
        where all levels count as one fit.
    **choices : object
        Options: a value, or a list of values, such as ``elements=[(1, 12, 6), (2, 12, 6)]`` or
        ``quality=[0.5, 1.0, 2.0]``.

    Returns
    -------
    DataFrame
        A row for each heart, combination and level of detail, as of `batch`.

    Raises
    ------
    HeartgenError
        As of `batch`; or if a combination of options contradicts itself.
    """
    cases = _cases(hearts)
    folder = None if out is None else Path(out).absolute()
    levels = tuple(lod) if isinstance(lod, list) else (lod,)
    jobs = [
        _job(case, replace(options or Options(), **choice), choice, levels, folder)
        for case in cases
        for choice in combinations(new_options(choices))
    ]
    return run(jobs, folder, workers, redo=redo, progress=progress)


def combinations(choices: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All combinations of values.

    Parameters
    ----------
    choices : mapping of str to value, or to list of values
        A list stands for several values; whatever else, a tuple as well, for one.

    Returns
    -------
    list of dict
        The last option changes fastest.
    """
    values: Sequence[Sequence[Any]] = [v if isinstance(v, list) else [v] for v in choices.values()]
    return [dict(zip(choices, point, strict=True)) for point in product(*values)]


def _cases(hearts: Mask | str | Path | Iterable[Mask | Case]) -> list[Case]:
    """Whatever is given, as cases."""
    if isinstance(hearts, (str, Path)):
        return find_cases(Path(hearts))
    several = [hearts] if isinstance(hearts, Mask) else hearts
    cases = [Case(heart.name, heart) if isinstance(heart, Mask) else heart for heart in several]
    check_names(cases)
    return cases


def _job(
    case: Case, options: Options, choice: dict[str, Any], levels: tuple[int, ...], out: Path | None
) -> Job:
    """The work on a case with one combination."""
    options = replace(options, lod=levels[0], **new_options(case.choices))
    for lod in levels:
        replace(options, lod=lod)  # refuses levels that do not exist before any work is done
    varied = ",".join(f"{name}={as_text(value)}" for name, value in choice.items())
    folder = None if out is None else out / CASES
    return Job(f"{case.name}/{varied or 'default'}", case, options, levels, folder)
