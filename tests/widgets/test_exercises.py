"""Exercises check answers, and their own solutions."""

from __future__ import annotations

import pytest

from heartgen.errors import InputError
from heartgen.widgets.exercises import Exercise


def test_answers_are_judged() -> None:
    half = Exercise(lambda x: abs(x - 0.5) < 1e-3, solution=0.5, hint="one of two")
    assert half(...).right is None
    assert half(0.5)
    assert not half(0.7)
    assert "one of two" in repr(half(0.7))
    assert "Right." in half(0.5)._repr_html_()


@pytest.mark.parametrize("answer", ["0.5", None, [1, 2]])
def test_an_answer_of_another_kind_is_not_right(answer: object) -> None:
    half = Exercise(lambda x: x / 2 == 0.25, solution=0.5, hint="a number")
    assert half(answer).right is False


def test_a_solution_that_is_none_is_refused() -> None:
    with pytest.raises(InputError, match="is not one"):
        Exercise(lambda x: x > 1, solution=0, hint="more")
