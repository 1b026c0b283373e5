"""Options as users write them, in tables and on command lines, and all their combinations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import product
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from heartgen.errors import InputError
from heartgen.options import Options, direction_from_text, elements_from_text
from heartgen.renamed import new_setting

YES, NO = ("yes", "true", "on", "1"), ("no", "false", "off", "0")
"""What may be written for an option that is on or off."""

UNSET = ("auto", "default", "")
"""What may be written for an option that is left to heartgen."""


def option_from_text(name: str, text: str) -> Any:
    """Read the value of an option as a user writes it.

    Parameters
    ----------
    name : str
        Of a field of `Options`.
    text : str
        For example ``"1x12x6"``, ``"2.5"``, ``"off"``, ``"yes"``.

    Returns
    -------
    object
        A value for that field; which words and numbers there are is for `Options` to judge.

    Raises
    ------
    InputError
        If there is no such option, or it is no such value.
    """
    hints = get_type_hints(Options)
    if name not in hints:
        raise InputError(f"there is no option {name!r}: choose among {', '.join(hints)}")
    kinds, text = _kinds(hints[name]), text.strip()
    if bool in kinds:
        return _switch(name, text)
    if type(None) in kinds and text.lower() in UNSET:
        return None
    if tuple in kinds:
        return elements_from_text(text) if name == "elements" else direction_from_text(text)
    try:
        number = float(text)
    except ValueError:
        if str not in kinds:
            raise InputError(f"{name} {text!r} is not a number: give one") from None
        return text
    return int(number) if int in kinds and number.is_integer() else number


def setting_from_text(name: str, text: str) -> tuple[str, Any]:
    """Name and value of an option, of which the name may be a former one.

    Parameters
    ----------
    name : str
        Of an option.
    text : str
        Its value, as a user writes it.
    """
    name, text = new_setting(name, text)
    return name, option_from_text(name, text)


def settings_from_text(settings: Iterable[str]) -> dict[str, list[Any]]:
    """Options and their values from texts such as ``quality=0.5,1,2``.

    Parameters
    ----------
    settings : iterable of str
        Each the name of an option, ``=``, and values with commas between them.

    Raises
    ------
    InputError
        If one has no value, is not known, or is given twice.
    """
    found: dict[str, list[Any]] = {}
    for setting in settings:
        name, equals, values = setting.partition("=")
        name = name.strip().replace("-", "_")
        if not equals or not values.strip():
            raise InputError(f"setting {setting!r} has no value: write it like quality=2")
        read = [setting_from_text(name, value) for value in values.split(",")]
        name = read[0][0]
        if name in found:
            raise InputError(f"option {name!r} is given twice: give all its values at once")
        found[name] = [value for _, value in read]
    return found


def combinations(choices: Mapping[str, Any]) -> list[dict[str, Any]]:
    """All combinations of values.

    Parameters
    ----------
    choices : mapping of str to value, or to list of values
        A list stands for several values; whatever else, a tuple as well, for one.

    Returns
    -------
    list of dict
        The last option changes fastest.
    """
    values: Sequence[Sequence[Any]] = [v if isinstance(v, list) else [v] for v in choices.values()]
    return [dict(zip(choices, point, strict=True)) for point in product(*values)]


def as_text(value: Any) -> str:
    """The value of an option as a user writes it.

    Parameters
    ----------
    value : object
        Of an option.
    """
    if value is None:
        return "auto"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, (tuple, list)):
        counts = all(isinstance(part, int) and part > 0 for part in value)
        return ("x" if counts else "/").join(map(as_text, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _switch(name: str, text: str) -> bool:
    """On or off."""
    if text.lower() not in YES + NO:
        raise InputError(f"{name} {text!r} is neither yes nor no: give one of them")
    return text.lower() in YES


def _kinds(hint: Any) -> set[type]:
    """Types that a type hint allows; a word that it lists counts as text."""
    if get_origin(hint) in (Union, UnionType):
        return set().union(*map(_kinds, get_args(hint)))
    if get_origin(hint) is Literal:
        return {str}
    return {get_origin(hint) or hint}
