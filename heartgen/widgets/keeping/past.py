"""What a session was when it was left, read from its folder."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.errors import HeartgenError, InputError
from heartgen.options import ANALYZED, OPTIONS
from heartgen.widgets.input_case import InputCase, paths_of, with_paths
from heartgen.widgets.keeping.jobs import Input, Job, options_of
from heartgen.widgets.keeping.store import Store
from heartgen.widgets.runs import ALL_LEVELS, Make, Outcome, Run, Waiting

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.images import Mask
    from heartgen.options import Options
    from heartgen.widgets.session import Session

OTHERS = "others"
"""Part of a run's work: the levels of detail that were fitted after it."""

LEFT = "the page was left before the service had answered: send it again"


@dataclass(frozen=True, eq=False)
class Past:
    """What a session was when it was left.

    Attributes
    ----------
    choices : dict
        By name of the option.
    case : InputCase or None
        The input.
    anatomy : Anatomy or None
        Measured in it under the choices.
    runs : tuple of Run
        The newest last.
    shown : Outcome or None
        What was looked at.
    origin : dict of str to str
        Of the input that was being read, if there was one.
    hearts : tuple of dict of str to str
        Origins of hearts that were uploaded at once.
    queue : tuple of Waiting
        Hearts that waited to be read and fitted.
    taken : str
        What was downloaded last.
    numbers : dict of InputCase to int
        Of all inputs.
    """

    choices: dict[str, Any]
    case: InputCase | None
    anatomy: Anatomy | None
    runs: tuple[Run, ...]
    shown: Outcome | None
    origin: dict[str, str]
    hearts: tuple[dict[str, str], ...]
    queue: tuple[Waiting, ...]
    taken: str
    numbers: dict[InputCase, int]

    def restore(self, session: Session) -> None:
        """Have a session be as it was.

        Parameters
        ----------
        session : Session
            Whatever was done in it before is no longer seen.
        """
        assert session.keeping is not None
        with session.keeping.silent():
            for name, value in self.choices.items():
                if session.choices.has_trait(name):
                    setattr(session.choices, name, value)
            session.resume(self.case, self.anatomy, self.runs, self.shown)
            session.taken = self.taken
            session.hearts = list(self.hearts)
            if self.origin:
                session.load_origin(self.origin)
            for waiting in self.queue:
                session.start_all([waiting.origin], waiting.options)


class PastReader:
    """Reads a session from its folder.

    Parameters
    ----------
    store : Store
        The folder.
    fit : callable
        Goes on with runs that were not done.
    """

    def __init__(self, store: Store, fit: Make) -> None:
        self._store, self._fit = store, fit
        self._inputs: dict[Path, Input] = {}

    def read(self) -> Past:
        """All of it."""
        told = self._store.read()
        if told is None:
            return Past({}, None, None, (), None, {}, (), (), "", {})
        numbers = {told["case"], *(run["case"] for run in told["runs"])} - {None}
        if not all(isinstance(number, int) for number in numbers):
            raise InputError("This session is damaged: its inputs have no numbers.")
        cases = {number: self._case(number) for number in sorted(numbers)}
        choices = {name: _as_chosen(value) for name, value in told["choices"].items()}
        runs = tuple(self._run(each, cases[each["case"]]) for each in told["runs"])
        case, anatomy = cases.get(told["case"]), None
        if case is not None and (name := _name_of(choices)):
            anatomy = self.input(told["case"], name, case.mask)[1]
        outcomes = [outcome for run in runs for outcome in run.outcomes]
        shown = [each for each in outcomes if told["shown"] == [each.run, each.lod]]
        return Past(
            choices,
            case,
            anatomy,
            runs,
            (shown or [None])[0],
            self._origin(told["origin"]) if told["awaited"] else {},
            tuple(filter(None, map(self._origin, told.get("hearts", ())))),
            tuple(
                Waiting(origin, options_of(each["options"]))
                for each in told.get("queue", ())
                if (origin := self._origin(each["origin"]))
            ),
            told["taken"],
            {case: number for number, case in cases.items()},
        )

    def input(self, number: int, name: str, mask: Mask) -> Input:
        """What results of an input are made of; it is read once, as long as it is the same input.

        Parameters
        ----------
        number : int
            Of the input.
        name : str
            Of what was measured in it.
        mask : Mask
            Of the input.
        """
        path = self._store.anatomy_file(number, name)
        if path not in self._inputs or self._inputs[path][0] is not mask:
            self._inputs[path] = (mask, self._store.load_anatomy(number, name, mask))
        return self._inputs[path]

    def _case(self, number: int) -> InputCase:
        """An input."""
        mask, views, about = self._store.load_case(number)
        return InputCase(mask, **{**about, "origin": self._origin(about["origin"]), "views": views})

    def _origin(self, told: Mapping[str, str]) -> dict[str, str]:
        """Where an input comes from; nowhere if its file is not there any more."""
        origin = with_paths(told, lambda line: str(self._store.folder / line))
        uploads = self._store.uploads.resolve()  # a session that was sent may name any path
        for path in map(Path, paths_of(origin)):
            if not (path.exists() and path.resolve().is_relative_to(uploads)):
                return {}
        return origin

    def _run(self, told: dict[str, Any], case: InputCase) -> Run:
        """A run with its meshes; one that went on waits to go on."""
        options, levels = options_of(told["options"]), tuple(told["levels"])
        run = Run(case, options, self._fit, number=told["number"], levels=levels)
        run.name, run.seconds, run.error = told["name"], told["seconds"], told["error"]
        run.reused = tuple(told["reused"])
        own, others = job_of(self._store, run), job_of(self._store, run, OTHERS)
        known = self._known(own, told["case"], case)
        run.anatomy = known[1]
        run.phase, run.error = _phase(told, own)
        if run.phase != "done":
            return run
        beside = self._known(others, told["case"], case)
        try:
            results = [
                *(own.result(level, known) for level in own.kept(levels)),
                *(others.result(level, beside) for level in others.kept(ALL_LEVELS)),
            ]
            if not results:
                raise InputError("its meshes are not there any more: run it again")
        except HeartgenError as error:  # the rest of the session is of use without it
            run.phase, run.error = "failed", str(error)
        else:
            run.outcomes = tuple(Outcome(run.number, case, result, run) for result in results)
            run.shares = dict.fromkeys(run.shares, 1.0)
        return run

    def _known(self, job: Job, number: int, case: InputCase) -> Input:
        """What the results of a job are made of."""
        if not job.there or job.told["anatomy"] is None:
            return case.mask, None
        return self.input(number, measured_name(job.options), case.mask)


def job_of(store: Store, run: Run, part: str = "") -> Job:
    """The job of a run.

    Parameters
    ----------
    store : Store
        Of the session.
    run : Run
        The run.
    part : str
        Of the run's work.
    """
    return store.job(f"{run.number}-{part}" if part else str(run.number))


def measured_name(options: Options) -> str:
    """Name of what is measured under options, the same for the same.

    Parameters
    ----------
    options : Options
        Of the shape analysis.
    """
    told = json.dumps([getattr(options, name) for name in ANALYZED])
    return hashlib.sha256(told.encode()).hexdigest()[:16]


def _phase(told: Mapping[str, Any], job: Job) -> tuple[str, str]:
    """Phase of a run that was left, and why it failed."""
    if told["phase"] not in ("waiting", "running"):
        return told["phase"], told["error"]
    if told["here"] or job.ended == "":
        return "waiting", ""
    return "failed", LEFT


def _name_of(choices: Mapping[str, Any]) -> str:
    """Name of what is measured under choices; empty if they contradict each other."""
    try:
        return measured_name(options_of({k: v for k, v in choices.items() if k in OPTIONS}))
    except HeartgenError:
        return ""


def _as_chosen(value: Any) -> Any:
    """A choice as it was before JSON made lists of tuples."""
    return tuple(value) if isinstance(value, list) else value
