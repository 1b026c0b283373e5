"""Exercises of the course: an answer is checked in the cell where it is given."""

from __future__ import annotations

import html
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from heartgen.errors import InputError


@dataclass(frozen=True)
class Verdict:
    """What is said of an answer.

    Attributes
    ----------
    right : bool or None
        None if no answer was given.
    words : str
        One sentence.
    """

    right: bool | None
    words: str

    def __bool__(self) -> bool:
        return bool(self.right)

    def __repr__(self) -> str:
        return self.words

    def _repr_html_(self) -> str:
        color = {None: "#777", True: "#0a7d55", False: "#b04a00"}[self.right]
        return (
            f'<div style="border-left: 4px solid {color}; padding: 2px 10px">'
            f"{html.escape(self.words)}</div>"
        )


@dataclass(frozen=True)
class Exercise:
    """A question with an answer that can be checked: call it with yours.

    Attributes
    ----------
    check : callable
        Whether an answer is right.
    solution : object
        One that is: it is checked when the exercise is made.
    hint : str
        What is said to an answer that is not right.

    Examples
    --------
    >>> from heartgen.widgets import Exercise
    >>> nodes = Exercise(lambda n: n == 13, solution=13, hint="count both ends")
    >>> nodes(...)
    Not answered yet: put your answer in the place of the three dots.
    >>> nodes(12)
    Not yet: count both ends.
    >>> nodes(13)
    Right.
    """

    check: Callable[[Any], bool]
    solution: Any
    hint: str

    def __post_init__(self) -> None:
        if not self.check(self.solution):
            raise InputError(f"the solution {self.solution!r} is not one: mend it, or the check")

    def __call__(self, answer: Any) -> Verdict:
        """Check an answer.

        Parameters
        ----------
        answer : object
            Yours; the three dots of Python, ``...``, for none.

        Returns
        -------
        Verdict
        """
        if answer is ...:
            words = "Not answered yet: put your answer in the place of the three dots."
            return Verdict(None, words)
        try:
            right = bool(self.check(answer))
        except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError):
            right = False
        return Verdict(right, "Right." if right else f"Not yet: {self.hint}.")
