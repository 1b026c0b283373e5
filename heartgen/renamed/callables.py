"""Classes and functions that are used with former names."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import wraps
from typing import Any, ParamSpec, TypeVar

from heartgen.renamed.tables import KEYWORDS, OPTIONS
from heartgen.renamed.telling import warn_of
from heartgen.renamed.values import new_options

P = ParamSpec("P")
R = TypeVar("R")
C = TypeVar("C", bound=type)


def takes_former_options(cls: C) -> C:
    """Let a dataclass of options be made with former names, and have them as attributes.

    Parameters
    ----------
    cls : type
        The dataclass; changed, and returned.
    """
    made = cls.__init__  # type: ignore[misc]  # of this class alone

    @wraps(made)
    def init(self: Any, *args: Any, **choices: Any) -> None:
        made(self, *args, **new_options(choices))

    setattr(cls, "__init__", init)  # noqa: B010  # as an assignment, it is refused by mypy
    return has_former_attributes({old: new for old, (new, _) in OPTIONS.items()})(cls)


def has_former_attributes(names: Mapping[str, str]) -> Callable[[C], C]:
    """Let objects of a class have attributes under former names; values are the new ones.

    Parameters
    ----------
    names : mapping of str to str
        New names by the former ones.
    """

    def former(self: Any, name: str) -> Any:
        if name not in names:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        warn_of(f"{type(self).__name__}.{name}", names[name])
        return getattr(self, names[name])

    def extended(cls: C) -> C:
        setattr(cls, "__getattr__", former)  # noqa: B010  # unseen by mypy, which checks new names
        return cls

    return extended


def takes_former_keywords(function: Callable[P, R]) -> Callable[P, R]:
    """Let a function be called with the former names of its arguments.

    Parameters
    ----------
    function : callable
        To be wrapped.
    """

    @wraps(function)
    def called(*args: P.args, **kwargs: P.kwargs) -> R:
        for name in KEYWORDS.keys() & kwargs.keys():
            warn_of(f"argument {name}", KEYWORDS[name])
            kwargs[KEYWORDS[name]] = kwargs.pop(name)
        return function(*args, **kwargs)

    return called
