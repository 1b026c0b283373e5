"""How objects show themselves: a few lines, in a terminal and in a notebook."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape

MOST_LINES = 10
"""Lines that an object may take to show itself."""

LONGEST = 150
"""Letters of a line."""


def in_lines(lines: Iterable[str], rest: str = "") -> str:
    """Text of at most `MOST_LINES`.

    Parameters
    ----------
    lines : iterable of str
        Those that are too many are counted; long ones are cut.
    rest : str
        Where to read what is left out.

    Returns
    -------
    str
    """
    lines = [line if len(line) <= LONGEST else f"{line[:LONGEST]}..." for line in lines]
    if len(lines) > MOST_LINES:
        left = len(lines) - MOST_LINES + 1
        lines[MOST_LINES - 1 :] = [f"  ... {left} more lines{rest}"]
    return "\n".join(lines)


def as_html(text: str) -> str:
    """Text as a notebook shows it.

    Parameters
    ----------
    text : str
        Plain, in lines.
    """
    return f'<pre style="margin:0;font-family:monospace">{escape(text)}</pre>'


def counted(number: int, what: str) -> str:
    """A number and what it counts, in the plural where it is not 1.

    Parameters
    ----------
    number : int
        How many there are.
    what : str
        In the singular.
    """
    return f"{number} {what}" if number == 1 else f"{number} {what}s"
