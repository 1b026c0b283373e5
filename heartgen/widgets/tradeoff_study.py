"""Hearts fitted with many options, to see what accuracy costs in quality; no widget is known here.

Rows are those of `heartgen.cohort.sweep`; but meshes are kept, to be looked at, and what has been
fitted is seen at once.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from traitlets import Any as AnyTrait
from traitlets import List, Tuple, Unicode

from heartgen.errors import InputError
from heartgen.options import Options, as_text, option_from_text
from heartgen.widgets.input_case import (
    InputCase,
    analyze_case,
    load_file,
    load_sample,
    name_unlike,
)
from heartgen.widgets.memory import release_memory
from heartgen.widgets.run_options import OFFERED
from heartgen.widgets.runs import Outcome, Post, Run
from heartgen.widgets.work_state import WorkState

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.cohort.rows import Row

MOST_MESHES = 100
"""Of one start: each is kept in memory, and takes some seconds."""

DEFAULT = "auto"
"""Elements that are left to heartgen."""


class TradeoffStudy(WorkState):
    """One visitor's hearts, and what has been fitted to them.

    Attributes
    ----------
    post : callable, optional
        Has a change made where the state lives; at once if omitted.
    hearts : list of InputCase
        In the order in which they came.
    levels : tuple of int
        Levels of detail that are fitted.
    elements, qualities : str
        Numbers of elements, and weights of quality, with commas between them.
    runs : list of Run
        The newest last.
    outcomes : list of Outcome
        Every mesh of every run.
    moved : object
        Set anew whenever a run has come further.
    """

    hearts: List[InputCase] = List()
    levels = Tuple(default_value=(1, 2, 3))
    elements = Unicode(DEFAULT)
    qualities = Unicode("0.3, 1, 3")
    runs: List[Run] = List()
    outcomes: List[Outcome] = List()
    moved = AnyTrait(None, allow_none=True)

    def __init__(self, post: Post | None = None) -> None:
        super().__init__(post)
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen-fit")
        self._anatomies: dict[InputCase, Anatomy] = {}

    def close(self) -> None:
        """End all work and remove what was uploaded."""
        self.cancel()
        self._pool.shutdown(wait=False, cancel_futures=True)
        super().close()

    def add_sample(self, name: str) -> Any:
        """Add a heart of the samples.

        Parameters
        ----------
        name : str
            In the catalog of `heartgen.samples`.
        """
        return self._worker.do(f"making the sample {name}", lambda: load_sample(name), self._add)

    def add_file(self, path: Path, scheme: str) -> Any:
        """Add a heart of a file.

        Parameters
        ----------
        path : Path
            The file.
        scheme : str
            As of `heartgen.widgets.input_case.load_file`.
        """
        kept = self._worker.keep(path)
        return self._worker.do(f"reading {kept.name}", lambda: load_file(kept, scheme), self._add)

    def remove(self, heart: InputCase) -> None:
        """Fit a heart no more; what was fitted stays.

        Parameters
        ----------
        heart : InputCase
            One of the hearts.
        """
        self.hearts = [each for each in self.hearts if each is not heart]

    def combinations(self) -> list[Options]:
        """Options of the runs that each heart will have.

        Raises
        ------
        InputError
            If a number is none, or there are too many.
        """
        if not self.levels:
            raise InputError("there is no level of detail to fit: tick at least one")
        elements = [option_from_text("elements", part) for part in _parts(self.elements)]
        most = [high for _, high in OFFERED["elements"]]
        if any(n > high for e in elements if e for n, high in zip(e, most, strict=True)):
            raise InputError(f"at most {as_text(most)} elements are fitted here: give less")
        qualities = [option_from_text("quality", part) for part in _parts(self.qualities)]
        made = [
            Options(lod=self.levels[0], elements=counts, quality=weight)
            for counts in elements or [None]
            for weight in qualities or [1.0]
        ]
        meshes = len(made) * len(self.levels) * max(len(self.hearts), 1)
        if meshes > MOST_MESHES:
            raise InputError(
                f"these are {meshes} meshes, more than the {MOST_MESHES} that are fitted at once: "
                "choose less, or use heartgen sweep"
            )
        return made

    def start(self) -> None:
        """Fit all hearts with all combinations that have not been fitted."""
        try:
            if not self.hearts:
                raise InputError("there is no heart yet: choose a sample or upload a mask")
            wanted = [(heart, options) for heart in self.hearts for options in self.combinations()]
        except InputError as error:
            self.complaint = str(error)
            return
        self.complaint = ""
        known = {(run.case, _key(run.options), lod) for run in self._kept() for lod in run.levels}
        made: list[Run] = []
        for heart, options in wanted:
            levels = tuple(lod for lod in self.levels if (heart, _key(options), lod) not in known)
            if levels:
                options = replace(options, lod=levels[0])
                number = len(self.runs) + len(made) + 1
                made.append(Run(heart, options, number=number, levels=levels))
        if not made:
            self.complaint = "all of this has been fitted: add a heart, or other values"
        self.runs = [*self.runs, *made]
        for run in made:
            run.observe(self._run_changed, ["phase", "shares"])
            self._pool.submit(self._work, run)

    def cancel(self) -> None:
        """End the runs that go on or wait."""
        for run in self.runs:
            run.cancel()

    @property
    def active(self) -> bool:
        """Whether a run goes on or waits."""
        return any(run.active for run in self.runs)

    def rows(self) -> list[Row]:
        """A row for each mesh, and for each that could not be made, as of `heartgen sweep`."""
        from heartgen.cohort.case import Case
        from heartgen.cohort.rows import failed_row, row_of

        made = []
        for run in self._kept():
            case = Case(run.case.name, run.case.mask)
            for outcome in run.outcomes:
                made.append(row_of(case, run.case.sha256, outcome.result.report))
            if run.phase == "failed":
                made += [
                    failed_row(case, run.case.sha256, replace(run.options, lod=lod), run.error)
                    for lod in run.levels
                ]
        return made

    def table(self) -> str:
        """The rows as CSV."""
        return csv_text(self.rows())

    def curves(self) -> list[tuple[str, list[Outcome]]]:
        """Names of curves, and their meshes along the levels of detail."""
        return curves(self.outcomes)

    def _kept(self) -> list[Run]:
        return [run for run in self.runs if run.phase != "cancelled"]

    def _work(self, run: Run) -> None:
        """In the thread: measure the heart, once, and fit."""
        if run.active and run.case not in self._anatomies:
            try:
                self._anatomies[run.case] = analyze_case(run.case, run.options)
            except Exception:
                self._anatomies.pop(run.case, None)  # the run says what is wrong
        run.work(self._anatomies.get(run.case), self.post)
        release_memory()

    def _run_changed(self, change: Any) -> None:
        """Take in what a run made."""
        run: Run = change["owner"]
        if change["name"] == "phase" and run.phase == "done":
            self.outcomes = [*self.outcomes, *run.outcomes]
        self.moved = object()

    def _add(self, heart: InputCase) -> None:
        """Take in a heart, under a name of its own."""
        if any(each.sha256 == heart.sha256 for each in self.hearts):
            self.complaint = f"{heart.name} is there already"
            return
        name = name_unlike(heart.name, {each.name for each in self.hearts})
        self.hearts = [*self.hearts, replace(heart, mask=replace(heart.mask, name=name))]


def curves(outcomes: Sequence[Outcome]) -> list[tuple[str, list[Outcome]]]:
    """Meshes by heart and options, along the levels of detail.

    Parameters
    ----------
    outcomes : sequence of Outcome
        Of all runs.

    Returns
    -------
    list of (str, list of Outcome)
        Names say what differs.
    """
    hearts = {o.case for o in outcomes}
    counts = {o.result.options.elements for o in outcomes}
    weights = {o.result.options.quality for o in outcomes}
    found: dict[str, list[Outcome]] = {}
    for o in outcomes:
        options = o.result.options
        parts = [o.case.name] if len(hearts) > 1 else []
        if len(counts) > 1:
            parts.append("x".join(map(str, options.elements or ())) or "default elements")
        if len(weights) > 1:
            parts.append(f"quality {options.quality:g}")
        found.setdefault(", ".join(parts) or o.case.name, []).append(o)
    return [(name, sorted(part, key=lambda o: o.lod)) for name, part in found.items()]


def csv_text(rows: Sequence[Row]) -> str:
    """Rows as CSV, with every column that any of them has.

    Parameters
    ----------
    rows : sequence of dict
        As of `heartgen.cohort.rows.row_of`.
    """
    from heartgen.cohort.rows import FIRST

    names = list(dict.fromkeys(name for row in rows for name in row))
    first = [name for name in FIRST if name in names]
    made = io.StringIO()
    writer = csv.DictWriter(
        made, [*first, *(n for n in names if n not in first)], lineterminator="\n"
    )
    writer.writeheader()
    writer.writerows(rows)
    return made.getvalue()


def _key(options: Options) -> Options:
    """What tells runs apart but for the level."""
    return replace(options, lod=1)


def _parts(text: str) -> Iterable[str]:
    """What stands between commas."""
    return list(dict.fromkeys(part.strip() for part in text.split(",") if part.strip()))
