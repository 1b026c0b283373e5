"""The state of one visitor's page: input, choices, runs, what is looked at, and every step's state.

Nothing here knows a widget. Long work is done in one thread; what it changes is posted to where
the state lives.
"""

from __future__ import annotations

import shutil
import tempfile
import threading
import traceback
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from traitlets import observe

from heartgen.errors import HeartgenError, sentence
from heartgen.options import ANALYZED
from heartgen.widgets.costs import Costs
from heartgen.widgets.input_case import (
    BINARY,
    InputCase,
    LabelMapError,
    analyze_case,
    load_file,
    load_sample,
)
from heartgen.widgets.memory import release_memory
from heartgen.widgets.run_options import RunOptions
from heartgen.widgets.runs import Make, Outcome, Post, Run, fit_here
from heartgen.widgets.session_state import SessionState
from heartgen.widgets.steps import step_states

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.options import Options

MAX_UPLOAD = 400 * 1024 * 1024
"""Largest upload, bytes: compressed label maps of the 1024^3 voxels that are read are smaller."""

ALL_LEVELS = (1, 2, 3, 4, 5)


class Session(SessionState):
    """One visitor's work, and the state that it leads to.

    Attributes
    ----------
    post : callable, optional
        Has a change made where the state lives; at once if omitted.
    **traits : object
        First values of the state's attributes.
    """

    def __init__(self, post: Post | None = None, **traits: Any) -> None:
        super().__init__(choices=RunOptions(), **traits)
        self._post: Post = post or (lambda change: change())
        self.costs = Costs()
        self.folder = Path(tempfile.mkdtemp(prefix="heartgen-"))
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen")
        self._ask = 0
        self._lock = threading.Lock()
        self._measured: tuple[Any, ...] = ()
        self.choices.observe(self._chosen)
        self._judge_steps()

    def post(self, change: Callable[[], None]) -> None:
        """Have the state changed where it lives; what goes wrong there is told, not lost.

        Parameters
        ----------
        change : callable
            Makes the change.
        """
        self._post(lambda: self._guarded(change))

    def close(self) -> None:
        """End all work and remove what was uploaded."""
        for run in self.runs:
            run.cancel()
        self._pool.shutdown(wait=False, cancel_futures=True)
        shutil.rmtree(self.folder, ignore_errors=True)

    def load_sample(self, name: str) -> Future[None]:
        """Take a sample for the input.

        Parameters
        ----------
        name : str
            In the catalog of `heartgen.samples`.
        """
        return self._load(f"making the sample {name}", lambda: load_sample(name))

    def load_file(self, path: Path, scheme: str = BINARY, frame: str = "") -> Future[None]:
        """Take a file for the input.

        Parameters
        ----------
        path : Path
            The file.
        scheme : str
            As of `heartgen.widgets.input_case.load_file`.
        frame : str
            As of `heartgen.widgets.input_case.load_file`.
        """
        return self._load(f"reading {path.name}", lambda: load_file(path, scheme, frame))

    def start(self, levels: tuple[int, ...] | None = None, make: Make = fit_here) -> Future[None]:
        """Start a run with the choices of the moment, at one level or at several.

        Parameters
        ----------
        levels : tuple of int, optional
            Levels of detail; the chosen one if omitted.
        make : callable
            Makes the results, as of `Run`.

        Raises
        ------
        HeartgenError
            If there is no input, or the choices contradict each other.
        """
        if self.case is None:
            raise HeartgenError("there is no mask to mesh yet: choose a sample or upload one")
        if self.awaited or self.complaint:
            raise HeartgenError("the input was refused or is not read yet: choose one, or wait")
        options = self.choices.options()
        case, anatomy = self.case, self._anatomy_for(options)
        levels = levels or (options.lod,)
        run = Run(case, options, make, number=len(self.runs) + 1, levels=levels)
        run.expected = self.costs.expect(options, self.both, levels, anatomy is not None)
        run.observe(self._run_changed, names=["phase"])
        self.runs = [*self.runs, run]
        return self._pool.submit(self._work_on_run, run, anatomy)

    def _work_on_run(self, run: Run, anatomy: Anatomy | None) -> None:
        """In the thread: run."""
        run.work(anatomy, self.post)
        release_memory()

    def sweep(self) -> Future[None]:
        """Fit all levels of detail."""
        return self.start(ALL_LEVELS)

    def refuse(self, sentence: str) -> None:
        """Say why an input was not even read.

        Parameters
        ----------
        sentence : str
            What is wrong, and what to do.
        """
        self.awaited = True
        self._complain(self._new_ask(), sentence)

    def keep(self) -> None:
        """Go on with the case there was before an input was refused."""
        self._new_ask()
        with self.hold_trait_notifications():
            self.awaited, self.reading, self.complaint, self.offer = False, "", "", ""
        self._measure_anew()
        self._judge_steps()

    def show(self, outcome: Outcome) -> None:
        """Look at a mesh; the input becomes the one it was made of.

        Parameters
        ----------
        outcome : Outcome
            The mesh.
        """
        if outcome.case is not self.case or self.awaited:
            self._new_ask()
            with self.hold_trait_notifications():
                self.case = outcome.case
                self.anatomy = outcome.result.anatomy
                self._measured = _measured(outcome.case, outcome.result.options)
                self.awaited, self.reading, self.complaint, self.offer = False, "", "", ""
        self.shown = outcome
        self._judge_steps()

    @property
    def both(self) -> bool:
        """Whether both ventricles will be meshed, as far as is known."""
        if self.anatomy is not None:
            return self.anatomy.rv is not None
        return bool(self.choices.ventricles == "biv")

    @property
    def active_run(self) -> Run | None:
        """The run that goes on, or waits."""
        return next((run for run in reversed(self.runs) if run.active), None)

    def expected_seconds(self, levels: tuple[int, ...] | None = None) -> float:
        """Seconds a run with the choices of the moment is expected to take.

        Parameters
        ----------
        levels : tuple of int, optional
            Levels of detail; the chosen one if omitted.
        """
        options = self.choices.options()
        analyzed = self._anatomy_for(options) is not None
        expected = self.costs.expect(options, self.both, levels or (options.lod,), analyzed)
        return sum(expected.values())

    def _anatomy_for(self, options: Options) -> Anatomy | None:
        """The anatomy, if it was measured under these options."""
        known = self.case is not None and self._measured == _measured(self.case, options)
        return self.anatomy if known else None

    def _load(self, doing: str, make: Callable[[], InputCase]) -> Future[None]:
        """Make a case and measure the heart in it, in the thread."""
        for run in self.runs:
            if run.phase == "waiting":
                run.cancel()
        with self.hold_trait_notifications():
            self.awaited, self.reading, self.complaint, self.offer = True, doing, "", ""
        self._judge_steps()
        return self._pool.submit(self._work_on_input, self._new_ask(), make)

    def _work_on_input(self, ask: int, make: Callable[[], InputCase]) -> None:
        """In the thread: read, show, measure."""
        case = self._told(ask, make)
        if case is not None:
            self.post(lambda: self._take_case(ask, case))
            self._measure(ask, case, self.choices.options())

    def _measure(self, ask: int, case: InputCase, options: Options) -> None:
        """In the thread: measure the heart."""
        anatomy = self._told(ask, lambda: analyze_case(case, options))
        if anatomy is not None:
            self.post(lambda: self._take_anatomy(ask, case, options, anatomy))

    def _told(self, ask: int, make: Callable[[], Any]) -> Any:
        """What `make` gives; where it fails, the sentence goes to the page."""
        if ask != self._ask:
            return None
        try:
            return make()
        except Exception as error:
            said = sentence(error)
            offer = error.scheme if isinstance(error, LabelMapError) else ""
        self.post(lambda: self._complain(ask, said, offer))
        return None

    def _new_ask(self) -> int:
        """A number for a question; answers to older ones are no longer wanted."""
        with self._lock:
            self._ask += 1
            return self._ask

    def _take_case(self, ask: int, case: InputCase) -> None:
        if ask != self._ask:
            return
        with self.hold_trait_notifications():
            self._measured = ()
            self.anatomy = None
            self.shown = None
            self.case = case
            self.awaited = False
            self.reading = f"measuring the heart in {case.name}"
        self._judge_steps()

    def _take_anatomy(self, ask: int, case: InputCase, options: Options, anatomy: Anatomy) -> None:
        if ask != self._ask:
            return
        self._measured = _measured(case, options)
        with self.hold_trait_notifications():
            self.anatomy = anatomy
            self.reading, self.complaint = "", ""
            self.cost_revision += 1
        self._judge_steps()

    def _guarded(self, change: Callable[[], None]) -> None:
        """Do a change that nobody waits for."""
        try:
            change()
        except Exception as error:
            traceback.print_exc()
            self._complain(
                self._ask,
                f"the page itself failed ({type(error).__name__}: {error}): please report it",
            )

    def _complain(self, ask: int, sentence: str, offer: str = "") -> None:
        if ask != self._ask:
            return
        with self.hold_trait_notifications():
            self.reading, self.complaint, self.offer = "", sentence, offer
        self._judge_steps()

    def _chosen(self, change: Any) -> None:
        """Measure anew where a choice changes what the shape analysis sees."""
        self.cost_revision += 1
        if change["name"] in ANALYZED and not self.awaited:
            self._measure_anew()
        self._judge_steps()

    def _measure_anew(self) -> None:
        """Measure the heart, if it was not under the choices of the moment."""
        try:
            options = self.choices.options()
        except HeartgenError:
            return
        if self.case is None:
            return
        ask = self._new_ask()
        if self._anatomy_for(options) is not None:
            self.reading, self.complaint = "", ""
        else:
            self.reading = f"measuring the heart in {self.case.name}"
            self._pool.submit(self._measure, ask, self.case, options)

    def _run_changed(self, change: Any) -> None:
        """Take in what a run made."""
        run: Run = change["owner"]
        if run.phase == "done":
            if run.make is fit_here:
                self.costs.learn(run.expected, run.seconds)
            with self.hold_trait_notifications():
                self.outcomes = [*self.outcomes, *run.outcomes]
                if run.case is self.case:  # another heart may have come in the meantime
                    wanted = [o for o in run.outcomes if o.lod == self.choices.lod]
                    self.shown = (wanted or list(run.outcomes))[0]
                self.cost_revision += 1
        self._judge_steps()

    @observe("shown", "taken", "runs")
    def _something_changed(self, _: Any) -> None:
        self._judge_steps()

    def _judge_steps(self) -> None:
        """Say how every step stands, and why."""
        self.states = step_states(self)


def _measured(case: InputCase, options: Options) -> tuple[Any, ...]:
    """What the anatomy of a case depends on."""
    return (case, *(getattr(options, name) for name in ANALYZED))
