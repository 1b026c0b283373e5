"""Closest points of smooth surfaces and curves, by Newton's method from a start nearby."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial import KDTree

Array = NDArray[np.float64]
Surface = Callable[[Array], Array]
"""Smooth map of plane coordinates (n, 2) to points (n, 3), mm."""

STEP = 1e-4
"""Step of the finite differences in the plane (rad or mm): truncation and round-off near 1e-9."""

NEWTON_STEPS = 8
"""Upper limit of Newton steps to a closest point; 3 or 4 reach round-off away from focal points."""

LONGEST_STEP = 1.0
"""Longest Newton step on the surface, mm, a little more than the distance to the start point."""

FLAT = 1e-3
"""Determinant of the Hessian, against the metric's, below which its curvature is not trusted."""

CONVERGED = 1e-6
"""Newton step after which a closest point counts as found, mm (distances are second order)."""

LEAF = 32
"""Points in a leaf of the search trees; fastest for points far from a small patch."""

DOT = "nx,nx->n"
"""Scalar product per row: n point, x space."""


class Curve(NamedTuple):
    """Smooth curve in space.

    Attributes
    ----------
    spline : CubicSpline
        Angle, rad, to points, mm; periodic if the curve is closed.
    tree : KDTree
        Search tree of its knots.
    closed : bool
        Whether it ends where it begins.
    """

    spline: CubicSpline[np.float64]
    tree: KDTree
    closed: bool


def make_curve(angle: Array, points: Array, closed: bool) -> Curve:
    """Curve through points (n, 3), mm, at rising angles (n,), rad; closed if first is last.

    Parameters
    ----------
    angle : (n,) float64
        Rising, rad.
    points : (n, 3) float64
        mm.
    closed : bool
        Whether the last point is the first.
    """
    if closed:
        points = np.concatenate([points[:-1], points[:1]])
    spline = CubicSpline(angle, points, bc_type="periodic" if closed else "not-a-knot")
    return Curve(spline, KDTree(points[:-1] if closed else points, leafsize=LEAF), closed)


def curve_distance(curve: Curve, points: Array) -> Array:
    """Distance (n,), mm, from points (n, 3) to a curve: Newton from the nearest knot.

    Parameters
    ----------
    curve : Curve
        In the frame of the points.
    points : (n, 3) float64
        mm.
    """
    best, nearest = curve.tree.query(points)
    knots = curve.spline.x
    first, last = (-np.inf, np.inf) if curve.closed else (knots[0], knots[-1])
    longest = np.diff(knots).max()
    angle = knots[nearest]
    for _ in range(NEWTON_STEPS):
        gap = curve.spline(angle) - points
        tangent, curvature = curve.spline(angle, 1), curve.spline(angle, 2)
        metric = np.einsum(DOT, tangent, tangent)
        hessian = metric + np.einsum(DOT, gap, curvature)
        step = -np.einsum(DOT, gap, tangent) / np.where(hessian > FLAT * metric, hessian, metric)
        angle = np.clip(angle + np.clip(step, -longest, longest), first, last)
    return np.asarray(np.minimum(best, np.linalg.norm(curve.spline(angle) - points, axis=1)))


def closest(surface: Surface, points: Array, start: Array) -> Array:
    """Find where the distance from points to a surface is stationary.

    Parameters
    ----------
    surface : callable
        Plane coordinates (n, 2) to points (n, 3), mm.
    points : (n, 3) float64, mm
        In the frame of the surface.
    start : (n, 2) float64
        Plane coordinates near the answer.

    Returns
    -------
    (n, 2) float64
        Plane coordinates, wherever on the surface's continuation they are.
    """
    foot = start.copy()
    active = np.arange(len(points))
    for _ in range(NEWTON_STEPS):
        step, length = _newton_step(surface, points[active], foot[active])
        foot[active] += step
        active = active[length > CONVERGED]
        if not active.size:
            break
    return foot


def normal(surface: Surface, plane: Array) -> Array:
    """Cross product of the two tangents at plane coordinates (n, 2): (n, 3), length = area.

    Parameters
    ----------
    surface : callable
        Plane coordinates (n, 2) to points (n, 3), mm.
    plane : (n, 2) float64
        Plane coordinates.
    """
    ds, dt = np.eye(2) * STEP
    along_s = (surface(plane + ds) - surface(plane - ds)) / (2 * STEP)
    along_t = (surface(plane + dt) - surface(plane - dt)) / (2 * STEP)
    return np.cross(along_s, along_t)


def _newton_step(surface: Surface, points: Array, plane: Array) -> tuple[Array, Array]:
    """Newton step (n, 2) in the plane and its length (n,) on the surface, mm.

    Gauss-Newton where the Hessian is not safely positive (near focal points).
    """
    derivatives = _derivatives(surface, plane)
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


def _derivatives(surface: Surface, plane: Array) -> tuple[Array, ...]:
    """Point, two first and three second derivatives (ss, tt, st) by central differences."""
    ds, dt = np.eye(2) * STEP

    def around(direction: Array) -> Iterator[Array]:
        yield surface(plane + direction)
        yield surface(plane - direction)

    p = surface(plane)
    (s1, s0), (t1, t0) = around(ds), around(dt)
    (a1, a0), (b1, b0) = around(ds + dt), around(ds - dt)
    first = (s1 - s0) / (2 * STEP), (t1 - t0) / (2 * STEP)
    second = (s1 - 2 * p + s0) / STEP**2, (t1 - 2 * p + t0) / STEP**2
    mixed = (a1 + a0 - b1 - b0) / (2 * STEP) ** 2
    return p, *first, *second, mixed
