"""Orders in which others list the 4 x 4 x 4 lattice points of an element."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

VTK_ORDER = """
000 300 330 030 003 303 333 033
100 200 310 320 130 230 010 020 103 203 313 323 133 233 013 023 001 002 301 302 331 332 031 032
011 021 012 022 311 321 312 322 101 201 102 202 131 231 132 232 110 210 120 220 113 213 123 223
111 211 121 221 112 212 122 222
"""
"""Lattice place (i, j, k) of each of VTK's points: corners, edges, faces, inside."""


def places(order: str) -> NDArray[np.intp]:
    """Lattice points of an element, xi1 fastest, from their places "ijk" or "ij" in digits 0-3.

    Parameters
    ----------
    order : str
        The places, with blanks between them.
    """
    digits = np.array([[int(digit) for digit in place] for place in order.split()])
    return np.asarray(digits @ 4 ** np.arange(digits.shape[1]))
