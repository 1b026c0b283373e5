"""The options for machines and for readers: a JSON schema, and the page docs/options.md."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from pydantic import TypeAdapter

from heartgen.options.declared import OPTIONS, Options
from heartgen.options.option import Option, as_text, by_step, explanation

HEAD = """# Options

Made from their declaration in `heartgen/options/declared.py` by `heartgen options --markdown`.

An option has one name everywhere: in Python (`heartgen.personalize(mask, lod=3)`), as a column of a
table for `heartgen batch`, after `--set` of `heartgen batch` and `heartgen sweep`
(`--set quality=0.5,1,2`), and in JSON, of which `heartgen options --json` prints the schema. On the
command line, each has a flag. Elements are written `1x12x6`, directions `-1,-1,0`, or `-1/-1/0`
where commas part values. The [glossary](glossary.md) explains the words.
"""


def options_schema() -> dict[str, Any]:
    """JSON schema of the options, with title, step, level, unit and when each applies.

    Returns
    -------
    dict

    Examples
    --------
    >>> options_schema()["properties"]["lod"]["maximum"]
    5
    """
    schema = TypeAdapter(Options).json_schema()
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **schema,
        "title": "Options of heartgen",
        "description": "What the user may choose.",
    }


def options_markdown() -> str:
    """The page of the options.

    Returns
    -------
    str
        Markdown.
    """
    basic = [each for each in OPTIONS.values() if each.about.level == "basic"]
    others = [each for each in OPTIONS.values() if each.about.level == "advanced"]
    groups = {"Basic": basic, **{_capital(k): v for k, v in by_step(others).items()}}
    return HEAD + "".join(f"\n## {title}\n\n{_table(group)}" for title, group in groups.items())


def _table(options: Iterable[Option]) -> str:
    """A table of options."""
    rows = ["| option | command line | values | default | |", "|---|---|---|---|---|"]
    for each in options:
        rows.append(
            f"| `{each.name}` | `{each.flag}` | {each.choice} | {as_text(each.default)} | "
            f"{explanation(each)} |"
        )
    return "\n".join(rows) + "\n"


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
