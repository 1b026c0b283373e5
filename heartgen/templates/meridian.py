"""Meridians of a template without a patch: cubics that follow the ellipsoid and make good elements.

A cubic has no freedom to run along a given curve at a given pace: whoever prescribes the pace, as
`heartgen.templates.spacing` does, misses the curve, most of all near the apex, where a good pace is
far from even. Here the rows of both surfaces are plain cubic splines of radius and height, and two
things are asked of them at once: that they lie on the ellipsoid, at whatever pace, and that log det
J varies little within the elements, whose radial lines stay square to the wall. By symmetry one
meridian is enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein, bernstein_derivative
from heartgen.mesh.grading import LINEAR, Grading, RowGrading
from heartgen.mesh.jacobian import QUALITY_GAUSS
from heartgen.mesh.quadrature import gauss
from heartgen.mesh.surface_chart import Apex
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.spacing import FOLDED, even_rows

Array = NDArray[np.float64]

NEARNESS = 150.0
"""Weight of the distance from the ellipsoid, over its radius, against the spread of log det J: a
thousandth of the radius counts as much as 0.15. With more than `USUAL_ROWS` it grows with the
square of their number, for an apical row that deviates by a share of its own length would let the
surfaces converge slowly."""

USUAL_ROWS = 6

SQUARENESS = 0.3
"""Weight of the cotangent of the angle between radial and longitudinal lines, likewise."""

SHAPE_GAUSS = 5
"""Points in a row at which that distance is taken: more than the 4 coefficients of a cubic."""

TOLERABLE = 0.3
"""Variance of log det J from which more of it hardly counts. A row around a pole has about 1
whatever one does, and the others shall not suffer to make it a little less."""

EVENNESS = 0.1
"""Weight of the difference between neighboring rows' lengths, over their mean."""

STEADINESS = 0.01
"""Weight of the change of the grading from row to row."""

STEP = 1e-7
"""Of the differences that replace derivatives, of parameters of the size of 1."""

ENOUGH = 1e-4
"""Relative change of parameters or misfit at which the search ends."""


@dataclass(frozen=True, eq=False)
class Meridians:
    """Meridians of endo- and epicardium, and the grading of the depth between them.

    Attributes
    ----------
    shape : TruncatedEllipsoid
        Between whose surfaces they lie.
    dofs : (2, rows + 1, 2, 2) float64
        On each surface, at each row's end: value and slope by row of (mean radius, height), mm,
        heart frame.
    grading : Grading
        Of the depth.
    """

    shape: TruncatedEllipsoid
    dofs: Array
    grading: Grading

    @property
    def rows(self) -> int:
        """Number of rows of elements."""
        return int(self.dofs.shape[1]) - 1

    def polar(self, surface: int, row: Array) -> Array:
        """Polar angle (n,), rad, on one of the two surfaces at row coordinates (n,).

        Parameters
        ----------
        surface : {0, 1}
            Endocardium, epicardium.
        row : (n,) float64
            From the apex to the base.
        """
        cell = np.clip(np.floor(row).astype(int), 0, self.rows - 1)
        dofs = self.dofs[surface]
        hermite = np.concatenate([dofs[cell], dofs[cell + 1]], axis=1)
        cubic = bernstein(row - cell) @ HERMITE_TO_BERNSTEIN
        place = np.einsum("nk,nkx->nx", cubic, hermite)
        rho, cos, swell = _on_unit_sphere(self.shape, place, surface)
        return np.arctan2(rho / swell, cos)


def best_meridians(
    shape: TruncatedEllipsoid,
    elements: tuple[int, int, int],
    graded: bool,
    apex: Apex = "collapsed",
    hole: float = 0.0,
) -> Meridians:
    """Choose the meridians of a template.

    Parameters
    ----------
    shape : TruncatedEllipsoid
        Of the template.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the depth across the wall may be graded; otherwise it is linear. Around a hole, the
        grading changes from row to row.
    apex : {"collapsed", "hole"}
        In poles or a hole.
    hole : float
        Radius of the apical hole on the endocardium, mm.

    Returns
    -------
    Meridians
        They begin at the poles, or at the rim of the hole, and end on the basal plane.

    Raises
    ------
    InputError
        If the hole is too wide.
    """
    radial, _, rows = elements
    even = even_rows(shape, rows, apex, hole)
    start = np.stack([_on_ellipsoid(shape, polar, depth) for depth, polar in enumerate(even)])
    free = _free(start, apex)
    size = float(np.linalg.norm(np.diff(start[:, :, 0], axis=1), axis=-1).mean())
    count, by_row = int(free.sum()), apex == "hole"
    nearness = NEARNESS * max(1.0, rows / USUAL_ROWS) ** 2
    slopes = (2 + 2 * (rows + 1) * by_row) * graded

    def curves(p: Array) -> Array:
        out = np.broadcast_to(start, (*p.shape[:-1], *start.shape)).copy()
        out[..., free] += size * p[..., :count]
        return out

    def gradings(p: Array) -> Array:
        """Slopes of the depth at endo- and epicardium at the rows' ends."""
        out = np.ones((*p.shape[:-1], rows + 1, 2))
        if graded:
            out += p[..., None, count : count + 2]
        if graded and by_row:
            out += p[..., count + 2 :].reshape(out.shape)
        return out

    def misfit(p: Array) -> Array:
        curve, grading = curves(p), gradings(p)
        lengths = np.linalg.norm(np.diff(curve[..., 0, :], axis=-2), axis=-1) / size
        parts = [
            *_elements(curve, grading, radial),
            nearness * _off_ellipsoid(shape, curve),
            EVENNESS * _root_mean(np.diff(lengths, axis=-1), 2),
            STEADINESS * _root_mean(np.diff(grading, axis=-2), 2),
        ]
        return np.concatenate([part.reshape(*p.shape[:-1], -1) for part in parts], axis=-1)

    def slope(p: Array) -> Array:
        return np.asarray((misfit(p + STEP * np.eye(len(p))) - misfit(p)).T / STEP)

    best = least_squares(
        misfit, np.zeros(count + slopes), slope, xtol=ENOUGH, ftol=ENOUGH, gtol=ENOUGH
    ).x
    value = gradings(best)
    changing = RowGrading(value, np.gradient(value, axis=0))
    same = (float(value[0, 0]), float(value[0, 1]))
    return Meridians(shape, curves(best), (changing if by_row else same) if graded else LINEAR)


def _on_ellipsoid(shape: TruncatedEllipsoid, polar: Array, depth: int) -> Array:
    """Values and slopes (rows + 1, 2, 2) of the meridian at evenly spaced polar angles."""
    radius, axis = _size(shape, depth)
    width, widening = shape.profile(polar, depth)
    value = np.stack([radius * width, -shape.cut * shape.axis - axis * np.cos(polar)], -1)
    slope = np.stack([radius * widening, axis * np.sin(polar)], -1)
    return np.stack([value, (polar[1] - polar[0]) * slope], 1)


def _free(start: Array, apex: Apex) -> NDArray[np.bool_]:
    """Which of the degrees of freedom may move: not poles, rims and base, nor slopes of poles."""
    free = np.ones(start.shape, dtype=bool)
    free[:, -1, 0] = False
    if apex == "hole":
        free[0, 0, 0] = False
    else:
        free[:, 0, 0] = free[:, 0, 1, 1] = False
    return free


def _at(curve: Array, basis: Array) -> Array:
    """Radius and height (..., rows, q, 2) of meridians at points of each row."""
    hermite = np.concatenate([curve[..., :-1, :, :], curve[..., 1:, :, :]], axis=-2)
    return np.asarray(basis @ HERMITE_TO_BERNSTEIN @ hermite)


def _root_mean(values: Array, axes: int) -> Array:
    """Values over the root of their number, so that their squares add up to the mean one's."""
    return np.asarray(values / np.sqrt(np.prod(values.shape[-axes:])))


def _off_ellipsoid(shape: TruncatedEllipsoid, curve: Array) -> Array:
    """Distances (..., surface, rows, q) from the ellipsoid, to first order, over its radius."""
    t, weights = gauss(SHAPE_GAUSS)
    place = _at(curve, bernstein(t))
    out = []
    for depth in (0, 1):
        radius, axis = _size(shape, depth)
        taper = shape.taper[depth]
        rho, cos, swell = _on_unit_sphere(shape, place[..., depth, :, :, :], depth)
        # Zero on the surface, which is smooth across the poles in these terms.
        level = (rho / swell) ** 2 + cos**2 - 1
        by_radius = 2 * rho / swell**2 / radius
        by_height = 2 * (cos - taper * rho**2 / swell**3) / axis
        out.append(level / np.hypot(by_radius, by_height) / radius)
    return _root_mean(np.stack(out, -3) * np.sqrt(weights), 3)


def _on_unit_sphere(
    shape: TruncatedEllipsoid, place: Array, depth: int
) -> tuple[Array, Array, Array]:
    """Places (..., 2) over the semi-axes, the second one downwards, and what the taper does."""
    radius, axis = _size(shape, depth)
    cos = -(place[..., 1] + shape.cut * shape.axis) / axis
    return place[..., 0] / radius, cos, 1 + shape.taper[depth] * cos


def _size(shape: TruncatedEllipsoid, depth: int) -> tuple[float, float]:
    """Mean radius at the equator and semi-axis along z of a surface, mm."""
    section, axis, _ = shape.semi_axes(depth)
    return float(np.sqrt(np.linalg.det(section))), axis


def _elements(curve: Array, grading: Array, radial: int) -> tuple[Array, Array]:
    """What is wrong with elements: spread of log det J, and cosines to the radial line."""
    t, weights = gauss(QUALITY_GAUSS)
    place, tangent = (_at(curve, basis(t)) for basis in (bernstein, bernstein_derivative))
    depth, stretch = _depths(grading, radial, t)  # ..., layer, row, across, along
    inner, outer = (place[..., surface, None, :, None, :, :] for surface in (0, 1))
    start, end = (tangent[..., surface, None, :, None, :, :] for surface in (0, 1))
    cross, share = outer - inner, depth[..., None]
    radius = (inner + share * cross)[..., 0]
    along = start + share * (end - start)
    det = stretch * radius * (cross[..., 0] * along[..., 1] - cross[..., 1] * along[..., 0])
    most = np.abs(det).max(axis=(-1, -2, -3, -4), keepdims=True)
    log_det = np.log(np.maximum(det, FOLDED * most))
    share_of_point = np.outer(weights, weights)
    mean = np.sum(log_det * share_of_point, axis=(-1, -2), keepdims=True)
    spread = (log_det - mean) * np.sqrt(share_of_point)
    variance = np.sum(spread**2, axis=(-1, -2), keepdims=True)
    spread = spread / np.sqrt(1 + variance / TOLERABLE)
    lengths = np.linalg.norm(cross, axis=-1) * np.linalg.norm(along, axis=-1)
    cosine = np.sum(cross * along, axis=-1) / np.maximum(lengths, np.finfo(float).tiny)
    slant = cosine / np.sqrt(np.maximum(1 - cosine**2, FOLDED))
    return _root_mean(spread, 4) * QUALITY_GAUSS, SQUARENESS * _root_mean(slant, 4)


def _depths(grading: Array, radial: int, t: Array) -> tuple[Array, Array]:
    """Depth and its slope (..., layer, row, across, along) at points t of layers and rows."""
    change = np.gradient(grading, axis=-2)
    ends = _at(np.stack([grading, change], -2), bernstein(t))
    xi = (np.arange(radial)[:, None] + t) / radial
    out = []
    for basis in (bernstein, bernstein_derivative):
        cubic = (basis(xi.ravel()) @ HERMITE_TO_BERNSTEIN).reshape(*xi.shape, 4)
        by_slopes = np.einsum("lsk,...rpk->...lrsp", cubic[..., [1, 3]], ends)
        out.append(by_slopes + cubic[:, None, :, None, 2])
    return out[0], out[1]
