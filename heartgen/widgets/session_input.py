"""How a session comes to its input: it is read and measured in a thread, refused, or kept."""

from __future__ import annotations

import shutil
import tempfile
import threading
import traceback
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.errors import HeartgenError, sentence
from heartgen.options import ANALYZED
from heartgen.widgets.input_case import (
    BINARY,
    InputCase,
    LabelMapError,
    analyze_case,
    load_origin,
    load_sample,
)
from heartgen.widgets.run_options import RunOptions
from heartgen.widgets.runs import Post, Run
from heartgen.widgets.session_state import SessionState
from heartgen.widgets.steps import step_states

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.options import Options
    from heartgen.widgets.keeping.session import Keeping


class SessionInput(SessionState):
    """The input of one visitor's work, and what is measured in it.

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
        super().__init__(choices=RunOptions(), **traits)
        self._post: Post = post or (lambda change: change())
        self.keeping = keeping
        self._folder = None if keeping else Path(tempfile.mkdtemp(prefix="heartgen-"))
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen")
        self._ask = 0
        self._lock = threading.Lock()
        self._measured: tuple[Any, ...] = ()
        self.choices.observe(self._chosen)
        self._judge_steps()

    @property
    def folder(self) -> Path:
        """Where what is uploaded is written."""
        if self.keeping is not None:
            return self.keeping.store.uploads
        assert self._folder is not None
        return self._folder

    def post(self, change: Callable[[], object]) -> None:
        """Have the state changed where it lives; what goes wrong there is told, not lost.

        Parameters
        ----------
        change : callable
            Makes the change.
        """
        self._post(lambda: self._guarded(change))

    def close(self) -> None:
        """End all work, and remove what was uploaded unless it is kept for later."""
        self._pool.shutdown(wait=False, cancel_futures=True)
        if self.keeping is not None:
            self.keeping.close()
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)

    def submit(self, work: Callable[[], None]) -> Future[None]:
        """Have something done in the thread that reads and measures.

        Parameters
        ----------
        work : callable
            Posts what it changes.
        """
        return self._pool.submit(work)

    def load_sample(self, name: str) -> Future[None]:
        """Take a sample for the input.

        Parameters
        ----------
        name : str
            In the catalog of `heartgen.samples`.
        """
        origin = {"sample": name}
        return self._load(f"making the sample {name}", lambda: load_sample(name), origin)

    def load_origin(self, origin: Mapping[str, str]) -> Future[None]:
        """Take for the input what one came from.

        Parameters
        ----------
        origin : dict of str to str
            As of `InputCase`.
        """
        if "sample" in origin:
            return self.load_sample(origin["sample"])
        doing = f"reading {Path(origin['file']).name}"
        return self._load(doing, lambda: load_origin(origin), origin)

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
        return self.load_origin({"file": str(path), "scheme": scheme, "frame": frame})

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
            self.origin = {} if self.case is None else dict(self.case.origin)
        self._measure_anew()
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
        active = [run for run in self.runs if run.active]
        return next((run for run in active if run.phase == "running"), next(iter(active), None))

    def anatomy_for(self, case: InputCase, options: Options) -> Anatomy | None:
        """The anatomy of a case, if it was measured under these options.

        Parameters
        ----------
        case : InputCase
            The input.
        options : Options
            Of a run.
        """
        return self.anatomy if self._measured == measured(case, options) else None

    def _take(
        self, case: InputCase | None, anatomy: Anatomy | None, options: Options | None = None
    ) -> None:
        """Have a case that was read before, with what was measured in it under options."""
        self._new_ask()
        with self.hold_trait_notifications():
            self.case, self.anatomy = case, anatomy
            self._measured = ()
            if case is not None and anatomy is not None:
                self._measured = measured(case, options or self.choices.options())
            self.awaited, self.reading, self.complaint, self.offer = False, "", "", ""
            self.origin = {} if case is None else dict(case.origin)

    def _load(
        self, doing: str, make: Callable[[], InputCase], origin: Mapping[str, str]
    ) -> Future[None]:
        """Make a case and measure the heart in it, in the thread."""
        with self.hold_trait_notifications():
            self.awaited, self.reading, self.complaint, self.offer = True, doing, "", ""
            self.origin = dict(origin)
        self._judge_steps()
        return self._pool.submit(self._work_on_input, self._new_ask(), make)

    def _work_on_input(self, ask: int, make: Callable[[], InputCase]) -> None:
        """In the thread: read, show, measure."""

        def kept() -> InputCase:
            made = make()
            if self.keeping is not None:
                self.keeping.keep_case(made)
            return made

        case = self._told(ask, kept)
        if case is not None:
            self.post(lambda: self._take_case(ask, case))
            self._measure(ask, case, self.choices.options())

    def _measure(self, ask: int, case: InputCase, options: Options) -> None:
        """In the thread: measure the heart."""
        anatomy = self._told(ask, lambda: analyze_case(case, options))
        if anatomy is not None:
            self.post(lambda: self._take_anatomy(ask, case, options, anatomy))
            if self.keeping is not None:
                with suppress(HeartgenError):  # measured again by whoever comes back
                    self.keeping.keep_anatomy(case, options, anatomy)

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
        self._measured = measured(case, options)
        with self.hold_trait_notifications():
            self.anatomy = anatomy
            self.reading, self.complaint = "", ""
            self.cost_revision += 1
        self._judge_steps()

    def _guarded(self, change: Callable[[], object]) -> None:
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
        if self.anatomy_for(self.case, options) is not None:
            self.reading, self.complaint = "", ""
        else:
            self.reading = f"measuring the heart in {self.case.name}"
            self._pool.submit(self._measure, ask, self.case, options)

    def _judge_steps(self) -> None:
        """Say how every step stands, and why."""
        self.states = step_states(self)


def measured(case: InputCase, options: Options) -> tuple[Any, ...]:
    """What the anatomy of a case depends on.

    Parameters
    ----------
    case : InputCase
        The input.
    options : Options
        Of the shape analysis.
    """
    return (case, *(getattr(options, name) for name in ANALYZED))
