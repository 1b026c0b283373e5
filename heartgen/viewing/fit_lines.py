"""The lines of a mesh in a slice: its surface, and the faces of its elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import NDArray

Array = NDArray[np.float64]

OUTLINE, FACES = "#14304d", "#0072b2"
OUTLINE_ON_GRAY, FACES_ON_GRAY = "#f0e442", "#56b4e9"
"""Colors of the surface and of the elements' faces; over a gray image, bright ones."""

THICK, THIN = 1.8, 0.7
"""Widths of both, points."""


@dataclass(frozen=True, eq=False)
class FitSection:
    """A mesh where one slice cuts it; mm, to the right and upwards in the slice.

    Attributes
    ----------
    edges : (n, 2, 2) float64
        Ends of the pieces of all elements' faces.
    outline : (m, 2, 2) float64
        Ends of the pieces of the external surface.
    error : (m,) float64
        Distance of each of these to the mask, mm.
    triangles : (t, 3, 2) float64
        Corners of triangles that fill the wall.
    element : (t,) int
        Element in which each of these is, from 0.
    """

    edges: Array
    outline: Array
    error: Array
    triangles: Array
    element: NDArray[np.intp]


NOTHING = FitSection(
    np.empty((0, 2, 2)),
    np.empty((0, 2, 2)),
    np.empty(0),
    np.empty((0, 3, 2)),
    np.empty(0, dtype=np.intp),
)
"""Of a mesh that the slice does not meet."""


def draw_fit(axes: Axes, fit: FitSection, gray: bool = False) -> None:
    """Draw a mesh where a slice cuts it.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Drawn into.
    fit : FitSection
        The mesh in the slice.
    gray : bool
        Whether a gray image is behind.
    """
    outer, inner = (OUTLINE_ON_GRAY, FACES_ON_GRAY) if gray else (OUTLINE, FACES)
    axes.add_collection(LineCollection(list(fit.edges), colors=inner, linewidths=THIN))
    axes.add_collection(LineCollection(list(fit.outline), colors=outer, linewidths=THICK))
