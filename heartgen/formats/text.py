"""Tables of numbers as text, to the last bit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray


def rows(numbers: NDArray[np.generic], separator: str = " ") -> Iterator[str]:
    """Rows of a table (n, k) of whole or real numbers, as lines without their ends.

    Parameters
    ----------
    numbers : (n, k) of a real type
        The table.
    separator : str
        Between the numbers of a row.
    """
    if numbers.dtype.kind == "f":
        for row in (numbers + np.zeros((), numbers.dtype)).tolist():  # no -0
            yield separator.join(f"{number:.17g}" for number in row)
    else:
        for row in numbers.tolist():
            yield separator.join(map(str, row))


def packed(numbers: NDArray[np.integer[Any]], per_line: int) -> Iterator[str]:
    """Whole numbers (n,), so many in a line, with commas between them and at the ends of lines.

    Parameters
    ----------
    numbers : (n,) int
        In their order.
    per_line : int
        How many stand in a line.
    """
    listed = [str(number) for number in numbers.tolist()]
    for first in range(0, len(listed), per_line):
        last = first + per_line >= len(listed)
        yield ", ".join(listed[first : first + per_line]) + ("" if last else ",")
