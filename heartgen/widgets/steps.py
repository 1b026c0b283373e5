"""The steps of the page, and the state each is in: every state says why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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
