"""Options as users write them, in tables and on command lines."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from heartgen.errors import InputError
from heartgen.options.declared import OPTIONS, Options
from heartgen.options.option import no_such_option
from heartgen.renamed import new_setting


def option_from_text(name: str, text: str) -> Any:
    """Read the value of an option as a user writes it.

    Parameters
    ----------
    name : str
        Of the option.
    text : str
        For example ``"1x12x6"``, ``"2.5"``, ``"off"``, ``"yes"``.

    Returns
    -------
    object
        A value of that option.

    Raises
    ------
    InputError
        If there is no such option, or it is no such value.

    Examples
    --------
    >>> option_from_text("elements", "1x12x6")
    (1, 12, 6)
    """
    if name not in OPTIONS:
        raise no_such_option(name, OPTIONS)
    option = OPTIONS[name]
    needs = option.about.needs
    beside = {needs.option: needs.value} if needs else {}
    return getattr(Options(**{name: option.read(text), **beside}), name)


def options_from_text(texts: Mapping[str, str]) -> Options:
    """Options from the values of some as users write them.

    Parameters
    ----------
    texts : mapping of str to str
        By name.

    Examples
    --------
    >>> options_from_text({"lod": "3", "truncate": "off"}).truncate
    'off'
    """
    return Options(**{name: option_from_text(name, text) for name, text in texts.items()})


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
