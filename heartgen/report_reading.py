"""Reports that were written, read again."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from heartgen.errors import InputError, MissingFileError
from heartgen.renamed import REPORT as FORMER
from heartgen.renamed import new_options
from heartgen.report import Report


def read_report(path: str | Path) -> Report:
    """Read a report.

    Parameters
    ----------
    path : path
        A ``report.json``, of this version or of a former one.

    Returns
    -------
    Report
        Of the numbers that were written; what its version did not measure is None.

    Raises
    ------
    InputError
        If there is none, or it is no report.
    """
    try:
        said = json.loads(Path(path).read_text(encoding="utf-8"))
        said = {FORMER.get(name, name): value for name, value in said.items()}
        options = {
            name: tuple(value) if isinstance(value, list) else value
            for name, value in new_options(said["options"], stored=True).items()
        }
        report: Report = _made(Report, said | {"options": options})
    except FileNotFoundError as error:
        raise MissingFileError(f"{path}: There is no report: check the folder.") from error
    except (OSError, ValueError, LookupError, AttributeError, TypeError) as error:
        raise InputError(
            f"{path}: This is no report that can be read ({error}): fit the mask again."
        ) from error
    return report


def _made(kind: Any, value: Any) -> Any:
    """A value of a type, from what JSON holds of it."""
    if is_dataclass(kind):
        hints = get_type_hints(kind)
        given = {}
        for each in fields(kind):
            if each.name in value:
                given[each.name] = _made(hints[each.name], value[each.name])
            elif each.default is MISSING and each.default_factory is MISSING:
                given[each.name] = None
        return kind(**given)  # type: ignore[operator]  # a class
    if get_origin(kind) in (Union, UnionType):
        kinds = [one for one in get_args(kind) if one is not type(None)]
        return None if value is None else _made(kinds[0], value) if len(kinds) == 1 else value
    if get_origin(kind) is tuple:
        inner = get_args(kind)
        each_kind = [inner[0]] * len(value) if inner[-1:] == (...,) else inner
        return tuple(_made(one, part) for one, part in zip(each_kind, value, strict=True))
    if get_origin(kind) is dict and isinstance(value, Mapping):
        key, inside = get_args(kind)
        return {
            int(name) if key is int else name: _made(inside, part) for name, part in value.items()
        }
    return value
