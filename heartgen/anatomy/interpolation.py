"""Shape-based interpolation between slices: of filled heart and pools, not of the thin wall.

Each part is a signed distance in the plane of every slice that shows it. Along the normal these are
interpolated (Raya and Udupa 1990), and the level that they are zero on is the part's surface. Below
the lowest slice of a part its area goes on to shrink as it does in the slices above it, until it
vanishes; above the uppermost slice the part goes straight on.

Where a part of one slice hardly lies over that of the next, as a narrow pool along a slanted axis,
nothing would be left of it between them: then sections are interpolated about a line through their
centers, and lie on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator

from heartgen.images.contours import planar_distance

Array = NDArray[np.float64]

TAPERING = 3
"""Lowest slices of a part whose areas tell where it ends."""

NEAREST_END, FARTHEST_END = 0.1, 1.0
"""Bounds of the depth of a part below its lowest slice, over the distance to the next slice."""

OVERLAP = 0.6
"""Share of the smaller of two sections that the other covers, from which they are interpolated in
place."""

KNOTS = np.array([0.85, 0.7, 0.5, 0.3, 0.15, 0.05, 0.0])
"""Heights over the end of a part, over the depth of that below its lowest slice, at which its
tapering sections stand for slices."""


@dataclass(frozen=True, eq=False)
class Part:
    """A part of the heart as signed distances in planes.

    Attributes
    ----------
    heights : (m,) float64
        Of the planes, rising, mm; the lowest is the end of the part.
    values : (m, nx, ny) float64
        Signed distance in each plane, mm, negative inside.
    centers : (m, 2) float64 or None
        How far the part of each plane lies from where `values` have it, pixels; None if nowhere.
    """

    heights: Array
    values: Array
    centers: Array | None = None

    def at(self, heights: Array) -> Array:
        """Level function (k, nx, ny) at heights (k,), mm; beyond the planes the part goes on.

        Parameters
        ----------
        heights : (k,) float64
            Along the normal of the slices, mm.
        """
        low, high = self.heights[[0, -1]]
        inside = np.clip(heights, low, high)
        level = _between(self.heights, self.values, inside)
        if self.centers is not None:
            middle = _between(self.heights, self.centers, inside)
            level = np.stack(
                [
                    ndi.shift(v, c, order=1, mode="nearest")
                    for v, c in zip(level, middle, strict=True)
                ]
            )
        return np.asarray(level + np.maximum(low - heights, 0)[:, None, None])


def part_of(
    shapes: NDArray[np.bool_],
    heights: Array,
    spacing: Array,
    distance: float,
    floor: float = -np.inf,
    shifts: Array | None = None,
) -> Part:
    """Interpolate a part between its slices and close it below the lowest of them.

    Parameters
    ----------
    shapes : (n, nx, ny) bool
        The part in each slice, from apex to base; empty in the lowest slices, if in any.
    heights : (n,) float64
        Of the slices, rising, mm.
    spacing : (2,) float64
        Pixel size, mm.
    distance : float
        Between slices, mm.
    floor : float
        Height that the part does not reach, mm.
    shifts : (n, 2) float64, optional
        How far each slice is shifted along the axes of its pixels, mm: it is moved back.

    Returns
    -------
    Part
    """
    has = np.flatnonzero(shapes.any(axis=(1, 2)))
    back = np.zeros((len(shapes), 2)) if shifts is None else -shifts
    centers = _centers(shapes[has], back[has] / spacing)
    moved = back[has] if centers is None else back[has] - centers * spacing
    values = np.stack(
        [planar_distance(shapes[n], spacing, by) for n, by in zip(has, moved, strict=True)]
    )
    z = heights[has]
    areas = shapes[has].sum(axis=(1, 2)) * float(np.prod(spacing))
    depth, roundness = end_depth(z, areas, distance)
    depth = float(np.clip(depth, NEAREST_END * distance, FARTHEST_END * distance))
    depth = max(min(depth, z[0] - floor), NEAREST_END * distance)
    radius = -float(values[0].min())
    share = KNOTS * (1 + roundness * (1 - KNOTS))
    tips = values[0] + radius * (1 - np.sqrt(share))[:, None, None]
    return Part(
        np.concatenate([(z[0] - depth + KNOTS * depth)[::-1], z]),
        np.concatenate([tips[::-1], values]),
        None if centers is None else np.concatenate([[centers[0]] * len(KNOTS), centers]),
    )


def _centers(shapes: NDArray[np.bool_], back: Array) -> Array | None:
    """Centers (m, 2) of sections moved by (m, 2), over the last, pixels; None if all overlap."""
    middle = np.stack([np.argwhere(shape).mean(0) for shape in shapes]) + back
    steps = np.rint(np.diff(back, axis=0)).astype(int)
    for one, other, step in zip(shapes[:-1], shapes[1:], steps, strict=True):
        common = (one & np.roll(other, step, axis=(0, 1))).sum()
        if common < OVERLAP * min(one.sum(), other.sum()):
            return np.asarray(middle - middle[-1])
    return None


def _between(heights: Array, values: Array, at: Array) -> Array:
    """Values (k, ...) at heights (k,) between those (m, ...) at heights (m,)."""
    return np.asarray(Akima1DInterpolator(heights, values, axis=0, method="makima")(at))


def end_depth(heights: Array, areas: Array, distance: float) -> tuple[float, float]:
    """Depth below the lowest slice at which a part ends, and how round it is there.

    Areas along the axis of an ellipsoid are a quadratic function of the height. One is fitted to
    the lowest slices, exact in the lowest.

    Parameters
    ----------
    heights, areas : (m,) float64
        Of the slices that show the part, from apex to base, mm and mm^2.
    distance : float
        Between slices, mm.

    Returns
    -------
    depth : float
        mm.
    roundness : float
        c, where the area over that of the lowest slice is ``t (1 + c (1 - t))`` at the share t of
        the height over the end.
    """
    t = (heights[1:TAPERING] - heights[0]) / distance
    a = areas[1:TAPERING] / areas[0]
    if len(t) == 0 or a[0] <= 1:
        return FARTHEST_END * distance, 0.0
    if len(t) == 1:
        slope, bend = (a[0] - 1) / t[0], 0.0
    else:
        slope, bend = np.linalg.lstsq(np.stack([t, t**2], -1), a - 1, rcond=None)[0]
        bend = min(bend, 0.0)
        slope = float(t @ (a - 1 - bend * t**2) / (t @ t))
    # 1 - slope x + bend x^2 = 0 at the depth x
    root = 2 / (slope + np.sqrt(slope**2 - 4 * bend))
    return float(root) * distance, float(-bend * root**2)
