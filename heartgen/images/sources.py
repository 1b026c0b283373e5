"""Where a mask was read, and how, as plain values with which it can be read again."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from heartgen.images.schemes import Scheme
from heartgen.images.taking import Taking


def source_of(file: Path, taking: Taking, view: bool) -> Mapping[str, Any]:
    """Where a mask was read, and how: values that JSON holds.

    Parameters
    ----------
    file : Path
        What was read.
    taking : Taking
        What was taken of it.
    view : bool
        As of `heartgen.read_mask`.
    """
    said = {"path": str(file.absolute())} | ({"view": True} if view else {})
    for each in fields(Taking):
        if (plain := _plain(getattr(taking, each.name))) != each.default:
            said[each.name] = plain
    return said


def taking_of(said: Mapping[str, Any]) -> Taking:
    """What is to be taken, from what `source_of` says of it.

    Parameters
    ----------
    said : mapping of str to value
        All but the path and the view.
    """
    choices = dict(said)
    if isinstance(choices.get("scheme"), dict) and "name" in choices["scheme"]:
        parts: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in choices["scheme"].items()
        }
        choices["scheme"] = Scheme(**parts)
    return Taking(**choices)


def _plain(value: Any) -> Any:
    """A value as JSON holds it."""
    if isinstance(value, Scheme):
        return _plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(each) for key, each in value.items()}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, str | int | float | None):
        return value
    return [_plain(each) for each in value] if isinstance(value, Iterable) else str(value)
