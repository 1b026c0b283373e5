"""Where the rows of elements lie along the wall: the parametrization with the best elements.

det J of a cup grows with the distance from the apex, so that evenly spaced rows have a poor
Jacobian ratio near it, and it grows from endo- to epicardium. Rows and their spacing within each
element are free, on endo- and epicardium separately, and so is the grading of the depth across the
wall; this module chooses them so that log det J varies least within the elements, and the radial
lines stay square to the wall. By symmetry one meridian is enough.

Row 0 of a cup with an apical hole begins at the hole's radius on the endocardium; a square patch of
elements is the disc that ends where row 1 begins.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq, least_squares

from heartgen.errors import InputError
from heartgen.mesh.apical_patch import SIDES
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein, bernstein_derivative
from heartgen.mesh.grading import LINEAR, Grading, RowGrading, depth, depth_by_row
from heartgen.mesh.jacobian import QUALITY_GAUSS
from heartgen.mesh.quadrature import gauss
from heartgen.mesh.surface_chart import Apex
from heartgen.templates.ellipsoid import TruncatedEllipsoid

SQUARENESS = 0.5
"""Weight of the cosine between radial and longitudinal lines against the spread of log det J."""

EVENNESS = 0.05
"""Weight of the difference between neighboring rows: keeps the problem determined."""

WIDEST_HOLE = 0.4
"""Polar angle of the widest hole over that of the base."""

FOLDED = 1e-6
"""Relative det J that stands for a folded point, whose logarithm does not exist."""


@dataclass(frozen=True, eq=False)
class Spacing:
    """Polar angle along a meridian as a cubic Hermite function of the rows, and the grading.

    Attributes
    ----------
    value, slope : (2, rows + 1) float64
        Polar angle and its derivative per row at each row's end, on endo- and epicardium, rad.
    grading : Grading
        Of the depth.
    side : int
        Elements along a side of the square patch that takes the place of row 0, 0 if there is
        none. Over the patch the polar angle is proportional to the row.
    """

    value: NDArray[np.float64]
    slope: NDArray[np.float64]
    grading: Grading = LINEAR
    side: int = 0

    @property
    def rows(self) -> int:
        """Number of rows of elements."""
        return int(self.value.shape[1]) - 1

    def hermite(self) -> NDArray[np.float64]:
        """Value and slope at both ends of each row, (2, rows, 4)."""
        value, slope = self.value, self.slope
        out = np.stack([value[:, :-1], slope[:, :-1], value[:, 1:], slope[:, 1:]], -1)
        if self.side:
            out[:, 0] = value[:, 1:2] * [0, 1, 1, 1]
        return out

    def polar(self, surface: int, row: NDArray[np.float64]) -> NDArray[np.float64]:
        """Polar angle (n,), rad, on one of the two surfaces at row coordinates (n,).

        Parameters
        ----------
        surface : {0, 1}
            Endocardium, epicardium.
        row : (n,) float64
            From the apex to the base.
        """
        hermite = self.hermite()[surface]
        cell = np.clip(np.floor(row).astype(int), 0, len(hermite) - 1)
        coefficients = hermite[cell] @ HERMITE_TO_BERNSTEIN.T
        return np.asarray(np.sum(bernstein(row - cell) * coefficients, 1))


def best_spacing(
    shape: TruncatedEllipsoid,
    elements: tuple[int, int, int],
    graded: bool,
    apex: Apex,
    hole: float = 0.0,
    by_row: bool = False,
) -> Spacing:
    """Choose the rows of a template by least squares (see `best_meridians` for exact ones).

    Parameters
    ----------
    shape : TruncatedEllipsoid
        Of the template.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the depth across the wall may be graded; otherwise it is linear.
    apex : {"collapsed", "hole", "patch"}
        In poles, a hole or a square patch.
    hole : float
        Radius of the apical hole on the endocardium, mm.
    by_row : bool
        Whether the grading may change from row to row.

    Returns
    -------
    Spacing
        Above a square patch the rows begin as densely as those of the patch lie, for the mesh is
        smooth there.

    Raises
    ------
    InputError
        If the hole is too wide.
    """
    radial, around, rows = elements
    side = around // SIDES if apex == "patch" else 0
    even = even_rows(shape, rows, apex, hole)
    step = np.repeat((even[:, -1:] - even[:, :1]) / rows, rows + 1, axis=1)

    def spacing(p: NDArray[np.float64]) -> Spacing:
        free = p[2 : 2 + 4 * rows].reshape(2, 2 * rows)
        value = even.copy()
        value[:, 1:-1] += step[:, 1:-1] * free[:, : rows - 1]
        slope = step * (1 + free[:, rows - 1 :])
        if apex == "hole":
            value[1, 0] += step[1, 0] * p[2 + 4 * rows]
        if apex == "patch":
            slope[:, 1] = 2 / side * value[:, 1]
        grading: Grading = (1 + float(p[0]), 1 + float(p[1])) if graded else LINEAR
        if graded and by_row:
            grading = _changing(1 + p[:2] + p[-2 * (rows + 1) :].reshape(-1, 2), side)
        return Spacing(value, slope, grading, side)

    def misfit(p: NDArray[np.float64]) -> NDArray[np.float64]:
        candidate = spacing(p)
        spread, slant = _meridian(shape, candidate, radial)
        width = np.diff(candidate.value, axis=1) / step[:, 1:]
        out = [
            spread / np.sqrt(spread.size),
            SQUARENESS * slant / np.sqrt(slant.size),
            EVENNESS * np.diff(width, axis=1).ravel() / np.sqrt(width.size),
        ]
        if isinstance(candidate.grading, RowGrading):
            change = np.diff(candidate.grading.value, axis=0)
            out.append(EVENNESS * change.ravel() / np.sqrt(change.size))
        return np.concatenate(out)

    start = np.zeros(2 + 4 * rows + (apex == "hole") + by_row * 2 * (rows + 1))
    return spacing(least_squares(misfit, start, xtol=1e-4, ftol=1e-4).x)


def even_rows(
    shape: TruncatedEllipsoid, rows: int, apex: Apex = "collapsed", hole: float = 0.0
) -> NDArray[np.float64]:
    """Polar angles (2, rows + 1), rad, of evenly spaced rows on endo- and epicardium.

    Parameters
    ----------
    shape : TruncatedEllipsoid
        Of the template.
    rows : int
        Number of rows.
    apex : {"collapsed", "hole", "patch"}
        In poles, a hole or a square patch.
    hole : float
        Radius of the apical hole on the endocardium, mm.

    Raises
    ------
    InputError
        If the hole is too wide.
    """
    ends = np.array([shape.semi_axes(0)[2], shape.semi_axes(1)[2]])
    even = ends[:, None] * np.linspace(0, 1, rows + 1)
    if apex == "hole":
        even += _hole_angle(shape, hole) * np.linspace(1, 0, rows + 1)
    return even


def _changing(value: NDArray[np.float64], side: int) -> RowGrading:
    """Grading with these slopes (rows + 1, 2) at the rows, smooth between them."""
    change = np.gradient(value, axis=0)
    if side:
        # Nothing changes in the middle of the patch. Above it the space of the surfaces has
        # quadratic edges.
        change[0] = 0
        change[1] = 2 * (value[2] - value[1]) - change[2]
    return RowGrading(value, change)


def _depths(
    spacing: Spacing, radial: int, t: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Depth and its slope at Gauss points: (layer, row, point across, point along)."""
    xi = (np.arange(radial)[:, None] + t).ravel() / radial
    if isinstance(spacing.grading, tuple):
        value, slope = depth(xi, spacing.grading)
        return value.reshape(radial, 1, -1, 1), slope.reshape(radial, 1, -1, 1)
    value, change = spacing.grading.value, spacing.grading.change
    hermite = np.stack([value[:-1], change[:-1], value[1:], change[1:]], 1)
    if spacing.side:
        hermite[0, 3] *= spacing.side / 2  # from rows to distances on the disc
    basis = bernstein(t) @ HERMITE_TO_BERNSTEIN
    ends = np.einsum("pk,rkx->rpx", basis, hermite).reshape(-1, 2)
    shape = (radial, len(t), len(hermite), len(t))
    depths, stretch = (x.reshape(shape).transpose(0, 2, 1, 3) for x in depth_by_row(xi, ends))
    return depths, stretch


def _hole_angle(shape: TruncatedEllipsoid, radius: float) -> float:
    """Polar angle at which the endocardium has a mean radius."""
    section, _, end = shape.semi_axes(0)
    mean = float(np.sqrt(np.linalg.det(section)))

    def excess(polar: float) -> float:
        return mean * float(shape.profile(np.array([polar]), 0)[0][0]) - radius

    widest = WIDEST_HOLE * end
    if excess(widest) < 0:
        raise InputError(
            f"an apical hole of {radius:.3g} mm radius is too wide for this ventricle: choose at "
            f"most {excess(widest) + radius:.2g} mm"
        )
    return float(brentq(excess, 0, widest))


def _meridian(
    shape: TruncatedEllipsoid, spacing: Spacing, radial: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spread of log det J in each element, and cosines of the angle to the radial line.

    A square patch is a disc whose det J lacks the distance from the pole; an element of it has only
    its share of the spread.
    """
    t, w = gauss(QUALITY_GAUSS)
    hermite = spacing.hermite()
    polar = hermite @ HERMITE_TO_BERNSTEIN.T @ bernstein(t).T  # surface, row, point
    speed = hermite @ HERMITE_TO_BERNSTEIN.T @ bernstein_derivative(t).T
    place, tangent = [], []
    for surface in (0, 1):
        section, axis, _ = shape.semi_axes(surface)
        r = np.sqrt(np.linalg.det(section))
        p, v = polar[surface], speed[surface]
        width, widening = shape.profile(p, surface)
        place.append(np.stack([r * width, -axis * np.cos(p)], -1))
        tangent.append(np.stack([r * widening * v, axis * np.sin(p) * v], -1))
    depths, stretch = _depths(spacing, radial, t)
    depths = depths[..., None]
    across = place[1] - place[0]
    here = place[0][None, :, None] * (1 - depths) + place[1][None, :, None] * depths
    along = tangent[0][None, :, None] * (1 - depths) + tangent[1][None, :, None] * depths
    cross = across[None, :, None]
    det = stretch * here[..., 0] * (cross[..., 0] * along[..., 1] - cross[..., 1] * along[..., 0])
    log_det = np.log(np.maximum(det, FOLDED * np.abs(det).max()))
    if spacing.side:
        log_det[:, 0] -= np.log(t)
    weights = np.einsum("i,j->ij", w, w)
    mean = np.einsum("ersi,si->er", log_det, weights)[..., None, None]
    spread = (log_det - mean) * np.sqrt(weights)
    if spacing.side:
        spread[:, 0] /= spacing.side
    lengths = np.linalg.norm(np.broadcast_to(cross, along.shape), axis=-1) * np.linalg.norm(
        along, axis=-1
    )
    slant = np.sum(cross * along, axis=-1) / np.maximum(lengths, np.finfo(float).tiny)
    return spread.ravel(), slant.ravel()
