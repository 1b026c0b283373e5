"""The words of the page, read from the glossary of the documentation, their one source."""

from __future__ import annotations

import html
import re
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

from heartgen.errors import HeartgenError

NAME = "glossary.md"

COLUMNS = 4
"""Of a table of the glossary: word, unit, what the paper says, meaning."""

MARKUP = (
    (re.compile(r"`([^`]+)`"), r"<code>\1</code>"),
    (re.compile(r"\*([^*]+)\*"), r"<i>\1</i>"),
    (re.compile(r"\[([^\]]+)\]\(([^)]+)\)"), r'<a href="\2">\1</a>'),
)
"""What the glossary uses of Markdown, and the HTML for it."""


@dataclass(frozen=True)
class Word:
    """An entry of the glossary.

    Attributes
    ----------
    section : str
        Title of its table.
    word, unit, paper, meaning : str
        As HTML; the unit and what the paper says may be empty.
    """

    section: str
    word: str
    unit: str
    paper: str
    meaning: str


@lru_cache(1)
def words() -> tuple[Word, ...]:
    """All words of the glossary, in its order.

    Returns
    -------
    tuple of Word

    Raises
    ------
    HeartgenError
        If the glossary is missing.
    """
    found, section = [], ""
    for line in _source().read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            section = line.removeprefix("## ")
        cells = [cell.strip() for cell in line.strip().strip("|").split("|")]
        if line.startswith("|") and len(cells) == COLUMNS and cells[0] not in ("word", "---"):
            found.append(Word(section, *map(_html, cells)))
    return tuple(found)


def rows() -> list[dict[str, str]]:
    """The words as the page takes them."""
    return [asdict(word) for word in words()]


def _source() -> Path:
    """The glossary in the installed package, or in the checkout beside it."""
    here = Path(__file__).resolve()
    for path in (here.parent / NAME, here.parents[2] / "docs" / NAME):
        if path.is_file():
            return path
    raise HeartgenError("the glossary is missing from the installation: install heartgen again")


def _html(text: str) -> str:
    """A cell of a table as HTML."""
    made = html.escape(text, quote=False)
    for pattern, replacement in MARKUP:
        made = pattern.sub(replacement, made)
    return made
