"""Where the faces of a square patch lie: a map from the patch and the first ring onto a disc.

The distance from the middle of the disc is proportional to the angle from the apex, and 1 at row 1;
the angle is that around the long axis. The patch is a square bent by a cubic map with the symmetry
of the square; the first ring leads from it to row 2 with the kink of the parameters that the space
of the surfaces prescribes (`heartgen.mesh.apical_patch`). The few numbers in this are chosen for
the best elements.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.optimize import least_squares

from heartgen.mesh.apical_patch import SIDES, patch_chart
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surface_chart import SurfaceChart
from heartgen.mesh.surface_faces import tabulate_face

Array = NDArray[np.float64]
Angle = Callable[[Array], Array]
"""Angle (n,) around the long axis, rad, at column coordinates (n,)."""

FACE_GAUSS = 5
"""Points per face and direction at which coefficients are fitted: more than a face's 4."""

PER_ROW = 32
"""Places in a row at which distances on the disc are tabulated."""

RINGS = 3
"""Rows of a chart that are enough to choose the shape of the patch."""

START = (0.9, -0.1, 0.1)
"""Half the width of the patch, and its two cubic coefficients, where the search starts."""

SQUARENESS = 0.5
"""Weight of the cosine between the faces' directions against the spread of the log of areas."""

STEP = 1e-4
"""Of the differences that replace the slopes of a surface over the disc."""

FOLDED = 1e-6
"""Area that stands for that of a folded face, whose logarithm does not exist, mm^2."""


@dataclass(frozen=True, eq=False)
class ApicalPatchMap:
    """Places of the faces of a chart with a square patch.

    Attributes
    ----------
    chart : SurfaceChart
        With a square patch at the apex.
    dofs : (n, 2) float64
        Degrees of freedom of the map of the chart onto the disc.
    radius : PchipInterpolator
        Distance from the middle at rows.
    """

    chart: SurfaceChart
    dofs: Array
    radius: PchipInterpolator

    def polar(self, uv: Array) -> tuple[Array, Array]:
        """Angles (f, q), rad, and rows (f, q) at parameters (q, 2) of every face.

        Parameters
        ----------
        uv : (q, 2) float64
            Parameters in the unit square.
        """
        x, y = np.moveaxis(evaluate(self.chart, uv) @ self.dofs, -1, 0)
        shape = (self.chart.n_faces, len(uv))
        row = _inverse(self.radius)(np.hypot(x, y))
        return np.arctan2(y, x).reshape(shape), row.reshape(shape)


def radius_of(polar: Callable[[Array], Array], along: int) -> PchipInterpolator:
    """Distance from the middle of the disc at rows, from the angle from the apex at rows (n,).

    Parameters
    ----------
    polar : callable
        Angle from the apex, rad, at rows (n,).
    along : int
        Rows.
    """
    rows = np.linspace(0, along, along * PER_ROW + 1)
    return PchipInterpolator(rows, polar(rows) / polar(np.ones(1)))


def fit_patch_map(
    chart: SurfaceChart,
    corner: int,
    angle: Angle,
    radius: PchipInterpolator,
    surface: Callable[[Array, Array], Array],
) -> ApicalPatchMap:
    """Lay the faces of a chart onto the disc.

    Parameters
    ----------
    chart : SurfaceChart
        With a square patch.
    corner : int
        Column of a corner of the patch.
    angle : callable
        Of the columns.
    radius : PchipInterpolator
        Distance from the middle of the disc at rows.
    surface : callable
        Points (n, 3), mm, at angles (n,) and rows (n,): the surface on which the faces shall be
        good.

    Returns
    -------
    ApicalPatchMap
    """
    side = chart.around // SIDES
    uv, _ = gauss_square(FACE_GAUSS)

    def places(of: SurfaceChart, p: Array) -> Array:
        return _places(of, side, corner, angle, radius, uv, p)

    small = patch_chart(chart.around, min(RINGS, int(chart.index[:, 1].max()) + 1), corner)
    fit = Fit(small, uv)
    judged = np.repeat(small.index[:, 1] < 2, len(uv))
    value, along, across = (
        sp.csr_array(evaluate(small, uv, d)[judged]) for d in ((0, 0), (1, 0), (0, 1))
    )

    row = _inverse(radius)

    def on(at: Array) -> Array:
        return surface(np.arctan2(at[:, 1], at[:, 0]), row(np.hypot(*at.T)))

    def misfit(p: Array) -> Array:
        dofs = fit.dofs(places(small, p))
        at = value @ dofs
        slopes = [(on(at + STEP * e) - on(at - STEP * e)) / (2 * STEP) for e in np.eye(2)]
        tangents = [
            d[:, :1] * slopes[0] + d[:, 1:] * slopes[1] for d in (along @ dofs, across @ dofs)
        ]
        area = np.linalg.norm(np.cross(tangents[0], tangents[1]), axis=1)
        turned = np.linalg.det(np.stack([along @ dofs, across @ dofs], -1))
        log_area = np.log(np.where(turned < 0, area, FOLDED)).reshape(-1, len(uv))
        cosine = np.sum(tangents[0] * tangents[1], axis=1) / np.prod(
            [np.linalg.norm(t, axis=1) for t in tangents], axis=0
        )
        spread = log_area - log_area.mean(1, keepdims=True)
        return np.concatenate([spread.ravel(), SQUARENESS * cosine])

    best = least_squares(misfit, START, xtol=1e-3, ftol=1e-3).x
    return ApicalPatchMap(chart, Fit(chart, uv).dofs(places(chart, best)), radius)


class Fit:
    """Least-squares fit of the degrees of freedom of a chart to values at points of its faces.

    Parameters
    ----------
    chart : SurfaceChart
        Of the surface.
    uv : (q, 2) float64
        Parameters of the points on every face.
    """

    def __init__(self, chart: SurfaceChart, uv: Array) -> None:
        self._basis = evaluate(chart, uv)
        self._solve = spla.splu(sp.csc_array(self._basis.T @ self._basis)).solve

    def dofs(self, values: Array) -> Array:
        """Degrees of freedom (n, d) from values (f q, d).

        Parameters
        ----------
        values : (f q, d) float64
            At the points of every face.
        """
        return np.asarray(self._solve(np.asarray(self._basis.T @ values)))


def evaluate(chart: SurfaceChart, uv: Array, derivative: tuple[int, int] = (0, 0)) -> sp.csr_array:
    """Functions (f q, n) of a chart, or a derivative, at parameters (q, 2) of every face.

    Parameters
    ----------
    chart : SurfaceChart
        Of the surface.
    uv : (q, 2) float64
        Parameters in the unit square.
    derivative : (int, int)
        Order along u and v.
    """
    basis = sp.csr_array(tabulate_face(uv, derivative))
    return sp.csr_array(sp.kron(sp.eye_array(chart.n_faces), basis) @ chart.extraction)


def _inverse(radius: PchipInterpolator) -> PchipInterpolator:
    """Rows at distances from the middle."""
    return PchipInterpolator(radius(radius.x), radius.x)


def _places(
    chart: SurfaceChart,
    side: int,
    corner: int,
    angle: Angle,
    radius: PchipInterpolator,
    uv: Array,
    p: Array,
) -> Array:
    """Places (f q, 2) of all faces on the disc."""
    column, row = (x[:, None] + t for x, t in zip(chart.index.T, uv.T, strict=True))
    around = angle(column.ravel())
    ring = np.stack([np.cos(around), np.sin(around)], -1).reshape(*row.shape, 2)
    out = radius(row)[..., None] * ring
    # The middle of the first side of the patch lies where its columns are.
    middle = float(angle(np.array([corner + side / 2]))[0])
    frame = np.array([[-np.sin(middle), np.cos(middle)], [np.cos(middle), np.sin(middle)]])
    inside = chart.index[:, 1] == 0
    j, i = np.divmod(chart.index[inside, 0], side)
    square = np.stack([i[:, None] + uv[:, 0], j[:, None] + uv[:, 1]], -1) * 2 / side - 1
    out[inside] = _bent(square, p)[0] @ frame
    first = chart.index[:, 1] == 1
    border, leaving = _border(column[first] - corner, side, p)
    outer, rise = ring[first], radius.derivative()
    hermite = np.stack(
        [border @ frame, leaving @ frame, float(radius(2)) * outer, float(rise(2)) * outer], -1
    )
    cubic = bernstein(uv[:, 1]) @ HERMITE_TO_BERNSTEIN
    out[first] = np.einsum("fqxk,qk->fqx", hermite, cubic)
    return np.asarray(out.reshape(-1, 2))


def _bent(square: Array, p: Array) -> tuple[Array, Array, Array]:
    """Places (..., 2) of points of the square [-1, 1]^2, and their slopes by its coordinates."""
    size, own, other = p
    a, b = square[..., 0], square[..., 1]

    def along(a: Array, b: Array) -> tuple[Array, Array, Array]:
        value = a * (1 + own * a**2 + other * b**2)
        return value, 1 + 3 * own * a**2 + other * b**2, 2 * other * a * b

    (x, x_a, x_b), (y, y_b, y_a) = along(a, b), along(b, a)
    stacked = (np.stack(pair, -1) for pair in ((x, y), (x_a, y_a), (x_b, y_b)))
    place, by_a, by_b = (size * s for s in stacked)
    return place, by_a, by_b


def _border(column: Array, side: int, p: Array) -> tuple[Array, Array]:
    """Places (..., 2) on the border of the patch, and slopes by row with which the ring leaves it.

    Columns are counted from the corner at (-1, 1).
    """
    which, t = np.divmod(column % (SIDES * side), side)
    t = 2 * t / side - 1
    turns = np.array([[[1, 0], [0, 1]], [[0, -1], [1, 0]], [[-1, 0], [0, -1]], [[0, 1], [-1, 0]]])
    place, slope, outward = _bent(np.stack([t, np.ones_like(t)], -1), p)
    # The slope by column is 2 / side times that by t, and the kink is t times it.
    leaving = 2 / side * (t[..., None] * slope + outward)
    turn = turns[which.astype(int)]
    return (
        np.einsum("...x,...xy->...y", place, turn),
        np.einsum("...x,...xy->...y", leaving, turn),
    )
