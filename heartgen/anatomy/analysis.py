"""Shape analysis of a left ventricle (paper, section 2.1): pool, base, axes, sizes, surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.base import Base, Plane, find_base
from heartgen.anatomy.cavity import Cavity, find_cavity
from heartgen.errors import AnatomyError
from heartgen.images.levelset import LevelSet, signed_distance, smooth_indicator
from heartgen.images.mask import Finding, Mask

MARGIN = 6
"""Empty voxels kept around the heart: room for smooth surfaces."""

MIN_WALL_VOXELS = 50
"""Fewer voxels below the base are no ventricle."""

LEAST_WALL = 1.0
"""Voxels; where the mask's wall is thinner (pin-holes, scars), the mesh's wall is this thick."""

WALL_ONSET = 5.0
"""Depth below the base, in least wall thicknesses, from which that holds in full."""

FLAT_VOXELS = 2.0
"""Voxels; a rim that rises and falls by less than this is fitted with its plane."""

RIM_VOXELS = 2.0
"""Voxels below the base at which the side surfaces are unaffected by its rounded rim."""

MID_WALL = (0.25, 0.75)
"""Heights over the length between which the wall thickness is measured."""


@dataclass(frozen=True)
class Anatomy:
    """What the shape analysis measured in a mask.

    Attributes
    ----------
    frame : (4, 4) float64
        Heart to world: x and y in the basal plane (x along the wider axis of the pool), z from apex
        to base; origin in the middle of the base. mm, LPS.
    surfaces : mapping of str to LevelSet
        Signed distances that the named surfaces of the mesh are fitted to: ``lv_endo`` (of the
        blood pool) and ``epi`` (of wall and pool together), both continued beyond the base so that
        they do not bend over its rim, and ``base`` (of the basal plane, or of wall and pool
        together where the base is not flat).
    myocardium : LevelSet
        Smoothed indicator of the wall minus one half, negated, cut at the truncation: zero on the
        surface that accuracy is measured against. Not a distance.
    base : Base
        Basal plane and truncation.
    voxel : float
        Edge of a cube with the volume of a voxel, mm.
    length : float
        Depth of the pool below the base, mm.
    radius : float
        Radius of a disc with the variance of the pool's cross-section, mm.
    wall_thickness, apex_thickness : float
        Median thickness of the wall at mid-height, and at the apex, mm.
    pool_volume, wall_volume : float
        Below the base, mm^3.
    findings : tuple of Finding
        What is worth telling the user.
    """

    frame: NDArray[np.float64]
    surfaces: Mapping[str, LevelSet]
    myocardium: LevelSet
    base: Base
    voxel: float
    length: float
    radius: float
    wall_thickness: float
    apex_thickness: float
    pool_volume: float
    wall_volume: float
    findings: tuple[Finding, ...]

    def to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World coordinates (n, 3), mm, LPS, of points (n, 3) in the heart's frame, mm."""
        return np.asarray(points @ self.frame[:3, :3].T + self.frame[:3, 3])

    def to_heart(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Heart coordinates (n, 3), mm, of points (n, 3) in the world, mm, LPS."""
        return np.asarray((points - self.frame[:3, 3]) @ self.frame[:3, :3])


def analyse(mask: Mask, truncate: float | str = "auto") -> Anatomy:
    """Measure the left ventricle in a mask of any orientation and voxel size.

    Parameters
    ----------
    mask : Mask
    truncate : float or {"auto", "off"}
        Truncation below the basal plane, mm; ``"auto"`` truncates only where valve anatomy rises
        above the rim.

    Returns
    -------
    Anatomy

    Raises
    ------
    AnatomyError
        Naming the measurement that failed and why.
    """
    mask = _cropped(mask)
    spacing = mask.spacing
    voxel = float(np.prod(spacing) ** (1 / 3))
    cavity = find_cavity(mask.voxels, spacing)
    solid = signed_distance(ndi.binary_fill_holes(mask.voxels | cavity.pool), mask.affine)
    pool = signed_distance(cavity.pool, mask.affine)
    wall_points = _centres(mask, mask.voxels & ~cavity.pool)
    pool_points = _centres(mask, cavity.pool)
    opening = mask.to_world(cavity.opening.astype(float))
    base = find_base(opening, pool_points, wall_points, solid, voxel, truncate)
    wall_points = wall_points[base.plane.height(wall_points) < 0]
    pool_points = pool_points[base.plane.height(pool_points) < 0]
    if min(len(wall_points), len(pool_points)) < MIN_WALL_VOXELS:
        raise AnatomyError(
            "nothing is left below the basal plane: the opening was taken for the whole ventricle; "
            "check that the mask is a cup open at the base"
        )
    frame, radius = _frame(pool_points, base.plane)
    length = -float(base.plane.height(pool_points).min())
    wall, apex = _thickness(wall_points, pool, solid, base.plane, length)
    inner, thickened = _with_wall(pool, solid, base.plane, LEAST_WALL * voxel)
    cut = base.plane if base.truncation is not None else None
    flat = cut is not None or base.irregularity < FLAT_VOXELS * voxel
    surfaces = {
        "lv_endo": _continued(inner, base.plane, RIM_VOXELS * voxel),
        "epi": _continued(solid, base.plane, RIM_VOXELS * voxel),
        "base": LevelSet(_heights(solid, base.plane), solid.affine) if flat else solid,
    }
    return Anatomy(
        frame=frame,
        surfaces=surfaces,
        myocardium=_cut(_indicator(mask), cut, scale=1 / voxel),
        base=base,
        voxel=voxel,
        length=length,
        radius=radius,
        wall_thickness=wall,
        apex_thickness=apex,
        pool_volume=len(pool_points) * voxel**3,
        wall_volume=len(wall_points) * voxel**3,
        findings=_findings(cavity, base, voxel, thickened),
    )


def _cropped(mask: Mask) -> Mask:
    """The mask in its bounding box with a margin."""
    corners = np.argwhere(mask.voxels)
    low, high = corners.min(0), corners.max(0) + 1
    box = mask.voxels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    affine = mask.affine.copy()
    affine[:3, 3] = mask.affine[:3, :3] @ (low - MARGIN) + mask.affine[:3, 3]
    return Mask(np.pad(box, MARGIN), affine, mask.name, mask.findings)


def _centres(mask: Mask, voxels: NDArray[np.bool_]) -> NDArray[np.float64]:
    """World coordinates of the voxels that are set."""
    return mask.to_world(np.argwhere(voxels).astype(float))


def _frame(pool: NDArray[np.float64], plane: Plane) -> tuple[NDArray[np.float64], float]:
    """Heart frame, and the radius of the pool from the variances of its cross-section."""
    z = plane.normal
    u = np.linalg.svd(z[None])[2][1:]
    height = plane.height(pool)
    near_base = pool[height > 0.5 * height.min()]
    flat = (near_base - near_base.mean(0)) @ u.T
    variance, axes = np.linalg.eigh(np.cov(flat.T))
    along = flat @ axes[:, 1]
    # The wider axis has two directions; the skewness of the pool tells them apart.
    x = u.T @ axes[:, 1] * (1.0 if np.mean(along**3) >= 0 else -1.0)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(z, x), z], -1)
    centre = near_base.mean(0)
    frame[:3, 3] = centre - plane.height(centre[None]) * z
    return frame, float(2 * np.sqrt(variance.mean()))


def _thickness(
    wall: NDArray[np.float64], pool: LevelSet, solid: LevelSet, plane: Plane, length: float
) -> tuple[float, float]:
    """Thickness of the wall (distance to the pool plus distance to the outside): median, apex."""
    local = pool.sample(wall)[0] - solid.sample(wall)[0]
    depth = -plane.height(wall) / length
    middle = (depth > MID_WALL[0]) & (depth < MID_WALL[1])
    below = local[depth > 1]
    typical = float(np.median(local[middle]))
    return typical, float(np.median(below)) if len(below) else typical


def _cut(level: LevelSet, plane: Plane | None, scale: float = 1.0) -> LevelSet:
    """The part of a shape below a plane."""
    if plane is None:
        return level
    height = _heights(level, plane)
    return LevelSet(np.maximum(level.values, np.float32(scale) * height), level.affine)


def _continued(level: LevelSet, plane: Plane, rim: float) -> LevelSet:
    """A shape continued beyond the base: its section just below the rim, straight up."""
    height = _heights(level, plane) + np.float32(rim)
    above = np.argwhere(height > 0)
    points = above @ level.affine[:3, :3].T + level.affine[:3, 3]
    below = points - height[tuple(above.T)].astype(float)[:, None] * plane.normal
    values = level.values.copy()
    values[tuple(above.T)] = level.sample(below)[0]
    return LevelSet(values, level.affine)


def _with_wall(
    pool: LevelSet, solid: LevelSet, plane: Plane, least: float
) -> tuple[LevelSet, bool]:
    """Pool kept at a least distance from the outside (not at the base); whether that changed it."""
    depth = -_heights(pool, plane) / np.float32(WALL_ONSET * least)
    inner = solid.values + np.float32(least) * np.clip(depth, 0, 1)
    thin = (pool.values < 0) & (inner > 0) & (depth > 1)
    return LevelSet(np.maximum(pool.values, inner), pool.affine), bool(thin.any())


def _heights(level: LevelSet, plane: Plane) -> NDArray[np.float32]:
    """Height of every grid point over a plane, (nx, ny, nz) float32, mm."""
    i, j, k = (np.arange(n) for n in level.values.shape)
    slope = plane.normal @ level.affine[:3, :3]
    offset = plane.normal @ (level.affine[:3, 3] - plane.origin)
    height = (slope[0] * i)[:, None, None] + (slope[1] * j)[:, None] + slope[2] * k + offset
    return np.asarray(height, dtype=np.float32)


def _indicator(mask: Mask) -> LevelSet:
    """Level function of the wall from its smoothed indicator."""
    return LevelSet((0.5 - smooth_indicator(mask.voxels)).astype(np.float32), mask.affine)


def _findings(cavity: Cavity, base: Base, voxel: float, thickened: bool) -> tuple[Finding, ...]:
    """What the analysis did that the user should know."""
    found = []
    if cavity.leaks:
        found.append(
            Finding(
                "leaks",
                f"the wall has {cavity.leaks} pin-hole(s) besides the opening at the base: they "
                "were closed",
            )
        )
    if thickened:
        found.append(
            Finding(
                "thin wall",
                "the wall is thinner than a voxel in places: the mesh is given "
                f"{LEAST_WALL * voxel:.2g} mm there",
            )
        )
    if cavity.muscle_voxels:
        found.append(
            Finding(
                "papillary muscles",
                f"{cavity.muscle_voxels * voxel**3 / 1000:.2g} ml of papillary muscle and "
                "trabeculae were taken as part of the blood pool",
            )
        )
    if base.truncation is not None:
        found.append(
            Finding(
                "truncation",
                f"the base was truncated {base.truncation:.3g} mm below the basal plane (its rim "
                f"rises and falls by {base.irregularity:.2g} mm)",
            )
        )
    return tuple(found)
