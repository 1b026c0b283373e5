"""A left ventricle in closed form: two oval, bent ellipsoids cut by a base.

Heart frame, mm: z runs up the long axis from apex to base, z = 0 is the widest level. All surfaces
are star-shaped about the long axis; the bend shears each level sideways and keeps volumes.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from heartgen.samples.region import Polar, last_inside
from heartgen.samples.surface_patch import Patch

Array = NDArray[np.float64]

WAVE_CORE = 5.0
"""Distance from the long axis within which the waves of a base fade out, mm (inside the cavity)."""


class Lobe(NamedTuple):
    """One circumferential harmonic: ``size * cos(order * (angle - at))``.

    Attributes
    ----------
    order : int
        Periods around the heart.
    size : float
        Amplitude, in the unit of what it is added to.
    at : float
        Where the cosine is 1, rad.
    """

    order: int
    size: float
    at: float


@dataclass(frozen=True)
class Ellipsoid:
    """One surface of the wall before it is bent and cut.

    Attributes
    ----------
    radius : float
        Mean radius at the widest level, mm.
    length : float
        Distance from the widest level to the apex, mm.
    center : (2,) tuple of float
        Offset of its axis from the long axis, mm.
    lobes : tuple of Lobe
        Deviation from a round section, as a share of the radius; fades out at the apex.
    """

    radius: float
    length: float
    center: tuple[float, float] = (0.0, 0.0)
    lobes: tuple[Lobe, ...] = ()


@dataclass(frozen=True)
class LvShape:
    """A left ventricle in the heart frame.

    Attributes
    ----------
    endo, epi : Ellipsoid
        Endocardium and epicardium.
    base_height : float
        Height of the base on the long axis, mm.
    base_slope : (2,) tuple of float
        Rise of the base along x and y, mm per mm.
    base_waves : tuple of Lobe
        Ups and downs of the rim around the long axis, mm.
    bend : (2,) tuple of float
        Sideways shift of the endocardial apex, mm; grows with the square of the depth.
    """

    endo: Ellipsoid
    epi: Ellipsoid
    base_height: float
    base_slope: tuple[float, float] = (0.0, 0.0)
    base_waves: tuple[Lobe, ...] = ()
    bend: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def patches(self) -> dict[str, Patch]:
        """The external surface in three pieces: ``"endo"``, ``"epi"`` and ``"base"``."""
        inner, outer = base_rim(self, self.endo), base_rim(self, self.epi)
        return {
            "endo": _wall_patch(self, self.endo),
            "epi": _wall_patch(self, self.epi),
            "base": Patch(partial(_on_base, self), Polar(outer, inner)),
        }

    @property
    def surfaces(self) -> dict[str, tuple[Patch, ...]]:
        """The same, as pieces of each surface."""
        return {name: (patch,) for name, patch in self.patches.items()}

    @property
    def apex(self) -> Array:
        """Pole of the endocardium, (3,), mm."""
        return np.asarray(self.patches["endo"].point(np.zeros((1, 2)))[0])

    @property
    def basal_plane(self) -> tuple[Array, Array]:
        """Point (3,), mm, on the long axis and normal (3,) of the plane of the base."""
        upward = np.array([-self.base_slope[0], -self.base_slope[1], 1.0])
        return np.array([0.0, 0.0, self.base_height]), upward / np.linalg.norm(upward)

    @property
    def rims(self) -> tuple[Array, ...]:
        """Rims of the endocardium and the epicardium, each (n, 3), mm."""
        return tuple(rim.tree.data for rim in self.patches["base"].boundary)

    @cached_property
    def cavity_volume(self) -> float:
        """Volume between the endocardium and the base, mm^3."""
        lid = Patch(partial(_on_base, self), Polar(base_rim(self, self.endo)))
        return lid.column_volume - self.patches["endo"].column_volume

    @cached_property
    def wall_volume(self) -> float:
        """Volume of the myocardium, mm^3."""
        p = self.patches
        return p["base"].column_volume + p["endo"].column_volume - p["epi"].column_volume


def straighten(shape: LvShape, points: Array) -> Array:
    """Undo the bend: heart frame (n, 3), mm, to the frame of the straight long axis (n, 3), mm.

    Parameters
    ----------
    shape : LvShape
        A left ventricle.
    points : (n, 3) float64
        mm, heart frame.
    """
    return _bent(shape, points, -1)


def below_base(shape: LvShape, straight: Array) -> NDArray[np.bool_]:
    """Which straightened points (n, 3), mm, lie on the ventricular side of the base, (n,).

    Parameters
    ----------
    shape : LvShape
        A left ventricle.
    straight : (n, 3) float64
        mm, frame of the straight long axis.
    """
    return np.asarray(straight[:, 2] < _base_level(shape, straight[:, :2]))


def depth(surface: Ellipsoid, straight: Array) -> tuple[Array, Array, Array]:
    """Place straightened points against one surface of the wall.

    Parameters
    ----------
    surface : Ellipsoid
        Endocardium or epicardium.
    straight : (n, 3) float64, mm
        Points in the frame of the straight long axis.

    Returns
    -------
    depth : (n,) float64, mm
        Horizontal distance inwards from the surface; negative outside.
    polar : (n,) float64, rad
        Angle from the apex (0) over the widest level (pi / 2); 0 or pi beyond the ends.
    angle : (n,) float64, rad
        Circumferential angle.
    """
    x, y = (straight[:, :2] - surface.center).T
    polar = np.arccos(np.clip(-straight[:, 2] / surface.length, -1, 1))
    angle = np.arctan2(y, x)
    return _section(surface, polar, angle) - np.hypot(x, y), polar, angle


def wall_point(surface: Ellipsoid, plane: Array) -> Array:
    """Points (n, 3), mm, straight frame, at plane coordinates (n, 2) = polar * (cos, sin) angle.

    Parameters
    ----------
    surface : Ellipsoid
        Endocardium or epicardium.
    plane : (n, 2) float64
        Angle from the apex, rad, times the direction around.
    """
    polar, angle = np.hypot(*plane.T), np.arctan2(plane[:, 1], plane[:, 0])
    radius = _section(surface, polar, angle)
    x, y = surface.center
    return np.column_stack(
        [
            x + radius * np.cos(angle),
            y + radius * np.sin(angle),
            -surface.length * np.cos(polar),
        ]
    )


def base_rim(shape: LvShape, surface: Ellipsoid) -> CubicSpline[np.float64]:
    """Rim where a surface meets the base: angle about the long axis to distance from it, mm.

    Parameters
    ----------
    shape : LvShape
        A left ventricle.
    surface : Ellipsoid
        Its endocardium or epicardium.
    """

    def inside(radius: Array, angle: Array) -> NDArray[np.bool_]:
        return depth(surface, _straight_base(shape, radius[:, None] * _unit(angle)))[0] > 0

    return last_inside(inside, 2 * surface.radius)


def _wall_patch(shape: LvShape, surface: Ellipsoid) -> Patch:
    """One surface of the wall up to its rim, over the plane of polar * (cos, sin) angle."""

    def under(polar: Array, angle: Array) -> NDArray[np.bool_]:
        return below_base(shape, wall_point(surface, polar[:, None] * _unit(angle)))

    return Patch(partial(_on_wall, shape, surface), Polar(last_inside(under, np.pi)))


def _section(surface: Ellipsoid, polar: Array, angle: Array) -> Array:
    """Radius (n,), mm, of a surface about its own axis; 0 at its ends."""
    sine = np.sin(polar)
    return np.asarray(surface.radius * sine * (1 + sine**2 * _sum(surface.lobes, angle)))


def _base_level(shape: LvShape, xy: Array) -> Array:
    """Height z (n,), mm, of the base over straightened (x, y), (n, 2), mm."""
    square = np.einsum("nx,nx->n", xy, xy)
    waves = _sum(shape.base_waves, np.arctan2(xy[:, 1], xy[:, 0]))
    return np.asarray(
        shape.base_height
        + xy @ np.asarray(shape.base_slope)
        + waves * square / (square + WAVE_CORE**2)
    )


def _on_wall(shape: LvShape, surface: Ellipsoid, plane: Array) -> Array:
    """Points (n, 3), mm, heart frame, of a surface of the wall at plane coordinates (n, 2)."""
    return _bent(shape, wall_point(surface, plane), 1)


def _straight_base(shape: LvShape, xy: Array) -> Array:
    """Points (n, 3), mm, straight frame, of the base over straightened (x, y), (n, 2), mm."""
    return np.column_stack([xy, _base_level(shape, xy)])


def _on_base(shape: LvShape, xy: Array) -> Array:
    """Points (n, 3), mm, heart frame, of the base over straightened (x, y), (n, 2), mm."""
    return _bent(shape, _straight_base(shape, xy), 1)


def _bent(shape: LvShape, points: Array, sign: int) -> Array:
    """Shift points (n, 3) sideways by the bend at their level (sign 1) or back (sign -1)."""
    reach = (shape.base_height - points[:, 2]) / (shape.base_height + shape.endo.length)
    moved = points.copy()
    moved[:, :2] += sign * np.square(reach)[:, None] * np.asarray(shape.bend)
    return moved


def _sum(lobes: tuple[Lobe, ...], angle: Array) -> Array:
    """Sum (n,) of circumferential harmonics."""
    total = np.zeros_like(angle)
    for lobe in lobes:
        total += lobe.size * np.cos(lobe.order * (angle - lobe.at))
    return total


def _unit(angle: Array) -> Array:
    """Directions (n, 2) of angles (n,), rad."""
    return np.column_stack([np.cos(angle), np.sin(angle)])
