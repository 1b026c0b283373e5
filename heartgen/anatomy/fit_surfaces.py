"""The surfaces a mesh is fitted to: signed distances with a least wall, beyond the base too."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.basal_surface import BasalSurface
from heartgen.anatomy.base import Base
from heartgen.anatomy.plane import Plane
from heartgen.images.levelset import LevelSet, smooth_indicator
from heartgen.images.mask import Mask

LEAST_WALL = 1.0
"""Voxels; where the mask's wall is thinner (pin-holes, scars), the mesh's wall is this thick."""

WALL_ONSET = 5.0
"""Depth below the base, in least wall thicknesses, from which that holds in full."""

FLAT_VOXELS = 2.0
"""Voxels; a rim that rises and falls by less than this is fitted with its plane."""

RIM_VOXELS = 2.0
"""Voxels below the base at which the side surfaces are unaffected by its rounded rim."""


def mesh_surfaces(
    pools: dict[str, LevelSet], filled: LevelSet, base: Base, voxel: float
) -> tuple[dict[str, LevelSet], bool]:
    """Level sets of the named surfaces of the mesh.

    Parameters
    ----------
    pools : dict of str to LevelSet
        Signed distance of each blood pool, by the name of its surface.
    filled : LevelSet
        Signed distance of wall and pools together.
    base : Base
        Where the heart ends.
    voxel : float
        Voxel size, mm.

    Returns
    -------
    surfaces : dict of str to LevelSet
        The pools', then ``epi`` and ``base``.
    thickened : bool
        Whether the wall had to be thickened somewhere.
    """
    least, rim = LEAST_WALL * voxel, RIM_VOXELS * voxel
    flat = base.truncation is not None or base.irregularity < FLAT_VOXELS * voxel
    if len(pools) > 1 and not flat:
        # The openings of two ventricles are at two levels about their common plane.
        rim += base.irregularity
    surfaces, thickened = {}, False
    for name, pool in pools.items():
        others = [other for key, other in pools.items() if key != name]
        inner, thin = _with_wall(pool, filled, others, base, least)
        surfaces[name] = _continued(inner, base, rim)
        thickened |= thin
    surfaces["epi"] = _continued(filled, base, rim)
    surfaces["base"] = LevelSet(heights(filled, base.surface), filled.affine) if flat else filled
    return surfaces, thickened


def truncated_indicator(mask: Mask, base: Base, voxel: float, smooth: bool = True) -> LevelSet:
    """Level function of the wall from its indicator, cut at the truncation.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    base : Base
        Where the heart ends.
    voxel : float
        Voxel size, mm.
    smooth : bool
        Whether the indicator is smoothed.

    Returns
    -------
    LevelSet
        Not a distance: one half minus the indicator, or the height in voxels.
    """
    inside = smooth_indicator(mask.voxels) if smooth else mask.voxels
    values = (0.5 - inside).astype(np.float32)
    if base.truncation is None:
        return LevelSet(values, mask.affine)
    height = heights(LevelSet(values, mask.affine), base.surface)
    return LevelSet(np.maximum(values, np.float32(1 / voxel) * height), mask.affine)


def heights(level: LevelSet, base: Plane | BasalSurface) -> NDArray[np.float32]:
    """Height of every grid point of a level set over the base: (nx, ny, nz) float32, mm.

    Parameters
    ----------
    level : LevelSet
        Whose grid is taken.
    base : Plane or BasalSurface
        mm, world (LPS).
    """
    if isinstance(base, BasalSurface):
        points = np.indices(level.values.shape).reshape(3, -1).T
        world = points @ level.affine[:3, :3].T + level.affine[:3, 3]
        return base.height(world).astype(np.float32).reshape(level.values.shape)
    i, j, k = (np.arange(n) for n in level.values.shape)
    slope = base.normal @ level.affine[:3, :3]
    offset = base.normal @ (level.affine[:3, 3] - base.origin)
    height = (slope[0] * i)[:, None, None] + (slope[1] * j)[:, None] + slope[2] * k + offset
    return np.asarray(height, dtype=np.float32)


def _continued(level: LevelSet, base: Base, rim: float) -> LevelSet:
    """A shape continued beyond the base: its section just below the rim, straight up."""
    height = heights(level, base.surface) + np.float32(rim)
    above = np.argwhere(height > 0)
    points = above @ level.affine[:3, :3].T + level.affine[:3, 3]
    below = points - height[tuple(above.T)].astype(float)[:, None] * base.plane.normal
    values = level.values.copy()
    values[tuple(above.T)] = level.sample(below)[0]
    return LevelSet(values, level.affine)


def _with_wall(
    pool: LevelSet, filled: LevelSet, others: list[LevelSet], base: Base, least: float
) -> tuple[LevelSet, bool]:
    """Pool kept at a least distance from the outside and from the other pools (not at the base).

    Half the distance between two pools is taken from each. Also whether that changed the pool.
    """
    depth = -heights(pool, base.surface) / np.float32(WALL_ONSET * least)
    inner = filled.values + np.float32(least) * np.clip(depth, 0, 1)
    for other in others:
        inner = np.maximum(inner, (pool.values - other.values + np.float32(least)) / 2)
    thin = (pool.values < 0) & (inner > 0) & (depth > 1)
    return LevelSet(np.maximum(pool.values, inner), pool.affine), bool(thin.any())
