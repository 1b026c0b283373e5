"""One run of the pipeline: how far it is, how long it will take, and how to stop it."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from traitlets import Any as AnyTrait
from traitlets import Dict, Enum, Float, HasTraits, Int, Tuple, Unicode

from heartgen.errors import Cancelled, sentence
from heartgen.options import STEPS

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.options import Options
    from heartgen.result import Personalization
    from heartgen.widgets.input_case import InputCase
    from heartgen.widgets.session import Session

INTERVAL = 0.2
"""Least seconds between two reports of progress, so that the page can keep up."""

ALL_LEVELS = (1, 2, 3, 4, 5)
"""Levels of detail that there are."""

Post = Callable[[Callable[[], None]], Any]
"""Has something done where the state may be changed: on the kernel's loop."""

Progress = Callable[[str, float], None]
"""Takes the running step and the share of it that is done; raises `Cancelled` to end the work."""

Make = Callable[["Run", "Anatomy | None", Progress], "Sequence[Personalization]"]
"""Makes what a run is for: one result for each of its levels."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """A mesh that came out of a run.

    Attributes
    ----------
    run : int
        Number of the run.
    case : InputCase
        The input.
    result : Personalization
        What the pipeline gave.
    source : Run, optional
        The run.
    """

    run: int
    case: InputCase
    result: Personalization
    source: Run | None = None

    @property
    def lod(self) -> int:
        """Level of detail."""
        return int(self.result.options.lod)

    @property
    def title(self) -> str:
        """Name in lists."""
        name = self.source.name if self.source is not None else ""
        return f"{self.run} · {name or self.case.name} · LoD {self.lod}"


@dataclass(frozen=True, eq=False)
class Waiting:
    """A heart that waits to be read and fitted.

    Attributes
    ----------
    origin : dict of str to str
        Where it comes from, as of `InputCase`.
    options : Options
        Of its run.
    """

    origin: dict[str, str]
    options: Options


class Run(HasTraits):
    """A run, from waiting to its end.

    Attributes
    ----------
    case : InputCase
        The input.
    options : Options
        Of the pipeline.
    make : callable, optional
        Makes the results; `fit_here` if omitted.
    **traits : object
        First values of the attributes.
    phase : {"waiting", "running", "done", "failed", "cancelled"}
    step : str
        The running step.
    shares : dict of str to float
        Share of each step that is done.
    left : float
        Seconds left, as expected; nan where nothing is known.
    seconds : float
        Since it started, or taken in all.
    error : str
        Why it failed, in a sentence.
    outcomes : tuple of Outcome
    name : str
        Given by the visitor; empty for that of the input.
    reused : tuple of str
        Steps of an earlier run, or of the look at the input, that were not done again.
    anatomy : Anatomy or None
        The input's, as the run began with it.
    """

    number = Int()
    levels = Tuple()
    phase = Enum(["waiting", "running", "done", "failed", "cancelled"], "waiting")
    step = Unicode("")
    shares = Dict()
    left = Float(float("nan"))
    seconds = Float(0.0)
    error = Unicode("")
    outcomes = Tuple()
    expected = Dict()
    case = AnyTrait()
    options = AnyTrait()
    name = Unicode("")
    reused = Tuple()
    anatomy = AnyTrait(None, allow_none=True)

    def __init__(
        self, case: InputCase, options: Options, make: Make | None = None, **traits: Any
    ) -> None:
        super().__init__(case=case, options=options, **traits)
        self.make = make or fit_here
        self.shares = dict.fromkeys(STEPS, 0.0)
        self._stop = threading.Event()
        self._started = 0.0
        self._passes = dict.fromkeys(STEPS, 0)
        self._told = 0.0

    @property
    def active(self) -> bool:
        """Whether it is waiting or running."""
        return self.phase in ("waiting", "running")

    @property
    def title(self) -> str:
        """Name in lists."""
        detail = "all levels" if len(self.levels) > 1 else f"LoD {self.levels[0]}"
        return f"{self.number} · {self.name or self.case.name} · {detail}"

    def cancel(self) -> None:
        """Stop it; on the page it has stopped at once, the pipeline follows at its next report."""
        if self.active:
            self._stop.set()
            self.phase = "cancelled"

    def work(self, anatomy: Anatomy | None, post: Post) -> None:
        """Do the work, in a thread of its own; all that changes is posted.

        Parameters
        ----------
        anatomy : Anatomy or None
            The input's, if it is measured already; otherwise None.
        post : callable
            Has a change made where the state lives.
        """
        self._started = time.perf_counter()
        try:
            self.raise_if_stopped()
            post(lambda: self._become("running"))
            measured = self._measured(anatomy)
            results = self.make(self, measured, lambda step, done: self._report(step, done, post))
            self.raise_if_stopped()
        except Cancelled:
            return
        except Exception as error:
            said = sentence(error)
            post(lambda: self._fail(said))
        else:
            outcomes = tuple(Outcome(self.number, self.case, result, self) for result in results)
            post(lambda: self._finish(outcomes))

    def _measured(self, anatomy: Anatomy | None) -> Anatomy | None:
        """What a fit begins with: further views count where the heart is measured."""
        if anatomy is not None or not self.case.views:
            return anatomy
        from heartgen.widgets.input_case import analyze_case

        return analyze_case(self.case, self.options)

    def raise_if_stopped(self) -> None:
        """End the work of a run that was cancelled.

        Raises
        ------
        Cancelled
            If it was.
        """
        if self._stop.is_set():
            raise Cancelled("cancelled")

    def _report(self, step: str, done: float, post: Post) -> None:
        """Called by the pipeline, in its thread."""
        self.raise_if_stopped()
        if done >= 1:
            self._passes[step] += 1
        elif time.perf_counter() - self._told < INTERVAL and done > 0:
            return
        self._told = time.perf_counter()
        rounds = len(self.levels) if self._repeats(step) else 1
        share = min((self._passes[step] + (done if done < 1 else 0)) / rounds, 1.0)
        seconds = self._told - self._started
        post(lambda: self._advance(step, share, seconds))

    def _repeats(self, step: str) -> bool:
        """Whether a step is done for each level anew."""
        return STEPS.index(step) > STEPS.index("registration")

    def _advance(self, step: str, share: float, seconds: float) -> None:
        """Take in a report."""
        if self.phase != "running":
            return
        with self.hold_trait_notifications():
            self.step = step
            self.shares = {**self.shares, step: share}
            self.seconds = seconds
            self.left = self._expect_left(seconds)

    def _expect_left(self, seconds: float) -> float:
        """Seconds left, from what was expected and what the time so far says about that."""
        past = sum(self.expected.get(s, 0.0) * share for s, share in self.shares.items())
        rest = sum(self.expected.get(s, 0.0) * (1 - share) for s, share in self.shares.items())
        if past <= 0:
            return float(rest)
        weight = past / (past + rest)
        return float(rest * (1 - weight + weight * seconds / past))

    def _become(self, phase: str) -> None:
        if self.active:
            self.phase = phase

    def _fail(self, sentence: str) -> None:
        if self.active:
            self.error = sentence
            self.phase = "failed"

    def _finish(self, outcomes: tuple[Outcome, ...]) -> None:
        if not self.active:
            return
        self.seconds = time.perf_counter() - self._started
        self.left = 0.0
        self.shares = dict.fromkeys(STEPS, 1.0)  # of what was there already, nothing was told
        self.outcomes = outcomes
        self.phase = "done"


def fit_here(run: Run, anatomy: Anatomy | None, progress: Progress) -> Sequence[Personalization]:
    """Fit the meshes of a run in this process.

    Parameters
    ----------
    run : Run
        With input, options and levels.
    anatomy : Anatomy or None
        The input's, if it is measured already; otherwise None.
    progress : callable
        Told how far it is.
    """
    from heartgen.pipeline import personalize_levels

    return personalize_levels(
        run.case.mask, run.levels, run.options, progress=progress, anatomy=anatomy
    )


def post_on_loop() -> Post | None:
    """Where the state may be changed: on the kernel's loop, if there is one."""
    try:
        return asyncio.get_running_loop().call_soon_threadsafe
    except RuntimeError:
        return None


def with_lod(options: Options, lod: int) -> Options:
    """The same options at another level of detail.

    Parameters
    ----------
    options : Options
        Of a run.
    lod : int
        Level of detail.
    """
    return replace(options, lod=lod)


def siblings(session: Session, outcome: Outcome) -> list[Outcome]:
    """Outcomes of the same case, one for each level of detail, the newest of each.

    Parameters
    ----------
    session : Session
        The visitor's work.
    outcome : Outcome
        A mesh of the case.
    """
    newest = {o.lod: o for o in session.outcomes if o.case is outcome.case}
    return [newest[lod] for lod in sorted(newest)]
