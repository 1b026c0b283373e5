"""A smooth surface patch over a polar region of the plane: its area, quadrature and distance.

Everything is worked out from the closed-form map itself, so it is exact to far below a micrometre
and no triangulation stands between a phantom and its truth.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PchipInterpolator
from scipy.spatial import KDTree

Array = NDArray[np.float64]

STEP = 1e-4
"""Step of the finite differences in the plane (rad or mm): truncation and round-off near 1e-9."""

RADIAL_NODES = 64
"""Gauss-Legendre nodes along each ray of the product rule: area of our patches to 1e-8."""

ANGULAR_NODES = 256
"""Nodes of the periodic trapezoidal rule around the region (spectral for smooth patches)."""

DENSITY_CELLS = 256
"""Cells along a ray in which the area is tabulated to spread samples evenly."""

GOLDEN = (1 + 5**0.5) / 2
"""The golden ratio: successive samples turn by 1/GOLDEN turns, as seeds in a sunflower."""

SEED_AREA = 0.25
"""Area per start point of the closest-point search, mm^2 (a start lies within 0.4 mm)."""

NEWTON_STEPS = 8
"""Upper limit of Newton steps to a closest point; 3 or 4 reach round-off away from focal points."""

LONGEST_STEP = 1.0
"""Longest Newton step on the surface, mm, a little more than the distance to the start point."""

FLAT = 1e-3
"""Determinant of the Hessian, against the metric's, below which its curvature is not trusted."""

CONVERGED = 1e-6
"""Newton step after which a closest point counts as found, mm (distances are second order)."""

CURVE_KNOTS = 512
"""Knots of the periodic cubic spline of a boundary curve: within 1e-6 mm of the curve."""

CURVE_STEP = 2 * np.pi / CURVE_KNOTS
"""Longest Newton step along a boundary curve, rad: one knot."""

LEAF = 32
"""Points in a leaf of the search trees; fastest for points far from a small patch."""

DOT = "nx,nx->n"
"""Scalar product per row: n point, x space."""


class Curve(NamedTuple):
    """Closed curve: spline over the angle to points, mm, and a search tree of its knots."""

    spline: CubicSpline[np.float64]
    tree: KDTree


@dataclass(frozen=True)
class Patch:
    """Surface over the region ``inner(angle) <= radius <= outer(angle)`` of a plane.

    Attributes
    ----------
    point : callable
        Plane coordinates (n, 2) to points (n, 3), mm; smooth on and a little beyond the region.
    outer : callable
        Any angle (n,), rad, to the radius (n,) of the outer boundary.
    inner : callable or None
        Same for the boundary of a hole around the origin; None if there is no hole.
    """

    point: Callable[[Array], Array]
    outer: Callable[[Array], Array]
    inner: Callable[[Array], Array] | None = None

    @cached_property
    def area(self) -> float:
        """Area of the patch, mm^2."""
        plane, weights = _product_rule(self)
        return float(weights @ np.linalg.norm(_normal(self, plane), axis=1))

    @cached_property
    def column_volume(self) -> float:
        """Integral of z over the shadow of the patch on the plane z = 0, mm^3, positive upward."""
        plane, weights = _product_rule(self)
        return float(weights @ (self.point(plane)[:, 2] * _normal(self, plane)[:, 2]))

    @cached_property
    def seeds(self) -> tuple[KDTree, Array]:
        """Search tree of evenly spread points and their plane coordinates (n, 2)."""
        plane, _ = _spread(self, int(np.ceil(self.area / SEED_AREA)))
        return KDTree(self.point(plane), leafsize=LEAF), plane

    @cached_property
    def boundary(self) -> tuple[Curve, ...]:
        """The closed curves that bound the patch."""
        angle = np.linspace(0, 2 * np.pi, CURVE_KNOTS + 1)
        curves = []
        for edge in (self.inner, self.outer):
            if edge is not None:
                knots = self.point(_polar(edge(angle), angle))
                knots[-1] = knots[0]
                spline = CubicSpline(angle, knots, bc_type="periodic")
                curves.append(Curve(spline, KDTree(knots[:-1], leafsize=LEAF)))
        return tuple(curves)


def quadrature(patch: Patch, n: int) -> tuple[Array, Array]:
    """Spread samples evenly over a patch.

    Parameters
    ----------
    patch : Patch
    n : int
        Number of samples, at least 1.

    Returns
    -------
    points : (n, 3) float64, mm
    weights : (n,) float64, mm^2
        Nearly equal; their sum is the area of the patch.
    """
    plane, weights = _spread(patch, n)
    return patch.point(plane), weights * (patch.area / weights.sum())


def distance(patch: Patch, points: Array) -> Array:
    """Distance from points to a patch: Newton from the nearest sample, and to its boundary curves.

    Every candidate lies on the patch, so the least of them is never below the true distance.

    Parameters
    ----------
    patch : Patch
    points : (n, 3) float64, mm

    Returns
    -------
    (n,) float64, mm
        Not negative.
    """
    tree, plane = patch.seeds
    best, start = tree.query(points)
    foot = _closest(patch, points, plane[start])
    reached = np.linalg.norm(patch.point(foot) - points, axis=1)
    best = np.minimum(best, np.where(_within(patch, foot), reached, np.inf))
    for curve in patch.boundary:
        best = np.minimum(best, _curve_distance(curve, points))
    return np.asarray(best)


def _product_rule(patch: Patch) -> tuple[Array, Array]:
    """Nodes (n, 2) and weights (n,) in the plane: Gauss along rays, trapezoidal around."""
    node, gauss = np.polynomial.legendre.leggauss(RADIAL_NODES)
    angle = np.linspace(0, 2 * np.pi, ANGULAR_NODES, endpoint=False)
    q, angle = (a.ravel() for a in np.meshgrid((node + 1) / 2, angle, indexing="ij"))
    radius, width = _ray(patch, q, angle)
    weights = np.repeat(gauss / 2, ANGULAR_NODES) * (2 * np.pi / ANGULAR_NODES)
    return _polar(radius, angle), weights * radius * width


def _spread(patch: Patch, n: int) -> tuple[Array, Array]:
    """Plane coordinates (n, 2) of samples even in area, and their areas (n,) in space, mm^2."""
    middle = (np.arange(DENSITY_CELLS) + 1 / 2) / DENSITY_CELLS
    around = np.linspace(0, 2 * np.pi, DENSITY_CELLS, endpoint=False)
    q, angle = (a.ravel() for a in np.meshgrid(middle, around, indexing="ij"))
    density = _density(patch, q, angle).reshape(DENSITY_CELLS, -1).sum(axis=1)
    share = np.concatenate([[0.0], np.cumsum(density)]) / density.sum()
    # q^2, not q, is smooth in the share of area at a pole, where area grows as radius squared.
    square = PchipInterpolator(share, np.linspace(0, 1, DENSITY_CELLS + 1) ** 2)
    index = np.arange(n)
    u = (index + 1 / 2) / n
    q = np.sqrt(square(u))
    angle = 2 * np.pi * np.mod(index / GOLDEN, 1)
    slope = square.derivative()(u) / (2 * q)
    radius, _ = _ray(patch, q, angle)
    return _polar(radius, angle), _density(patch, q, angle) * slope * (2 * np.pi / n)


def _density(patch: Patch, q: Array, angle: Array) -> Array:
    """Area in space per unit of (q, angle), mm^2; q runs from 0 to 1 along each ray."""
    radius, width = _ray(patch, q, angle)
    stretch = np.linalg.norm(_normal(patch, _polar(radius, angle)), axis=1)
    return np.asarray(radius * width * stretch)


def _ray(patch: Patch, q: Array, angle: Array) -> tuple[Array, Array]:
    """Radius at fraction q of each ray through the region, and length of that ray, both (n,)."""
    inner = np.zeros_like(angle) if patch.inner is None else patch.inner(angle)
    width = patch.outer(angle) - inner
    return inner + q * width, width


def _polar(radius: Array, angle: Array) -> Array:
    """Plane coordinates (n, 2) of polar ones."""
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def _within(patch: Patch, plane: Array) -> NDArray[np.bool_]:
    """Which plane coordinates (n, 2) lie in the region of the patch, (n,)."""
    angle = np.arctan2(plane[:, 1], plane[:, 0])
    radius = np.linalg.norm(plane, axis=1)
    above = True if patch.inner is None else radius >= patch.inner(angle)
    return np.asarray(above & (radius <= patch.outer(angle)))


def _normal(patch: Patch, plane: Array) -> Array:
    """Cross product of the two tangents at plane coordinates (n, 2): (n, 3), length = area."""
    ds, dt = np.eye(2) * STEP
    along_s = (patch.point(plane + ds) - patch.point(plane - ds)) / (2 * STEP)
    along_t = (patch.point(plane + dt) - patch.point(plane - dt)) / (2 * STEP)
    return np.cross(along_s, along_t)


def _closest(patch: Patch, points: Array, start: Array) -> Array:
    """Plane coordinates (n, 2) at which |point(plane) - points|^2 is stationary, near a start."""
    foot = start.copy()
    active = np.arange(len(points))
    for _ in range(NEWTON_STEPS):
        step, length = _newton_step(patch, points[active], foot[active])
        foot[active] += step
        active = active[length > CONVERGED]
        if not active.size:
            break
    return foot


def _newton_step(patch: Patch, points: Array, plane: Array) -> tuple[Array, Array]:
    """Newton step (n, 2) in the plane and its length (n,) on the surface, mm.

    Gauss-Newton where the Hessian is not safely positive (near focal points).
    """
    derivatives = _derivatives(patch, plane)
    gap = derivatives[0] - points
    ps, pt, pss, ptt, pst = derivatives[1:]
    g_ss, g_tt, g_st = np.einsum(DOT, ps, ps), np.einsum(DOT, pt, pt), np.einsum(DOT, ps, pt)
    h_ss = g_ss + np.einsum(DOT, gap, pss)
    h_tt = g_tt + np.einsum(DOT, gap, ptt)
    h_st = g_st + np.einsum(DOT, gap, pst)
    safe = (h_ss > 0) & (h_ss * h_tt - h_st**2 > FLAT * (g_ss * g_tt - g_st**2))
    h_ss, h_tt, h_st = (np.where(safe, h, g) for h, g in ((h_ss, g_ss), (h_tt, g_tt), (h_st, g_st)))
    b_s, b_t = np.einsum(DOT, gap, ps), np.einsum(DOT, gap, pt)
    determinant = h_ss * h_tt - h_st**2
    step_s = (h_st * b_t - h_tt * b_s) / determinant
    step_t = (h_st * b_s - h_ss * b_t) / determinant
    length = np.sqrt(g_ss * step_s**2 + 2 * g_st * step_s * step_t + g_tt * step_t**2)
    limit = LONGEST_STEP / np.maximum(length, LONGEST_STEP)
    return np.column_stack([step_s, step_t]) * limit[:, None], length * limit


def _derivatives(patch: Patch, plane: Array) -> tuple[Array, ...]:
    """Point, two first and three second derivatives (ss, tt, st) by central differences."""
    ds, dt = np.eye(2) * STEP

    def around(direction: Array) -> Iterator[Array]:
        yield patch.point(plane + direction)
        yield patch.point(plane - direction)

    p = patch.point(plane)
    (s1, s0), (t1, t0) = around(ds), around(dt)
    (a1, a0), (b1, b0) = around(ds + dt), around(ds - dt)
    first = (s1 - s0) / (2 * STEP), (t1 - t0) / (2 * STEP)
    second = (s1 - 2 * p + s0) / STEP**2, (t1 - 2 * p + t0) / STEP**2
    mixed = (a1 + a0 - b1 - b0) / (2 * STEP) ** 2
    return p, *first, *second, mixed


def _curve_distance(curve: Curve, points: Array) -> Array:
    """Distance (n,), mm, to a closed curve: Newton in the angle from the nearest knot."""
    best, nearest = curve.tree.query(points)
    angle = curve.spline.x[nearest]
    for _ in range(NEWTON_STEPS):
        gap = curve.spline(angle) - points
        tangent, curvature = curve.spline(angle, 1), curve.spline(angle, 2)
        metric = np.einsum(DOT, tangent, tangent)
        hessian = metric + np.einsum(DOT, gap, curvature)
        step = -np.einsum(DOT, gap, tangent) / np.where(hessian > FLAT * metric, hessian, metric)
        angle = angle + np.clip(step, -CURVE_STEP, CURVE_STEP)
    return np.asarray(np.minimum(best, np.linalg.norm(curve.spline(angle) - points, axis=1)))
