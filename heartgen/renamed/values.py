"""What users wrote or stored under former names, under the new ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, Any

from heartgen.renamed.tables import COLUMN_START, COLUMNS, FLAGS, OPTIONS, WORDS
from heartgen.renamed.telling import warn_of

if TYPE_CHECKING:
    from pandas import DataFrame


def new_options(choices: Mapping[str, Any], *, stored: bool = False) -> dict[str, Any]:
    """Options under their new names, with their new values.

    Parameters
    ----------
    choices : mapping of str to value
        A list of values stands for each of them.
    stored : bool
        Whether they come from a file, and not from somebody who could be told.

    Returns
    -------
    dict
        In the same order.

    Raises
    ------
    TypeError
        If an option is given under both names.
    """
    made: dict[str, Any] = {}
    for name, value in choices.items():
        new, values = OPTIONS.get(name, (name, {}))
        if new != name and new in choices:
            raise TypeError(f"{name} is the former name of {new}: give one of them")
        if new != name and not stored:
            warn_of(f"option {name}", new)
        each = value if isinstance(value, list) else [value]
        changed = [values.get(v, v) if isinstance(v, str) else v for v in each]
        made[new] = changed if isinstance(value, list) else changed[0]
    return made


def former_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """Options as former versions wrote them, in the same order.

    Parameters
    ----------
    options : mapping of str to object
        By their new names.
    """
    back = {new: (old, {v: k for k, v in values.items()}) for old, (new, values) in OPTIONS.items()}
    made = {}
    for name, value in options.items():
        old, values = back.get(name, (name, {}))
        made[old] = values.get(value, value) if values else value
    return made


def new_setting(name: str, text: str) -> tuple[str, str]:
    """Name and value of an option as users write them, both new.

    Parameters
    ----------
    name : str
        Of the option, new or former.
    text : str
        Its value, new or former.
    """
    if name not in OPTIONS:
        return name, text
    new, values = OPTIONS[name]
    warn_of(f"option {name}", new)
    value = values.get(text.strip(), text)
    return new, ("yes" if value else "no") if isinstance(value, bool) else value


def new_flags(arguments: Iterable[str]) -> list[str]:
    """Arguments of a command with the flags' new names.

    Parameters
    ----------
    arguments : iterable of str
        The command line.
    """
    made: list[str] = []
    rest = list(arguments)
    while rest:
        argument = rest.pop(0)
        if argument == "--":
            return [*made, argument, *rest]
        flag, equals, value = argument.partition("=")
        new = FLAGS.get(flag)
        if new is None:
            made.append(argument)
        elif isinstance(new, str):
            warn_of(flag, new)
            made.append(new + equals + value)
        else:
            value = value if equals else rest.pop(0) if rest else ""
            # A value that there never was is for the new flag to refuse.
            made += new.get(value, (argument, value))
            warn_of(flag, next(of[0] for of in new.values() if of))
    return made


def new_word(word: str) -> str:
    """The name of a field or coloring.

    Parameters
    ----------
    word : str
        New or former.
    """
    if word in WORDS:
        warn_of(repr(word), repr(WORDS[word]))
    return WORDS.get(word, word)


def new_column(name: str) -> str:
    """The name of a column of stored results.

    Parameters
    ----------
    name : str
        New or former.
    """
    start, now = COLUMN_START
    return now + name.removeprefix(start) if name.startswith(start) else COLUMNS.get(name, name)


def new_row(row: Mapping[str, Any]) -> dict[str, Any]:
    """A stored row of results under the new names.

    Parameters
    ----------
    row : mapping of str to object
        Values by column.
    """
    return {new_column(k): v for k, v in new_options(row, stored=True).items()}


def new_table(table: DataFrame) -> DataFrame:
    """A stored table of results under the new names.

    Parameters
    ----------
    table : DataFrame
        As it was stored.
    """
    for name in OPTIONS.keys() & set(table):
        values = OPTIONS[name][1]
        table[name] = [values.get(value, value) for value in table[name]]
    return table.rename(columns=new_column)
