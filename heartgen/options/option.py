"""An option as its declaration has it: what its values are, in words and as users write them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, cached_property
from typing import Any, get_type_hints

from pydantic import TypeAdapter

from heartgen.errors import InputError
from heartgen.options.declaring import About
from heartgen.options.defaults import STEPS

YES, NO = ("yes", "true", "on", "1"), ("no", "false", "off", "0")
"""What may be written for an option that is on or off."""

INDENT = 4 * " "

UNSET = ("auto", "default", "")
"""What may be written for an option that is left to heartgen."""


@dataclass(frozen=True)
class Option:
    """An option.

    Attributes
    ----------
    name : str
        In Python, in tables and in JSON.
    about : About
        What is said of it.
    default : object
        Its value if nothing is asked for.
    schema : dict
        JSON schema of its values.
    """

    name: str
    about: About
    default: Any
    schema: Mapping[str, Any]

    def applies(self, options: Any) -> bool:
        """Whether it has an effect beside other options.

        Parameters
        ----------
        options : Options
            All of them, or an object with the same attributes.
        """
        needs = self.about.needs
        return needs is None or getattr(options, needs.option) == needs.value

    def check_beside(self, options: Any) -> None:
        """Refuse a value that other options leave without a meaning.

        Parameters
        ----------
        options : Options
            All of them.

        Raises
        ------
        InputError
            In the sentence that the declaration has for this.
        """
        refusal = self.about.needs.refusal if self.about.needs else ""
        chosen = getattr(options, self.name) != self.default
        if refusal and chosen and not self.applies(options):
            raise InputError(refusal.format_map(vars(options)))

    def refusal(self, value: Any) -> str:
        """What is said where a value is none of this option.

        Parameters
        ----------
        value : object
            Whatever was given.
        """
        title = self.about.title
        subject = title if title[:2].isupper() else title[0].lower() + title[1:]
        said = repr(value) if isinstance(value, str | bool | None) else as_text(value)
        if self.row and self.row["type"] == "integer":
            said = said.replace("/", "x")
        wrong = self.about.wrong or ("is neither yes nor no" if self.switch else "is not known")
        remedy = self.about.remedy or (
            "give one of them, True or False in Python" if self.switch else f"choose {self.choice}"
        )
        return f"{subject} {said} {wrong}: {remedy}"

    def read(self, text: str) -> Any:
        """The value that a text stands for; a text that stands for none is for `Options` to refuse.

        Parameters
        ----------
        text : str
            As a user writes it, such as ``1x12x6``, ``2.5``, ``off``, ``yes``, ``-1,-1,0``.
        """
        text = text.strip()
        if self.switch:
            return text.lower() in YES if text.lower() in YES + NO else text
        if self.optional and text.lower() in UNSET:
            return None
        kind = self.row or self.number
        if kind is None:
            return text
        counts = kind["type"] == "integer"
        parts = re.split("[x×]" if counts else "[,/]", text.lower()) if self.row else [text]
        try:
            numbers = tuple(map(_count if counts else float, parts))
        except ValueError:
            return text
        return numbers if self.row else numbers[0]

    @property
    def flag(self) -> str:
        """On the command line: for a switch, what turns it off."""
        return self.about.flag or ("--no-" if self.switch else "--") + self.name.replace("_", "-")

    @property
    def switch(self) -> bool:
        """Whether it is on or off."""
        return any(each.get("type") == "boolean" for each in self._kinds)

    @property
    def optional(self) -> bool:
        """Whether it may be None."""
        return any(each.get("type") == "null" for each in self._kinds)

    @property
    def words(self) -> tuple[str, ...]:
        """The words that it may be."""
        return tuple(word for each in self._kinds for word in each.get("enum", ()))

    @property
    def number(self) -> Mapping[str, Any] | None:
        """JSON schema of the number that it may be."""
        found = (each for each in self._kinds if each.get("type") in ("integer", "number"))
        return next(found, None)

    @property
    def row(self) -> Mapping[str, Any] | None:
        """JSON schema of each of the three numbers that it may be."""
        found = (each["prefixItems"][0] for each in self._kinds if each.get("type") == "array")
        return next(found, None)

    @cached_property
    def choice(self) -> str:
        """All that it may be, in words."""
        kinds = ["yes or no"] if self.switch else []
        if self.row is not None:
            kinds.append(f"three {_range(self.row, 's')}")
        if self.number is not None:
            kinds.append(f"{_range(self.number)} {self.about.unit}".strip())
        kinds += self.words
        if self.optional:
            kinds.append("auto")
        return f"{', '.join(kinds[:-1])} or {kinds[-1]}" if len(kinds) > 1 else kinds[0]

    @property
    def _kinds(self) -> list[Mapping[str, Any]]:
        """JSON schemas of the kinds of values that it may be."""
        found: list[Mapping[str, Any]] = self.schema.get("anyOf", [self.schema])
        return found


@cache
def listed(cls: type) -> dict[str, Option]:
    """The options that a class declares, in order.

    Parameters
    ----------
    cls : type
        Of pydantic's, with an `About` for each field.
    """
    schemas = TypeAdapter(cls).json_schema()["properties"]
    hints = get_type_hints(cls, include_extras=True)
    return {
        name: Option(
            name,
            next(each for each in hints[name].__metadata__ if isinstance(each, About)),
            getattr(cls, name),
            schemas[name],
        )
        for name in schemas
    }


def by_step(options: Iterable[Option]) -> dict[str, list[Option]]:
    """Options by the first step that they change, in the steps' order.

    Parameters
    ----------
    options : iterable of Option
        Any of them.

    Returns
    -------
    dict
        Without steps that none of them changes.
    """
    found = list(options)
    groups = {step: [each for each in found if each.about.step == step] for step in STEPS}
    return {step: each for step, each in groups.items() if each}


def attributes(options: Iterable[Option]) -> str:
    """The options, as a docstring tells them.

    Parameters
    ----------
    options : iterable of Option
        All of them.
    """
    told: list[str] = []
    for option in options:
        told.append(f"{INDENT}{option.name} : {option.choice}")
        told += textwrap.wrap(
            explanation(option), 100, initial_indent=2 * INDENT, subsequent_indent=2 * INDENT
        )
    return "\n".join(told) + "\n"


def explanation(option: Option) -> str:
    """All that is said of an option, but for its range and default, in sentences.

    Parameters
    ----------
    option : Option
        The option.
    """
    about = option.about
    said = [about.help]
    if about.words:
        said.append("; ".join(f"{word}: {each.help}" for word, each in about.words.items()) + ".")
    if about.unset:
        said.append(f"auto: {about.unset}.")
    if about.when:
        said.append(f"Only {about.when}.")
    return " ".join(said)


def no_such_option(name: str, known: Iterable[str]) -> InputError:
    """What is raised where an option is asked for that there is not.

    Parameters
    ----------
    name : str
        That was asked for.
    known : iterable of str
        Names of all options.
    """
    close = get_close_matches(name, known, 1)
    told = f"did you mean {close[0]!r}?" if close else f"choose among {', '.join(known)}"
    return InputError(f"there is no option {name!r}: {told}")


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
    if isinstance(value, float):
        short = f"{value:g}"
        return short if float(short) == value else repr(value)
    return str(value)


def _count(text: str) -> float:
    """A whole number; others are for `Options` to refuse."""
    number = float(text)
    return int(number) if number.is_integer() else number


def _range(schema: Mapping[str, Any], plural: str = "") -> str:
    """The numbers of a JSON schema, in words."""
    kind = f"{'whole ' if schema['type'] == 'integer' else ''}number{plural}"
    low, high = schema.get("minimum"), schema.get("maximum")
    above, below = schema.get("exclusiveMinimum"), schema.get("exclusiveMaximum")
    said = [kind if plural else f"a {kind}"]
    if above is not None:
        said.append(f"above {above:g}")
    if low is not None:
        said.append(f"from {low:g}")
    if high is not None:
        said.append(f"to {high:g}")
    if below is not None:
        said.append(f"to below {below:g}")
    return " ".join(said)
