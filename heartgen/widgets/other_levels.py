"""After a run, its other levels of detail, fitted when the machine has nothing else to do."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from heartgen.errors import Cancelled, HeartgenError
from heartgen.widgets.runs import ALL_LEVELS, Outcome, Run, with_lod

if TYPE_CHECKING:
    from heartgen.result import Personalization
    from heartgen.widgets.session import Session


class OtherLevels:
    """Fits the levels that the run in sight has not got, and shows one as soon as it is chosen.

    Parameters
    ----------
    session : Session
        The visitor's work, which is kept.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen-others")
        self._at: Run | None = None
        self._given_up: set[int] = set()
        session.observe(self.consider, ["shown", "runs", "states", "ahead"])
        session.choices.observe(self._chosen, ["lod"])

    def close(self) -> None:
        """Fit no more."""
        self._leave()
        self._pool.shutdown(wait=False, cancel_futures=True)

    def consider(self, _: Any = None) -> None:
        """Begin with what is missing, and leave what is no longer of use."""
        run = self._wanted()
        if run is self._at:
            return
        self._leave()
        if run is not None:
            self._at = run
            levels = sorted(_missing(self._session, run), key=lambda n: (abs(n - run.levels[0]), n))
            self._pool.submit(self._work, run, tuple(levels))
            self._tell()

    def _wanted(self) -> Run | None:
        """The run whose levels are wanted: the one that is looked at, while no other goes on."""
        session = self._session
        shown = session.shown
        run: Run | None = None if shown is None else shown.source
        keeping = session.keeping
        if not session.ahead or run is None or keeping is None or run.make != keeping.fit:
            return None
        if session.active_run is not None or run.phase != "done" or run.number in self._given_up:
            return None
        if run is self._at or (run in session.runs and _missing(session, run)):
            return run
        return None

    def _work(self, run: Run, levels: tuple[int, ...]) -> None:
        """In the thread: wait for them."""
        session, keeping = self._session, self._session.keeping
        assert keeping is not None
        if self._at is not run:
            return

        def told(step: str, done: float) -> None:
            if self._at is not run or keeping.store.left:
                raise Cancelled("no longer of use")

        def arrived(result: Personalization) -> None:
            session.post(lambda: self._take(run, result))

        try:
            keeping.fit_others(run, levels, told, arrived)
        except Cancelled:
            pass
        except Exception:  # the run itself is there: its levels can be asked for, and say why not
            self._given_up.add(run.number)
        session.post(lambda: self._end(run))

    def _take(self, run: Run, result: Personalization) -> None:
        """A level is there."""
        session = self._session
        if run not in session.runs or result.options.lod in (o.lod for o in run.outcomes):
            return
        outcome = Outcome(run.number, run.case, result, run)
        session.add(run, [outcome])
        self._tell()
        if session.choices.lod == outcome.lod and session.shown in run.outcomes:
            self._chosen()  # it was waited for

    def _chosen(self, _: Any = None) -> None:
        """Show the level that was chosen, if it is there."""
        session = self._session
        shown = session.shown
        if shown is None or shown.case is not session.case:
            return
        if session.awaited or session.active_run is not None:
            return
        try:
            outcome = session.fitted(session.choices.lod)
        except HeartgenError:  # the choices contradict each other
            return
        if outcome is not None and outcome is not shown:
            session.show(outcome)

    def _leave(self) -> None:
        self._at = None
        self._session.ahead_of = ""

    def _end(self, run: Run) -> None:
        if self._at is run:
            self._leave()

    def _tell(self) -> None:
        """Say what is being fitted."""
        if self._at is not None:
            levels = ", ".join(map(str, sorted(_missing(self._session, self._at))))
            self._session.ahead_of = levels


def _missing(session: Session, run: Run) -> set[int]:
    """Levels of a run that are not there."""
    if len(run.levels) > 1:
        return set()
    there = {o.lod for other in session.runs for o in other.outcomes if _alike(other, run)}
    return set(ALL_LEVELS) - there


def _alike(one: Run, other: Run) -> bool:
    """Whether two runs differ in their levels alone."""
    return one.case is other.case and with_lod(one.options, 1) == with_lod(other.options, 1)
