"""Of which kind the value of each option has to be."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from numbers import Integral, Real
from typing import Any, TypeAlias

Kind: TypeAlias = tuple[Callable[[Any], bool], str]
"""Whether a value is of the kind, and the kind in words."""


def kind_of(name: str) -> Kind:
    """Whether a value is of the kind of an option, and that kind in words.

    Parameters
    ----------
    name : str
        Of the option.
    """
    return KINDS.get(name, (lambda value: isinstance(value, str), "a word"))


def _is_switch(value: Any) -> bool:
    return type(value).__name__ in ("bool", "bool_")  # Python's and NumPy's


def _is_whole(value: Any) -> bool:
    return isinstance(value, Integral) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, Real) and not isinstance(value, bool)


def _are_numbers(value: Any) -> bool:
    return isinstance(value, tuple | list) and all(map(_is_number, value))


KINDS: Mapping[str, Kind] = {
    **dict.fromkeys(("optimize", "enhance", "transmural_grading"), (_is_switch, "True or False")),
    **dict.fromkeys(("quality", "min_jacobian_ratio"), (_is_number, "a number")),
    "lod": (_is_whole, "a whole number"),
    "elements": (lambda v: v is None or _are_numbers(v), "three whole numbers, or None"),
    "truncate": (lambda v: isinstance(v, str) or _is_number(v), "a number, 'auto' or 'off'"),
    "septal_direction": (lambda v: v is None or _are_numbers(v), "three numbers, or None"),
    "hole_radius": (lambda v: v is None or _is_number(v), "a number, or None"),
}
"""Kinds of the options that are no words."""
