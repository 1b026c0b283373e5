"""Two ventricles in closed form: two ellipsoids, three walls and a flat base.

Heart frame, mm: z runs up the long axis of the left ventricle from apex to base, z = 0 is its
widest level; the right ventricle lies towards -x. Every wall lies at a constant distance from an
ellipsoid, so that every thickness is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly

from heartgen.samples.nearest import Curve, Surface
from heartgen.samples.outline import Gap, Piece, cut_along_base, cut_out, edge_of
from heartgen.samples.plate import Plate
from heartgen.samples.solid import Solid, distance, level, lowest_point, shell_point, within
from heartgen.samples.surface_patch import Patch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class BivShape:
    """A left and a right ventricle in the heart frame.

    The left pool is the ellipsoid ``lv``. The right pool is what the ellipsoid ``rv`` has beyond
    the septum. The myocardium surrounds the first by ``lv_wall`` and the second by ``rv_wall``;
    the grooves of the epicardium and the insertions are where these walls meet.

    Attributes
    ----------
    lv, rv : Solid
        What the two pools are cut from.
    lv_wall, septum, rv_wall : float
        Thicknesses, mm.
    base_height : float
        Height of the base on the long axis, mm.
    base_slope : (2,) tuple of float
        Rise of the base along x and y, mm per mm.
    """

    lv: Solid
    rv: Solid
    lv_wall: float
    septum: float
    rv_wall: float
    base_height: float
    base_slope: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def walls(self) -> dict[str, Piece]:
        """Smooth pieces: ``endo``, both sides of the right pool, both parts of the epicardium."""
        below = partial(below_base, self)
        lv, rv = self.lv, self.rv
        return {
            "endo": cut_along_base(partial(shell_point, lv, 0.0), below),
            "septum": cut_out(
                partial(shell_point, lv, self.septum), below, partial(_inside_ellipsoid, rv)
            ),
            "free": cut_out(*_free_wall(self)),
            "epi_lv": cut_out(
                partial(shell_point, lv, self.lv_wall), below, partial(_gap, rv, self.rv_wall)
            ),
            "epi_rv": cut_out(
                partial(shell_point, rv, self.rv_wall), below, partial(_gap, lv, self.lv_wall)
            ),
        }

    @cached_property
    def surfaces(self) -> dict[str, tuple[Patch | Plate, ...]]:
        """External surface of the wall: ``lv_endo``, ``rv_endo``, ``epi`` and ``base``."""
        w = self.walls
        center, normal = self.basal_plane
        across = np.cross([0.0, 1.0, 0.0], normal)
        across /= np.linalg.norm(across)
        # Every closed surface has no net area vector: the base makes up for the curved pieces.
        net = sum(sign * w[name].patch.elements[1].sum(axis=0) for name, sign in _WALL)
        base = Plate(
            center,
            np.column_stack([across, np.cross(normal, across), normal]),
            partial(_across_wall, self),
            tuple(piece.rim for piece in w.values()),
            float(normal @ net),
        )
        return {
            "lv_endo": (w["endo"].patch,),
            "rv_endo": (w["septum"].patch, w["free"].patch),
            "epi": (w["epi_lv"].patch, w["epi_rv"].patch),
            "base": (base,),
        }

    @property
    def apex(self) -> Array:
        """Pole of the left endocardium, (3,), mm."""
        return lowest_point(self.lv, 0.0)

    @property
    def basal_plane(self) -> tuple[Array, Array]:
        """Where the long axis meets the base, (3,), mm, and the normal away from the apex, (3,)."""
        upward = np.array([-self.base_slope[0], -self.base_slope[1], 1.0])
        return np.array([0.0, 0.0, self.base_height]), upward / np.linalg.norm(upward)

    @property
    def rims(self) -> tuple[Array, ...]:
        """Rims of ``lv_endo``, ``rv_endo`` and ``epi``, each (n, 3), mm, closed in that order."""
        w = self.walls
        return (
            w["endo"].rim.tree.data,
            _joined(w["septum"].rim, w["free"].rim),
            _joined(w["epi_lv"].rim, w["epi_rv"].rim),
        )

    @cached_property
    def cavity_volume(self) -> float:
        """Volume of the left pool below the base, mm^3."""
        return _enclosed(self, (("endo", 1.0),))[0]

    @cached_property
    def right_volume(self) -> float:
        """Volume of the right pool below the base, mm^3."""
        return _enclosed(self, _RIGHT)[0]

    @cached_property
    def wall_volume(self) -> float:
        """Volume of the myocardium, mm^3."""
        return _enclosed(self, _WALL)[0]

    @cached_property
    def centroids(self) -> tuple[Array, Array]:
        """Centroids of the left and of the right pool, each (3,), mm."""
        return _enclosed(self, (("endo", 1.0),))[1], _enclosed(self, _RIGHT)[1]


_RIGHT = (("free", 1.0), ("septum", -1.0))
_WALL = (("epi_lv", 1.0), ("epi_rv", 1.0), ("endo", -1.0), ("free", -1.0), ("septum", 1.0))


def below_base(shape: BivShape, points: Array) -> Array:
    """Depth (n,), mm, of points (n, 3), mm, below the base.

    Parameters
    ----------
    shape : BivShape
        Both ventricles.
    points : (n, 3) float64
        mm, heart frame.
    """
    center, normal = shape.basal_plane
    return np.asarray((center - points) @ normal)


def in_wall(shape: BivShape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, heart frame, lie in the myocardium, (n,).

    Parameters
    ----------
    shape : BivShape
        Both ventricles.
    points : (n, 3) float64
        mm, heart frame.
    """
    wall = below_base(shape, points) > 0
    below = np.flatnonzero(wall)
    wall[below] = _across_wall(shape, points[below])
    return wall


def right_apex(shape: BivShape) -> Array:
    """Lowest point (3,), mm, of the right pool: of the free wall, or where it meets the septum.

    Parameters
    ----------
    shape : BivShape
        Both ventricles.
    """
    bottom = lowest_point(shape.rv, 0.0)
    if _gap(shape.lv, shape.septum, bottom[None])[0] > 0:
        return bottom
    points = edge_of(*_free_wall(shape))
    edge = CubicSpline(np.arange(len(points)), points)
    heights = _heights(edge)
    turns = np.append(heights.derivative().roots(extrapolate=False), heights.x)
    return np.asarray(edge(turns[np.argmin(heights(turns))]))


def crossings(edge: Curve, height: float) -> Array:
    """Points (n, 3), mm, at which a curve passes a height, mm.

    Parameters
    ----------
    edge : Curve
        The curve.
    height : float
        The z of the heart frame, mm.
    """
    return np.asarray(edge.spline(_heights(edge.spline).solve(height, extrapolate=False)))


def _heights(edge: CubicSpline[np.float64]) -> PPoly[np.float64]:
    """Height z, mm, along a curve."""
    return PPoly(edge.c[:, :, 2], edge.x)


def _free_wall(shape: BivShape) -> tuple[Surface, Gap, Gap]:
    """Endocardium of the right free wall: its surface, the base and the septum that cut it."""
    return (
        partial(shell_point, shape.rv, 0.0),
        partial(below_base, shape),
        partial(_gap, shape.lv, shape.septum),
    )


def _across_wall(shape: BivShape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, lie in the myocardium if it had no base, (n,)."""
    lv, rv = shape.lv, shape.rv
    wall = within(lv, shape.lv_wall, points) | within(rv, shape.rv_wall, points)
    left = level(lv, points) < 1
    right = (level(rv, points) < 1) & ~within(lv, shape.septum, points)
    return wall & ~left & ~right


def _gap(solid: Solid, offset: float, points: Array) -> Array:
    """Distance (n,), mm, from a parallel surface of an ellipsoid, outwards."""
    return distance(solid, points) - offset


def _inside_ellipsoid(solid: Solid, points: Array) -> Array:
    """Positive (n,) inside an ellipsoid."""
    return 1 - level(solid, points)


def _enclosed(shape: BivShape, pieces: tuple[tuple[str, float], ...]) -> tuple[float, Array]:
    """Volume, mm^3, and centroid (3,), mm, between signed pieces and the base.

    Divergence theorem from a point of the base, which then adds nothing itself.
    """
    center, _ = shape.basal_plane
    volume, moment = 0.0, np.zeros(3)
    for name, sign in pieces:
        points, inward = shape.walls[name].patch.elements
        flux = -sign * np.einsum("nx,nx->n", points - center, inward)
        volume += float(flux.sum()) / 3
        moment += flux @ (points - center) / 4
    return volume, center + moment / volume


def _joined(first: Curve, second: Curve) -> Array:
    """Knots (n, 3) of two arcs with common ends as one closed loop."""
    one, two = first.tree.data, second.tree.data
    near = np.linalg.norm(two[0] - one[-1]) < np.linalg.norm(two[-1] - one[-1])
    return np.concatenate([one[:-1], (two if near else two[::-1])[:-1]])
