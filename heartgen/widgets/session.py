"""The state of one visitor's page: input, choices, runs, what is looked at, and every step's state.

Nothing here knows a widget. Long work is done in threads; what it changes is posted to where the
state lives.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any

from traitlets import Bunch, observe

from heartgen.errors import HeartgenError, sentence
from heartgen.widgets.costs import Costs
from heartgen.widgets.input_case import load_origin
from heartgen.widgets.memory import release_memory
from heartgen.widgets.runs import (
    ALL_LEVELS,
    Make,
    Outcome,
    Post,
    Run,
    Waiting,
    fit_here,
    with_lod,
)
from heartgen.widgets.session_input import SessionInput

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.options import Options
    from heartgen.widgets.input_case import InputCase
    from heartgen.widgets.keeping.session import Keeping

MAX_UPLOAD = 400 * 1024 * 1024
"""Largest upload, bytes: compressed label maps of the 1024^3 voxels that are read are smaller."""


class Session(SessionInput):
    """One visitor's work, and the state that it leads to.

    Attributes
    ----------
    post : callable, optional
        Has a change made where the state lives; at once if omitted.
    keeping : Keeping, optional
        Writes down what is done, so that it is found again; nothing is if omitted.
    **traits : object
        First values of the state's attributes.
    """

    def __init__(
        self, post: Post | None = None, keeping: Keeping | None = None, **traits: Any
    ) -> None:
        self.costs = Costs()
        self._runs_begun = 0
        self._fits = ThreadPoolExecutor(1, thread_name_prefix="heartgen-fits")
        super().__init__(post, keeping, **traits)
        if keeping is not None:
            keeping.watch(self)

    def close(self) -> None:
        """End all work, and remove what was uploaded unless it is kept for later."""
        if self.keeping is None or not self.keeping.store.lasting:
            for run in self.runs:
                run.cancel()
        self._fits.shutdown(wait=False, cancel_futures=True)
        super().close()

    def start(
        self, levels: tuple[int, ...] | None = None, make: Make | None = None
    ) -> Future[None]:
        """Start a run with the choices of the moment, at one level or at several.

        Parameters
        ----------
        levels : tuple of int, optional
            Levels of detail; the chosen one if omitted.
        make : callable, optional
            Makes the results, as of `Run`; they are fitted on this machine if omitted.

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
        return self._begin(self.case, options, levels or (options.lod,), make)

    def start_all(
        self, origins: Iterable[Mapping[str, str]], options: Options | None = None
    ) -> Future[None]:
        """Start a run for each of several files.

        Parameters
        ----------
        origins : iterable of dict of str to str
            Files and folders, as of `InputCase`.
        options : Options, optional
            Of the runs; the choices of the moment if omitted.
        """
        options = options or self.choices.options()
        waiting = [Waiting(dict(origin), options) for origin in origins]
        self.queue = [*self.queue, *waiting]

        def read() -> None:
            for each in waiting:
                origin = each.origin
                if each not in self.queue:
                    continue
                if self.keeping is not None and not self.keeping.store.mine:
                    return  # whoever has the session now reads the rest
                try:
                    shown = self.case
                    same = shown is not None and dict(shown.origin) == origin
                    case = shown if same else load_origin(origin)
                    if self.keeping is not None:
                        self.keeping.keep_case(case)
                except Exception as error:
                    self.post(partial(self._refuse_one, each, sentence(error)))
                else:
                    self.post(partial(self._begin_one, each, case))

        return self.submit(read)

    def _refuse_one(self, heart: Waiting, said: str) -> None:
        if heart in self.queue:
            self.refused = [*self.refused, said]
            self._read_one(heart)

    def _begin_one(self, heart: Waiting, case: InputCase) -> None:
        if heart not in self.queue:  # another session was opened
            return
        self._begin(case, heart.options, (heart.options.lod,), None)
        self._read_one(heart)

    def _read_one(self, heart: Waiting) -> None:
        """A heart of several does not wait any more."""
        self.queue = [other for other in self.queue if other is not heart]

    def _begin(
        self, case: InputCase, options: Options, levels: tuple[int, ...], make: Make | None
    ) -> Future[None]:
        """Put a run into the list, and have it done."""
        run = Run(case, options, self._maker(make), number=self.next_number(), levels=levels)
        analyzed = self.anatomy_for(run.case, options) is not None
        there = tuple(n for n in levels if make is None and self._has_kept(n, options, case))
        run.reused = (*("shape analysis" for _ in (1,) if analyzed), *(f"level {n}" for n in there))
        left = tuple(n for n in levels if n not in there)
        run.expected = self.costs.expect(options, self.both, left, analyzed) if left else {}
        self.runs = [*self.runs, run]
        return self.go_on(run)

    def _maker(self, make: Make | None) -> Make:
        """What makes the results of a run, and writes them down where the session is kept."""
        if self.keeping is None:
            return make or fit_here
        return self.keeping.fit if make is None else self.keeping.kept(make)

    def next_number(self) -> int:
        """Number of the next run: none is given twice."""
        self._runs_begun = max([self._runs_begun, *(run.number for run in self.runs)]) + 1
        return self._runs_begun

    def _has_kept(self, lod: int, options: Options, case: InputCase) -> bool:
        """Whether a mesh need not be fitted again, as it was written down."""
        return self.keeping is not None and self.fitted(lod, options, case) is not None

    def go_on(self, run: Run) -> Future[None]:
        """Have a run done that is in the list.

        Parameters
        ----------
        run : Run
            That waits.
        """
        run.observe(self._run_changed, names=["phase"])
        return self._fits.submit(self._work_on_run, run)

    def _work_on_run(self, run: Run) -> None:
        """In the thread: run."""
        anatomy = self.anatomy_for(run.case, run.options)
        run.work(anatomy if run.anatomy is None else run.anatomy, self.post)
        release_memory()

    def sweep(self) -> Future[None]:
        """Fit all levels of detail."""
        return self.start(ALL_LEVELS)

    def show(self, outcome: Outcome) -> None:
        """Look at a mesh; the input becomes the one it was made of.

        Parameters
        ----------
        outcome : Outcome
            The mesh.
        """
        if outcome.case is not self.case or self.awaited:
            self._take(outcome.case, outcome.result.anatomy, outcome.result.options)
        self.shown = outcome
        self._judge_steps()

    def resume(
        self,
        case: InputCase | None,
        anatomy: Anatomy | None,
        runs: Iterable[Run],
        shown: Outcome | None,
    ) -> None:
        """Go on with a session that was left: what was running runs on.

        Parameters
        ----------
        case : InputCase or None
            The input.
        anatomy : Anatomy or None
            What was measured in it, under the choices of the moment.
        runs : iterable of Run
            The newest last.
        shown : Outcome or None
            What was looked at.
        """
        self._take(case, anatomy)
        with self.hold_trait_notifications():
            self.runs = list(runs)
            self.outcomes = [outcome for run in self.runs for outcome in run.outcomes]
            self.shown = shown
        for run in self.runs:
            if run.active:
                self.go_on(run)
        self._measure_anew()
        self._judge_steps()

    def add(self, run: Run, outcomes: Iterable[Outcome]) -> None:
        """Have further meshes of a run, such as those of other levels of detail.

        Parameters
        ----------
        run : Run
            That is done.
        outcomes : iterable of Outcome
            The meshes.
        """
        new = tuple(outcomes)
        run.outcomes = (*run.outcomes, *new)
        self.outcomes = [*self.outcomes, *new]

    def rename(self, run: Run, name: str) -> None:
        """Give a run a name of the visitor's.

        Parameters
        ----------
        run : Run
            In the list.
        name : str
            Empty for its usual name.
        """
        run.name = " ".join(name.split())
        for listed in ("runs", "outcomes"):  # the same, with another name: who lists them is told
            here = getattr(self, listed)
            told = {"name": listed, "old": here, "new": here, "owner": self, "type": "change"}
            self.notify_change(Bunch(told))

    def delete(self, run: Run) -> None:
        """Remove a run and its meshes.

        Parameters
        ----------
        run : Run
            In the list.
        """
        run.cancel()
        with self.hold_trait_notifications():
            self.runs = [other for other in self.runs if other is not run]
            self.outcomes = [o for o in self.outcomes if o not in run.outcomes]
            if self.shown in run.outcomes:
                self.shown = next((o for o in reversed(self.outcomes) if o.case is self.case), None)
        if self.keeping is not None:
            self.keeping.forget(run)

    def fitted(
        self, lod: int, options: Options | None = None, case: InputCase | None = None
    ) -> Outcome | None:
        """The newest mesh of an input at a level of detail, with all other choices as they are.

        Parameters
        ----------
        lod : int
            Level of detail.
        options : Options, optional
            All but the level of detail; the choices of the moment if omitted.
        case : InputCase, optional
            The input; that of the moment if omitted.
        """
        wanted = with_lod(options or self.choices.options(), lod)
        of = case or self.case
        for run in reversed(self.runs):
            if run.case is of and with_lod(run.options, lod) == wanted:
                found: list[Outcome] = [o for o in run.outcomes if o.lod == lod]
                if found:
                    return found[0]
        return None

    def expected_seconds(self, levels: tuple[int, ...] | None = None) -> float:
        """Seconds a run with the choices of the moment is expected to take.

        Parameters
        ----------
        levels : tuple of int, optional
            Levels of detail; the chosen one if omitted.
        """
        options = self.choices.options()
        analyzed = self.case is not None and self.anatomy_for(self.case, options) is not None
        expected = self.costs.expect(options, self.both, levels or (options.lod,), analyzed)
        return sum(expected.values())

    def _run_changed(self, change: Any) -> None:
        """Take in what a run made."""
        run: Run = change["owner"]
        if run.phase == "done":
            if run.expected and run.make in self._makers_here():
                self.costs.learn(run.expected, run.seconds)
            with self.hold_trait_notifications():
                self.outcomes = [*self.outcomes, *run.outcomes]
                if run.case is self.case:  # another heart may have come in the meantime
                    wanted = [o for o in run.outcomes if o.lod == self.choices.lod]
                    self.shown = (wanted or list(run.outcomes))[0]
                self.cost_revision += 1
        self._judge_steps()

    def _makers_here(self) -> tuple[Make, ...]:
        """What fits on this machine, so that its times say how fast it is."""
        return (fit_here,) if self.keeping is None else (fit_here, self.keeping.fit)

    @observe("shown", "taken", "runs")
    def _something_changed(self, _: Any) -> None:
        self._judge_steps()
