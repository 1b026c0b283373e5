"""Options with single ones replaced, as `personalize` takes them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from heartgen.errors import InputError
from heartgen.options.declared import Options
from heartgen.renamed import new_options


def chosen(options: Options | None, choices: Mapping[str, Any]) -> Options:
    """Options with single ones replaced.

    Parameters
    ----------
    options : Options or None
        None for the defaults.
    choices : mapping of str to value
        By name.

    Returns
    -------
    Options

    Raises
    ------
    InputError
        If there is no such option, or a value is not one.

    Examples
    --------
    >>> chosen(None, {"lod": 3}).lod
    3
    >>> chosen(None, {"optimizer": False})
    Traceback (most recent call last):
    heartgen.errors.InputError: there is no option 'optimizer': did you mean 'optimize'?
    """
    if options is not None and not isinstance(options, Options):
        raise InputError(
            f"options of type {type(options).__name__} are none: give heartgen.Options(...), or "
            "single options by name, such as lod=3"
        )
    return replace(options or Options(), **new_options(choices))
