"""A flat base between the rims of the ventricles: its area, samples and distance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.samples.nearest import Curve, curve_distance

Array = NDArray[np.float64]

PLASTIC = 1.32471795724474602596
"""Root of x^3 = x + 1: its powers spread points evenly over a square (Roberts 2018)."""

DRAWN = 4
"""Points drawn per sample asked for, and again until enough lie on the plate."""


@dataclass(frozen=True, eq=False)
class Plate:
    """Flat piece of a surface.

    Attributes
    ----------
    center : (3,) float64, mm
        A point of its plane.
    axes : (3, 3) float64
        Columns: two unit vectors in the plane, and its normal.
    holds : callable
        Points (n, 3) of the plane to whether they lie on the plate, (n,).
    rims : tuple of Curve
        All that bounds it.
    area : float
        mm^2.
    """

    center: Array
    axes: Array
    holds: Callable[[Array], NDArray[np.bool_]]
    rims: tuple[Curve, ...]
    area: float

    def samples(self, n: int) -> tuple[Array, Array]:
        """Even samples (n, 3), mm, and the area (n,), mm^2, that each stands for.

        Parameters
        ----------
        n : int
            How many.
        """
        knots = np.concatenate([(rim.tree.data - self.center) @ self.axes for rim in self.rims])
        low, high = knots[:, :2].min(axis=0), knots[:, :2].max(axis=0)
        found = np.empty((0, 3))
        count = 0
        while len(found) < n:
            index = np.arange(count, count + DRAWN * n)[:, None]
            square = np.mod(1 / 2 + (index + 1) / PLASTIC ** np.array([1, 2]), 1)
            points = self.center + (low + square * (high - low)) @ self.axes[:, :2].T
            found = np.concatenate([found, points[self.holds(points)]])
            count += DRAWN * n
        return found[:n], np.full(n, self.area / n)

    def distance(self, points: Array) -> Array:
        """Distance (n,), mm, from points (n, 3), mm.

        Parameters
        ----------
        points : (n, 3) float64
            mm, in the frame of the plate.
        """
        height = (points - self.center) @ self.axes[:, 2]
        over = self.holds(points - height[:, None] * self.axes[:, 2])
        best = np.where(over, np.abs(height), np.inf)
        aside = np.flatnonzero(~over)
        for rim in self.rims:
            best[aside] = np.minimum(best[aside], curve_distance(rim, points[aside]))
        return np.asarray(best)
