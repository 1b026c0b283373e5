"""Rays across the left ventricle's wall: where they meet the right pool and leave the heart."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.meridian import Meridians
from heartgen.templates.spacing import Spacing

AROUND = 90
"""Rays around: one every four degrees."""

PER_ROW = 4
"""Rays per row of elements."""

STEP = 0.5
"""Step along a ray, voxels."""

WALL_REACH, POOL_REACH = 6.0, 3.0
"""Length of a ray over the wall's thickness, or over the pool's radius, whichever is longer."""


@dataclass(frozen=True)
class RayGrid:
    """A cup of rays that leave the endocardium of an ellipsoid across its wall.

    Attributes
    ----------
    shape : TruncatedEllipsoid
        Where the rays start; heart's frame, mm.
    spacing : Spacing or Meridians
        Where the rows of elements lie on its two surfaces.
    """

    shape: TruncatedEllipsoid
    spacing: Spacing | Meridians

    def rays(
        self, angle: NDArray[np.float64], row: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Starts (n, 3), heart frame, mm, and unit directions (n, 3) at angles and rows (n,).

        Parameters
        ----------
        angle : (n,) float64
            Around the axis, rad.
        row : (n,) float64
            From the apex to the base.
        """
        start, end = (
            self.shape.points(angle, self.spacing.polar(surface, row), surface)
            for surface in (0, 1)
        )
        across = end - start
        return start, across / np.linalg.norm(across, axis=1, keepdims=True)


@dataclass(frozen=True, eq=False)
class RayIntersections:
    """What a grid of rays meets.

    Attributes
    ----------
    angle : (a,) float64
        Angle of each column of rays about the long axis, rad, from -pi.
    row : (r,) float64
        Row coordinate of each row of rays, 0 at the apex.
    heart : (r, a) float64
        Distance to the outside of the heart, mm.
    entry : (r, a) float64
        Distance to the right pool, mm; not a number where the ray misses it.
    miss : (r, a) float64
        Least signed distance to the right pool along the ray, mm; negative where it is met.
    """

    angle: NDArray[np.float64]
    row: NDArray[np.float64]
    heart: NDArray[np.float64]
    entry: NDArray[np.float64]
    miss: NDArray[np.float64]

    def edges(self, row: int) -> tuple[float, float]:
        """Angles between which the widest run of rays of a row meets the right pool, rad.

        Parameters
        ----------
        row : int
            Number of the row of rays, from 0.
        """
        hit = np.isfinite(self.entry[row])
        if not hit.any():
            return 0.0, 0.0
        if hit.all():
            return -np.pi, np.pi
        first = int(np.flatnonzero(~hit)[0])
        change = np.diff(np.roll(hit, -first).astype(int), prepend=0, append=0)
        starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
        widest = int(np.argmax(ends - starts))
        step, turn = 2 * np.pi / len(self.angle), len(self.angle)
        miss = self.miss[row]

        def between(outside: int, inside: int) -> float:
            """Where the miss changes sign between two neighboring rays, in rays."""
            a, b = miss[outside % turn], miss[inside % turn]
            return outside + float(a / (a - b)) * (inside - outside)

        start, end = int(starts[widest]) + first, int(ends[widest]) + first
        low = self.angle[0] + step * between(start - 1, start)
        high = self.angle[0] + step * between(end, end - 1)
        turns = 2 * np.pi * np.round((low + high) / (4 * np.pi))
        return float(low - turns), float(high - turns)


def cast_rays(anatomy: Anatomy, grid: RayGrid) -> RayIntersections:
    """Cast rays through the patient's images.

    Parameters
    ----------
    anatomy : Anatomy
        With a right ventricle.
    grid : RayGrid
        The rays.

    Returns
    -------
    RayIntersections
    """
    along = grid.spacing.rows
    angle = 2 * np.pi * np.arange(AROUND) / AROUND - np.pi
    row = (np.arange(PER_ROW * along) + 0.5) / PER_ROW
    start, direction = grid.rays(*(x.ravel() for x in np.meshgrid(angle, row)))
    reach = max(WALL_REACH * anatomy.wall_thickness, POOL_REACH * anatomy.radius)
    s = np.arange(0, reach, STEP * anatomy.voxel)
    points = anatomy.to_world((start[:, None] + s[:, None] * direction[:, None]).reshape(-1, 3))
    solid, pool = (
        anatomy.surfaces[name].sample(points)[0].reshape(len(start), -1)
        for name in ("epi", "rv_endo")
    )
    beyond = np.maximum.accumulate(solid > 0, axis=1)
    pool = np.where(beyond, np.maximum(pool, reach), pool)
    shape = (len(row), AROUND)
    return RayIntersections(
        angle=angle,
        row=row,
        heart=np.nan_to_num(_crossing(s, solid), nan=s[-1]).reshape(shape),
        entry=_crossing(s, -pool).reshape(shape),
        miss=pool.min(1).reshape(shape),
    )


def _crossing(s: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where values (n, m) at places s (m,) first become positive, (n,); NaN where they do not."""
    positive = values > 0
    at = np.maximum(positive.argmax(1), 1)
    rows = np.arange(len(values))
    before, after = values[rows, at - 1], values[rows, at]
    share = np.clip(before / np.where(before == after, 1, before - after), 0, 1)
    place = s[at - 1] + share * (s[at] - s[at - 1])
    return np.where(positive.any(1), np.where(positive[:, 0], s[0], place), np.nan)
