"""Flags of the command line, made from the declaration of the options."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import wraps
from itertools import chain
from typing import Annotated, Any, get_type_hints

import typer

from heartgen.options import OPTIONS, Option, as_text
from heartgen.options.option import by_step, explanation

Choices = Mapping[str, str]
"""Options that were given, as they were written."""

STATED = "choices"
"""The parameter of a command that stands for the flags."""


def takes_options(
    names: Iterable[str] = tuple(OPTIONS),
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command a flag for each option, in the place of its parameter ``choices``.

    Parameters
    ----------
    names : iterable of str
        Of the options; all by default.
    """
    wanted = [OPTIONS[name] for name in names]
    basic = [each for each in wanted if each.about.level == "basic"]
    others = by_step(each for each in wanted if each.about.level == "advanced")
    options = [*basic, *chain.from_iterable(others.values())]

    def extended(command: Callable[..., None]) -> Callable[..., None]:
        hints = get_type_hints(command, include_extras=True)
        parameters: list[inspect.Parameter] = []
        for each in inspect.signature(command).parameters.values():
            if each.name == STATED:
                parameters += map(_flag, options)
            else:
                parameters.append(each.replace(annotation=hints[each.name]))

        @wraps(command)
        def called(**given: Any) -> None:
            written = {each.name: given.pop(each.name) for each in options}
            command(**given, **{STATED: _stated(written)})

        del called.__wrapped__  # which would be asked for the signature
        called.__annotations__ = {each.name: each.annotation for each in parameters}
        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        return called

    return extended


def flag_of(name: str) -> Any:
    """Annotation of a parameter that is an option, for a command that takes few.

    Parameters
    ----------
    name : str
        Of the option.
    """
    return _flag(OPTIONS[name]).annotation


def _stated(written: Mapping[str, Any]) -> dict[str, str]:
    """Values as texts, without those that were left as they are."""
    texts = {k: ("no" if v else "yes") if isinstance(v, bool) else v for k, v in written.items()}
    return {k: text for k, text in texts.items() if text != as_text(OPTIONS[k].default)}


def _flag(option: Option) -> inspect.Parameter:
    """The parameter of a command that Typer makes a flag of."""
    panel = None if option.about.level == "basic" else _panel(option)
    if option.switch:
        help = option.about.words["no"].help
        help = help[0].upper() + help[1:] + "."
        told = typer.Option(option.flag, help=help, rich_help_panel=panel)
        annotation: Any = Annotated[bool, told]
        default: Any = False
    else:
        told = typer.Option(
            option.flag,
            metavar=_metavar(option),
            help=explanation(option),
            rich_help_panel=panel,
        )
        annotation, default = Annotated[str, told], as_text(option.default)
    return inspect.Parameter(
        option.name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
    )


def _panel(option: Option) -> str:
    """Head of the part of the help that an option is in."""
    return f"Options of the {option.about.step}"


def _metavar(option: Option) -> str:
    """What the help shows for the value."""
    kinds = list(option.words)
    if option.row is not None:
        kinds.append("RxCxL" if option.row["type"] == "integer" else "X,Y,Z")
    if option.number is not None:
        counts = option.number["type"] == "integer"
        number = option.about.unit.upper() or "NUMBER"
        kinds.append("{minimum}..{maximum}".format_map(option.number) if counts else number)
    if option.optional:
        kinds.append("auto")
    return "|".join(kinds)
