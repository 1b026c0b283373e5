"""Refusals of options, in the sentences that their declaration has for it."""

from __future__ import annotations

from functools import wraps
from typing import Any, TypeVar

from pydantic import ValidationError

from heartgen.errors import InputError
from heartgen.options.option import listed, no_such_option

C = TypeVar("C", bound=type)


def refuses_in_sentences(cls: C) -> C:
    """Let a class of pydantic's refuse in one sentence for users, instead of in a list.

    Parameters
    ----------
    cls : type
        The class; changed, and returned.
    """
    made = cls.__init__  # type: ignore[misc]  # of this class alone

    @wraps(made)
    def init(self: Any, *args: Any, **choices: Any) -> None:
        try:
            made(self, *args, **choices)
        except ValidationError as error:
            first = error.errors()[0]
        else:
            return
        if not first["loc"]:  # of how options go together
            raise first["ctx"]["error"]
        name, options = str(first["loc"][0]), listed(cls)
        if name not in options:
            raise no_such_option(name, options)
        given = dict(zip(options, args, strict=False)) | choices
        raise InputError(options[name].refusal(given[name]))

    setattr(cls, "__init__", init)  # noqa: B010  # as an assignment, it is refused by mypy
    return cls
