"""Parameters of the corners of a tricubic element: value and seven derivatives at each of eight."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import BERNSTEIN_TO_HERMITE

CORNERS = 8
PARAMETERS = 8
"""Of a corner: value, d/dxi1, d/dxi2, d2/dxi1dxi2, d/dxi3, d2/dxi1dxi3, d2/dxi2dxi3, d3."""


def corner_parameters() -> NDArray[np.float64]:
    """Parameters of the corners of an element from its Bernstein coefficients, (8, 8, 64)."""
    # All entries are whole numbers, but for the rounding of the inversion.
    return cube_by_ends(np.rint(BERNSTEIN_TO_HERMITE).reshape(2, 2, -1))


def cube_by_ends(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """`heartgen.mesh.bernstein.cube` of a matrix (end, derivative, m): (corner, derivative, m^3).

    Parameters
    ----------
    line : (2, 2, m) float64
        By end and derivative, for one direction.
    """
    return np.asarray(np.kron(line, np.kron(line, line)))
