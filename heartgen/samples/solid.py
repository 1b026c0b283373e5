"""An ellipsoid anywhere in space, its parallel surfaces, and exact distances outside of it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

NEWTON_STEPS = 30
"""Upper limit of Newton steps to a distance; 5 to 8 reach round-off."""

CONVERGED = 1e-13
"""Relative Newton step after which the multiplier of a distance counts as found."""


@dataclass(frozen=True)
class Solid:
    """Ellipsoid with its own axes x, y, z; parallel surfaces lie at a constant distance from it.

    Attributes
    ----------
    semi : (3,) tuple of float
        Semi-axes, mm.
    center : (3,) tuple of float
        Center, mm.
    lean : float
        Turn about y, rad: its own z tips towards x.
    skew : float
        Turn about z after that, rad: x tips towards y.
    """

    semi: Triple
    center: Triple = (0.0, 0.0, 0.0)
    lean: float = 0.0
    skew: float = 0.0

    @cached_property
    def axes(self) -> Array:
        """Own axes as columns, (3, 3)."""
        return np.asarray(Rotation.from_euler("yz", [self.lean, self.skew]).as_matrix())

    def own(self, points: Array) -> Array:
        """Coordinates (n, 3), mm, along the own axes, from the center.

        Parameters
        ----------
        points : (n, 3) float64
            mm, heart frame.
        """
        return np.asarray((points - np.asarray(self.center)) @ self.axes)


def level(solid: Solid, points: Array) -> Array:
    """Distance from the center, (n,), as a share of the surface's in that direction.

    Parameters
    ----------
    solid : Solid
        The ellipsoid.
    points : (n, 3) float64
        mm, heart frame.
    """
    return np.asarray(np.linalg.norm(solid.own(points) / np.asarray(solid.semi), axis=1))


def distance(solid: Solid, points: Array) -> Array:
    """Distance from points to an ellipsoid, exact to round-off; 0 inside.

    The closest point solves one scalar equation, convex and falling to the right of its start:
    Newton's method cannot miss (Eberly, Distance from a point to an ellipsoid, 2013).

    Parameters
    ----------
    solid : Solid
        The ellipsoid.
    points : (n, 3) float64, mm
        In the heart frame.

    Returns
    -------
    (n,) float64, mm
    """
    semi = np.asarray(solid.semi)
    own = solid.own(points)
    found = np.zeros(len(points))
    outside = np.flatnonzero(np.sum((own / semi) ** 2, axis=1) > 1)
    y = own[outside]
    product = (semi * y) ** 2
    t = np.maximum(np.sqrt(product.sum(axis=1)) - semi.max() ** 2, 0.0)
    for _ in range(NEWTON_STEPS):
        share = product / (t[:, None] + semi**2) ** 2
        step = (share.sum(axis=1) - 1) / (2 * np.sum(share / (t[:, None] + semi**2), axis=1))
        t += step
        if np.all(np.abs(step) <= CONVERGED * (t + semi.max() ** 2)):
            break
    found[outside] = t * np.linalg.norm(y / (t[:, None] + semi**2), axis=1)
    return found


def within(solid: Solid, offset: float, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, lie closer than the offset, mm, to an ellipsoid or inside it, (n,).

    The level bounds the distance from both sides; only points between the bounds need it exactly.

    Parameters
    ----------
    solid : Solid
        The ellipsoid.
    offset : float
        mm, outwards.
    points : (n, 3) float64
        mm, heart frame.
    """
    excess = level(solid, points) - 1
    inside = excess * max(solid.semi) < offset
    open_question = np.flatnonzero(~inside & (excess * min(solid.semi) < offset))
    inside[open_question] = distance(solid, points[open_question]) < offset
    return np.asarray(inside)


def shell_point(solid: Solid, offset: float, plane: Array) -> Array:
    """Points (n, 3), mm, of the surface parallel to an ellipsoid.

    Parameters
    ----------
    solid : Solid
        The ellipsoid.
    offset : float, mm
        Distance outwards from the ellipsoid.
    plane : (n, 2) float64, rad
        Angle from the lower pole of the ellipsoid's unit sphere, times the direction (x, y).
    """
    semi = np.asarray(solid.semi)
    polar = np.linalg.norm(plane, axis=1)
    unit = np.column_stack([np.sinc(polar / np.pi)[:, None] * plane, -np.cos(polar)])
    outward = unit / semi
    outward *= offset / np.linalg.norm(outward, axis=1, keepdims=True)
    return np.asarray(solid.center + (semi * unit + outward) @ solid.axes.T)


def lowest_point(solid: Solid, offset: float) -> Array:
    """Point (3,), mm, of least z of the surface parallel to an ellipsoid.

    Parameters
    ----------
    solid : Solid
        The ellipsoid.
    offset : float
        Distance outwards from the ellipsoid, mm.
    """
    down = -solid.axes[2]
    support = np.asarray(solid.semi) ** 2 * down
    own = support / np.sqrt(support @ down) + offset * down
    return np.asarray(solid.center + solid.axes @ own)
