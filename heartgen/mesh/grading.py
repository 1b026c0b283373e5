"""How the depth in a wall depends on the transmural coordinate: graded for even elements.

The depth is the cubic from 0 to 1 with given slopes at endo- and epicardium. det J grows across a
curved wall, which the slopes make up for; more so near the apex, where it is most curved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein, bernstein_derivative
from heartgen.mesh.surface_chart import SurfaceChart

LINEAR = (1.0, 1.0)
"""Grading of a wall whose depth is proportional to xi."""


@dataclass(frozen=True, eq=False)
class RowGrading:
    """Grading that changes from apex to base.

    Attributes
    ----------
    value : (rows + 1, 2) float64
        Slopes of the depth at endo- and epicardium at each row of nodes; within a square patch
        those of row 0.
    change : (rows + 1, 2) float64
        Their derivative by xi2.
    """

    value: NDArray[np.float64]
    change: NDArray[np.float64]


Grading = tuple[float, float] | RowGrading


def depth(
    xi: NDArray[np.float64], grading: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative depth in a graded wall.

    Parameters
    ----------
    xi : (n,) float64
        Transmural coordinate, 0 endocardium to 1 epicardium.
    grading : (float, float)
        Slopes at endo- and epicardium; (1, 1) is linear.

    Returns
    -------
    value, slope : (n,) float64
    """
    coefficients = HERMITE_TO_BERNSTEIN @ np.array([0.0, grading[0], 1.0, grading[1]])
    return bernstein(xi) @ coefficients, bernstein_derivative(xi) @ coefficients


def depth_by_row(
    xi: NDArray[np.float64], ends: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative depth (n, m), and its slope, at transmural coordinates (n,) and gradings (m, 2).

    Parameters
    ----------
    xi : (n,) float64
        Transmural coordinate, 0 endocardium to 1 epicardium.
    ends : (m, 2) float64
        Slopes at endo- and epicardium; (1, 1) is linear.
    """
    hermite = np.stack([0 * ends[:, 0], ends[:, 0], 1 + 0 * ends[:, 0], ends[:, 1]])
    coefficients = HERMITE_TO_BERNSTEIN @ hermite
    return bernstein(xi) @ coefficients, bernstein_derivative(xi) @ coefficients


def blending_weights(
    chart: SurfaceChart, dofs: NDArray[np.intp], xi: NDArray[np.float64], grading: Grading
) -> list[BlendingWeights]:
    """What degrees of freedom in a wall take from those of epicardium and endocardium.

    Parameters
    ----------
    chart : SurfaceChart
        Of the surfaces on both sides of the wall.
    dofs : (m,) int
        Degrees of freedom of the chart, all of a node's or none.
    xi : (n,) float64
        Transmural coordinates of layers of nodes.
    grading : Grading
        If it changes from row to row, its product with the wall's thickness is that of the nodes,
        and the wall is straight but for what is lost between them.

    Returns
    -------
    list of BlendingWeights
    """
    if isinstance(grading, tuple):
        value, slope = (x[:, None].repeat(len(dofs), axis=1) for x in depth(xi, grading))
        return [BlendingWeights(dofs, dofs, value, slope, 1.0)]
    own, change = (depth_by_row(xi, ends) for ends in (grading.value, grading.change))
    still = depth_by_row(xi, 0 * grading.change)
    at = chart.rows[dofs]
    derivative, of = chart.rising[np.isin(chart.rising[:, 0], dofs)].T
    rise = [(x - y)[:, chart.rows[of]] for x, y in zip(change, still, strict=True)]
    return [
        BlendingWeights(dofs, dofs, own[0][:, at], own[1][:, at], 1.0),
        BlendingWeights(derivative, of, rise[0], rise[1], 0.0),
    ]


class BlendingWeights(NamedTuple):
    """Part of the degrees of freedom of layers that comes from the two surfaces.

    Attributes
    ----------
    target, source : (m,) int
        Degrees of freedom of the chart in the layers, and those on the surfaces.
    value, slope : (n, m) float64
        Share of the epicardium in each layer, and its derivative by xi.
    whole : float
        What both surfaces have together.
    """

    target: NDArray[np.intp]
    source: NDArray[np.intp]
    value: NDArray[np.float64]
    slope: NDArray[np.float64]
    whole: float
