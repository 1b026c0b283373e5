"""Words of a message that depend on where it is shown: Python, the command line, or the page."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Literal

Place = Literal["Python", "command line", "page"]

_place: ContextVar[Place] = ContextVar("place", default="Python")


@contextmanager
def worded_for(place: Place) -> Iterator[None]:
    """Have messages that are made inside say what to do in the words of a place.

    Parameters
    ----------
    place : {"Python", "command line", "page"}
        Where they will be shown.

    Examples
    --------
    >>> with worded_for("command line"):
    ...     wording("label=...", "--label", "the label")
    '--label'
    """
    before = _place.set(place)
    try:
        yield
    finally:
        _place.reset(before)


def wording(python: str, command_line: str, page: str) -> str:
    """The words for where a message will be shown.

    Parameters
    ----------
    python, command_line, page : str
        What it says there.
    """
    return {"Python": python, "command line": command_line, "page": page}[_place.get()]
