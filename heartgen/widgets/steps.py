"""The steps of the page, and the state each is in: every state says why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from heartgen.errors import HeartgenError

if TYPE_CHECKING:
    from heartgen.widgets.session_input import SessionInput as Session

Phase = Literal["blocked", "ready", "running", "done", "failed"]


@dataclass(frozen=True)
class Step:
    """A step of the page.

    Attributes
    ----------
    key : str
        Its name in the program.
    number : int
        From 1.
    title : str
        Its name for users.
    """

    key: str
    number: int
    title: str


STEPS = tuple(
    Step(key, number, title)
    for number, (key, title) in enumerate(
        (
            ("input", "Input"),
            ("choices", "Choices"),
            ("run", "Run"),
            ("view", "View"),
            ("assess", "Assess"),
            ("export", "Export"),
        ),
        start=1,
    )
)


@dataclass(frozen=True)
class StepState:
    """How a step stands.

    Attributes
    ----------
    phase : {"blocked", "ready", "running", "done", "failed"}
        How far it is.
    reason : str
        Why, in a clause for the user.
    """

    phase: Phase
    reason: str


def step_states(session: Session) -> dict[str, StepState]:
    """How every step stands, and why.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """
    return {
        "input": _input_state(session),
        "choices": _choices_state(session),
        "run": _run_state(session),
        "view": _view_state(session),
        "assess": _assess_state(session),
        "export": _export_state(session),
    }


def _input_state(session: Session) -> StepState:
    if session.reading:
        return StepState("running", session.reading)
    if session.complaint:
        return StepState("failed", session.complaint)
    if session.case is None:
        return StepState("ready", "choose a sample or upload a mask")
    return StepState("done", f"{session.case.name} is loaded")


def _choices_state(session: Session) -> StepState:
    if session.awaited or session.case is None:
        return StepState("blocked", _why_no_input(session))
    try:
        session.choices.options()
    except HeartgenError as error:
        return StepState("failed", str(error))
    return StepState("done", "ready to run")


def _run_state(session: Session) -> StepState:
    last = session.runs[-1] if session.runs else None
    if session.active_run is not None:
        return StepState("running", f"run {session.active_run.title} goes on")
    if session.awaited or session.case is None:
        return StepState("blocked", _why_no_input(session))
    if session.complaint:
        return StepState("blocked", f"the heart in {session.case.name} cannot be measured")
    if _choices_state(session).phase == "failed":
        return StepState("blocked", "the choices contradict each other")
    if last is not None and last.phase == "failed" and last.case is session.case:
        return StepState("failed", last.error)
    if last is not None and last.phase == "done" and last.case is session.case:
        return StepState("done", f"run {last.title} is done")
    return StepState("ready", "press Run")


def _why_no_input(session: Session) -> str:
    """Why there is no input to work with."""
    if session.awaited:
        return "the input is being read" if session.reading else "the input was refused"
    return "there is no mask yet"


def _view_state(session: Session) -> StepState:
    if session.shown is not None:
        return StepState("done", f"shows {session.shown.title}")
    if session.anatomy is not None:
        return StepState("ready", "shows the mask; run to see the mesh")
    return StepState("blocked", "there is no mask yet")


def _assess_state(session: Session) -> StepState:
    if session.shown is None:
        return StepState("blocked", "there is no mesh yet")
    from heartgen.viewing.card import verdict

    judged = verdict(session.shown.result.report)
    return StepState("failed" if judged.level == "bad" else "done", judged.text)


def _export_state(session: Session) -> StepState:
    if session.shown is None:
        return StepState("blocked", "there is no mesh yet")
    if not session.shown.result.report.quality.valid:
        return StepState("blocked", "the mesh is not valid, so it is not handed out")
    if session.taken:
        return StepState("done", f"{session.taken} was downloaded")
    return StepState("ready", "choose formats and download")
