"""The shape of a heart on a grid, before it is measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.base import Base
from heartgen.images.isosurface import Isosurface
from heartgen.images.levelset import LevelSet
from heartgen.images.mask import Finding

POOL_SURFACES = ("lv_endo", "rv_endo")
"""Names of the pools' surfaces."""


@dataclass(frozen=True, eq=False)
class Slices:
    """What the slices of a stack show.

    Attributes
    ----------
    contours : mapping of str to Isosurface
        Points on the contours of the parts, for the surface of the mesh that they belong to;
        normals are those of the interpolated surfaces, weights the length of the contour times the
        distance between slices, mm^2; no triangles.
    outline : Isosurface
        Points on the contours of the mask itself, in the slices that show a pool: what accuracy is
        measured against. They are where the slices were moved, if their shifts were taken back.
    given : Isosurface
        The same where the slices were given.
    normal : (3,) float64
        Of the slices, from apex to base, world (LPS).
    heights : (n,) float64
        Of the slices over the origin of the world along the normal, mm.
    distance : float
        Between neighboring slices, mm.
    shifts : (n, 3) float64
        In-plane shift of each slice that was taken back, mm, world (LPS); zero if none was.
    """

    contours: Mapping[str, Isosurface]
    outline: Isosurface
    given: Isosurface
    normal: NDArray[np.float64]
    heights: NDArray[np.float64]
    distance: float
    shifts: NDArray[np.float64]

    def away(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance (n,) of points (n, 3), mm, world (LPS), to the nearest slice, mm.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        height = points @ self.normal
        after = np.clip(np.searchsorted(self.heights, height), 1, len(self.heights) - 1)
        near = [np.abs(height - self.heights[after - k]) for k in (0, 1)]
        return np.asarray(np.minimum(*near))

    def shift_at(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Shift (n, 3), mm, of the slice nearest to points (n, 3), mm, world (LPS).

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        away = np.abs((points @ self.normal)[:, None] - self.heights)
        nearest = away.argmin(axis=1)
        within = away[np.arange(len(points)), nearest] < self.distance / 2
        return np.asarray(self.shifts[nearest] * within[:, None])


@dataclass(frozen=True, eq=False)
class HeartShape:
    """Wall, pools, base and surfaces.

    Attributes
    ----------
    wall : (nx, ny, nz) bool
        Myocardium without what was taken for pool.
    pools : tuple of (nx, ny, nz) bool
        The left pool, then the right one if there is one.
    filled : LevelSet
        Signed distance of wall and pools together.
    levels : tuple of LevelSet
        Signed distance of each pool.
    base : Base
        Where the heart ends.
    voxel : float
        Edge of a cube with the volume of a voxel, mm.
    surfaces : mapping of str to LevelSet
        As in `Anatomy`.
    myocardium : LevelSet
        These two as in `Anatomy`.
    findings : tuple of Finding
        What was seen on the way.
    slices : Slices or None
        What was not interpolated; None if nothing was.
    """

    wall: NDArray[np.bool_]
    pools: tuple[NDArray[np.bool_], ...]
    filled: LevelSet
    levels: tuple[LevelSet, ...]
    base: Base
    voxel: float
    surfaces: Mapping[str, LevelSet]
    myocardium: LevelSet
    findings: tuple[Finding, ...]
    slices: Slices | None = None

    def centers(self, voxels: NDArray[np.bool_]) -> NDArray[np.float64]:
        """World coordinates (n, 3), mm, LPS, of the voxels that are set.

        Parameters
        ----------
        voxels : (nx, ny, nz) bool
            Which voxels.
        """
        affine = self.filled.affine
        index = np.argwhere(voxels).astype(float)
        return np.asarray(index @ affine[:3, :3].T + affine[:3, 3])

    def below(self, voxels: NDArray[np.bool_]) -> NDArray[np.float64]:
        """World coordinates (n, 3) of the voxels that are set and lie below the base.

        Parameters
        ----------
        voxels : (nx, ny, nz) bool
            Which voxels.
        """
        points = self.centers(voxels)
        return points[self.base.surface.height(points) < 0]
