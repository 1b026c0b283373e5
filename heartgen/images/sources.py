"""Where a mask was read, and how, as plain values with which it can be read again."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, fields
from pathlib import Path
from typing import Any

import numpy as np

from heartgen.images.schemes import Scheme
from heartgen.images.taking import Taking

FAR = 3
"""Steps up from a folder to that of a mask, at most, that are told."""


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


def seen_from(source: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """The same source for a file in a folder that may be given to others.

    Parameters
    ----------
    source : mapping of str to value
        As of `source_of`.
    folder : Path
        Where the file will be.

    Returns
    -------
    mapping of str to value
        With a path relative to the folder, or the name alone of what lies far from it: the folders
        above tell others nothing but who the user is.
    """
    path = Path(source["path"])
    try:
        near = Path(os.path.relpath(path, folder.absolute()))
    except ValueError:  # on another drive
        near = Path(path.name)
    far = near.parts.count(os.pardir) > FAR
    return {**source, "path": path.name if far else near.as_posix()}


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
