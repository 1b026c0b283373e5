"""What is said of an option, beside its type: words for users, unit, step, when it applies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from pydantic import GetJsonSchemaHandler
from pydantic_core import CoreSchema

Level = Literal["basic", "advanced"]
"""Options that most users want to see, and those that most runs leave alone."""


@dataclass(frozen=True)
class Word:
    """One of the words that an option may be.

    Attributes
    ----------
    title : str
        Its name for users.
    help : str
        A clause about it.
    """

    title: str
    help: str


@dataclass(frozen=True)
class Needs:
    """What another option has to be, for an option to have an effect.

    Attributes
    ----------
    option : str
        Name of the other option.
    value : object
        What it has to be.
    refusal : str
        What is said where an option is set although the other is not so, with both by name in
        braces; empty if it is then without effect, and not refused.
    """

    option: str
    value: Any
    refusal: str = ""


@dataclass(frozen=True)
class About:
    """What is to be said of an option: its type, range and default are those of the field.

    Attributes
    ----------
    title : str
        Its name for users.
    help : str
        One sentence or two: what it does, and what the values mean.
    step : str
        The first step of the pipeline that it changes.
    level : {"basic", "advanced"}
        Who needs it.
    unit : str
        Of its number, if any.
    wrong : str
        What is wrong with a value that is refused, to be said after the option and the value.
    remedy : str
        What to do then.
    when : str
        When it applies, in words that follow on *only*; always if empty.
    needs : Needs or None
        The other option that decides whether it applies, if there is one.
    words : mapping of str to Word
        Explanations of the words that it may be; yes and no for what is on or off.
    unset : str
        What heartgen takes where the value is None.
    example : object
        A number, or numbers, to begin with where a user gives some.
    parts : tuple of str
        What each of three numbers is.
    flag : str
        On the command line, if not made of the name.
    """

    title: str
    help: str
    step: str
    level: Level = "advanced"
    unit: str = ""
    wrong: str = ""
    remedy: str = ""
    when: str = ""
    needs: Needs | None = None
    words: Mapping[str, Word] = field(default_factory=dict)
    unset: str = ""
    example: Any = None
    parts: tuple[str, ...] = ()
    flag: str = ""

    def __get_pydantic_json_schema__(
        self, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Tell all of this in the JSON schema, as well.

        Parameters
        ----------
        core_schema : dict
            Of the field.
        handler : callable
            Makes the JSON schema of it.

        Returns
        -------
        dict
        """
        told = {"title": self.title, "description": self.help, "step": self.step}
        told |= {"level": self.level, "unit": self.unit, "when": self.when}
        return handler(core_schema) | {key: text for key, text in told.items() if text}
