"""Types of the options' values: what is taken for one, of any library, and what is not."""

from __future__ import annotations

from numbers import Real
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, BeforeValidator, Field

Apex = Literal["collapsed", "hole", "patch"]
"""Kinds of apex: elements that collapse in a pole, a hole, or a square patch of elements."""

Insertion = Literal["rounded", "squared"]
"""Courses of the insertion line around the apex of the right ventricle."""

QUALITY_LIMITS = (0.01, 100.0)
"""Range of the quality dial."""

OUT_OF_BALANCE = f"is not a number from {QUALITY_LIMITS[0]:g} to {QUALITY_LIMITS[1]:g}"

MOST_ELEMENTS = 9999
"""In each direction; far more than any computer would hold."""

TOO_MANY = f"are not three positive numbers up to {MOST_ELEMENTS}"


def _switch(value: Any) -> bool:
    if type(value).__name__ not in ("bool", "bool_"):  # Python's and NumPy's
        raise ValueError
    return bool(value)


def _number(value: Any) -> float:
    if not isinstance(value, Real) or isinstance(value, bool):
        raise ValueError
    try:
        return float(value)
    except OverflowError:
        raise ValueError from None


def _whole(value: Any) -> int:
    number = _number(value)
    if not number.is_integer():
        raise ValueError
    return int(number)


def _row(value: Any) -> Any:
    if value is not None and not isinstance(value, tuple | list):
        raise ValueError
    return value


def _points_somewhere(direction: tuple[float, float, float]) -> tuple[float, float, float]:
    if not any(direction):
        raise ValueError
    return direction


SWITCH = BeforeValidator(_switch)
"""True or False, and no number or word for it."""

NUMBER = BeforeValidator(_number)
"""A number of any library, and no text."""

WHOLE = BeforeValidator(_whole)
"""A whole number of any library, and no text."""

ROW = BeforeValidator(_row)
"""Values in an order: no set."""

Count = Annotated[int, Field(ge=1, le=MOST_ELEMENTS), WHOLE]
"""A number of elements."""

Coordinate = Annotated[float, Field(allow_inf_nan=False), NUMBER]
Direction = Annotated[tuple[Coordinate, Coordinate, Coordinate], AfterValidator(_points_somewhere)]
"""Three numbers that are not all 0."""
