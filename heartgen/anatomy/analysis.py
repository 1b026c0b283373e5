"""Shape analysis of a left ventricle (paper, section 2.1): pool, base, axes, sizes, surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.base import Base, find_base
from heartgen.anatomy.blood_pools import BloodPools, find_pools
from heartgen.anatomy.fit_surfaces import heights, mesh_surfaces, truncated_indicator
from heartgen.anatomy.heart_shape import POOL_SURFACES, HeartShape, Slices
from heartgen.anatomy.mask_findings import opening_findings, treatment_findings
from heartgen.anatomy.plausibility import check_proportions, check_roundness
from heartgen.anatomy.right_ventricle import RvAnatomy, measure_right
from heartgen.anatomy.short_axis_contours import find_sections
from heartgen.anatomy.sizes import heart_frame, wall_thickness
from heartgen.anatomy.slice_alignment import without_shifts
from heartgen.anatomy.stacks import shape_of_stack
from heartgen.errors import AnatomyError
from heartgen.images.levelset import LevelSet, signed_distances
from heartgen.images.mask import Finding, Mask
from heartgen.images.stack import stack_of
from heartgen.options import Options

MARGIN = 6
"""Empty voxels kept around the heart: room for smooth surfaces."""

MIN_WALL_VOXELS = 50
"""Fewer voxels below the base are no ventricle."""

ENOUGH_SLICES = 16
"""Slices of whatever direction from which voxels as long as their distance show a heart."""


@dataclass(frozen=True, eq=False)
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
    rv : RvAnatomy or None
        None if the mask shows a left ventricle alone.
    uncut : Anatomy or None
        The anatomy before an apical hole was cut into it; None if there is no hole.
    slices : Slices or None
        What the slices show of a short-axis stack, from which the surfaces were interpolated; None
        of a mask whose voxels fill the heart.
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
    rv: RvAnatomy | None = None
    uncut: Anatomy | None = None
    slices: Slices | None = None

    def to_world(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """World coordinates (n, 3), mm, LPS, of points (n, 3) in the heart's frame, mm.

        Parameters
        ----------
        points : (n, 3) float64
            mm, heart's frame.
        """
        return np.asarray(points @ self.frame[:3, :3].T + self.frame[:3, 3])

    def to_heart(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Heart coordinates (n, 3), mm, of points (n, 3) in the world, mm, LPS.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        return np.asarray((points - self.frame[:3, 3]) @ self.frame[:3, :3])


def analyze(
    mask: Mask,
    truncate: float | str = "auto",
    ventricles: str = "auto",
    follow_rim: bool = True,
    take_back_shifts: bool = True,
) -> Anatomy:
    """Measure the left ventricle, or both, in a mask of any orientation and voxel size.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    truncate : float or {"auto", "off"}
        Truncation below the rim, mm; ``"auto"`` truncates only where valve anatomy is present.
    ventricles : {"auto", "lv", "biv"}
        What the mask must show: a left ventricle alone, both ventricles, or either.
    follow_rim : bool
        Where valve anatomy is present, whether the base follows the rim, or is a plane below it.
    take_back_shifts : bool
        Whether slices of a stack that are clearly shifted against each other are moved back.

    Returns
    -------
    Anatomy

    Raises
    ------
    AnatomyError
        Naming the measurement that failed and why.
    """
    stack = stack_of(mask)
    sections = None if stack is None else find_sections(stack, ventricles)
    if sections is not None:
        if take_back_shifts:
            sections = without_shifts(sections)
        return _measured(shape_of_stack(sections, truncate))
    if stack is not None and len(stack.heights) < ENOUGH_SLICES:
        raise AnatomyError(
            f"the {len(stack.heights)} slices, {stack.distance:.3g} mm apart, do not show a blood "
            "pool that the wall encloses across the long axis: give a short-axis stack with its "
            "whole wall, or slices closer together"
        )
    return _measured(_shape_of_volume(mask, truncate, ventricles, follow_rim))


def analyze_under(mask: Mask, options: Options) -> Anatomy:
    """Measure a mask as `analyze` does, as far as options of the pipeline have a say in it.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    options : Options
        Of the pipeline; those of fitting have no say.
    """
    return analyze(
        mask,
        options.truncate,
        options.ventricles,
        options.base == "rim",
        options.slice_alignment == "auto",
    )


def raw_indicator(mask: Mask, anatomy: Anatomy) -> LevelSet:
    """Level function of a dense mask as it is, steps and all, cut where its anatomy was truncated.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    anatomy : Anatomy
        Of this mask.

    Returns
    -------
    LevelSet
        mm, world (LPS); zero on the 0.5 isosurface of the paper (section 3.2).
    """
    return truncated_indicator(_cropped(mask), anatomy.base, anatomy.voxel, smooth=False)


def _shape_of_volume(
    mask: Mask, truncate: float | str, ventricles: str, follow_rim: bool
) -> HeartShape:
    """Blood pools, base and surfaces of a mask whose voxels fill the heart."""
    mask = _cropped(mask)
    voxel = float(np.prod(mask.spacing) ** (1 / 3))
    pools = find_pools(mask.voxels, mask.spacing, ventricles)
    filled, levels = _levels(mask, pools)
    wall = mask.voxels & ~pools.blood
    nearest = np.argmin([level.values for level in levels], axis=0)
    base = find_base(
        [mask.to_world(cavity.opening.astype(float)) for cavity in pools],
        [_centers(mask, wall & (nearest == n)) for n in range(len(levels))],
        _centers(mask, pools.left.pool),
        filled,
        voxel,
        truncate,
        follow_rim,
    )
    if base.truncation is not None and pools.right is not None:
        pools = pools.below(heights(filled, base.surface) < 0, mask.spacing)
        filled, levels = _levels(mask, pools)
        wall = mask.voxels & ~pools.blood
    surfaces, thickened = mesh_surfaces(
        dict(zip(POOL_SURFACES, levels, strict=False)), filled, base, voxel
    )
    return HeartShape(
        wall=wall,
        pools=tuple(cavity.pool for cavity in pools),
        filled=filled,
        levels=tuple(levels),
        base=base,
        voxel=voxel,
        surfaces=surfaces,
        myocardium=truncated_indicator(mask, base, voxel),
        findings=opening_findings(pools, mask, base)
        + treatment_findings(pools, base, voxel, thickened),
    )


def _measured(shape: HeartShape) -> Anatomy:
    """Frame and sizes of a heart whose shape is known."""
    base, filled, levels, voxel = shape.base, shape.filled, shape.levels, shape.voxel
    below = heights(filled, base.surface) < 0
    wall = shape.wall & below
    wall_points = shape.centers(wall)
    pool_points = [shape.below(pool) for pool in shape.pools]
    if min(len(points) for points in (wall_points, *pool_points)) < MIN_WALL_VOXELS:
        raise AnatomyError(
            "nothing is left below the basal plane: the opening was taken for the whole ventricle; "
            "check that the mask is a cup open at the base"
        )
    frame, radius = heart_frame(pool_points, base.plane)
    length = -float(base.plane.height(pool_points[0]).min())
    distances = [level.values[wall] for level in levels]
    outside = -filled.values[wall]
    depth = -base.surface.height(wall_points) / length
    typical, apex = wall_thickness((distances[0], outside), distances[1:], depth, "wall")
    return Anatomy(
        frame=frame,
        surfaces=shape.surfaces,
        myocardium=shape.myocardium,
        base=base,
        voxel=voxel,
        length=length,
        radius=radius,
        wall_thickness=typical,
        apex_thickness=apex,
        pool_volume=len(pool_points[0]) * voxel**3,
        wall_volume=len(wall_points) * voxel**3,
        findings=(
            *shape.findings,
            *check_proportions(length, radius, typical, len(pool_points[0]) / len(wall_points)),
            # Beside a right pool, the left one is known by more than its roundness.
            *(check_roundness(pool_points[0], frame[:3, 2], voxel) if len(levels) == 1 else ()),
        ),
        rv=None
        if len(levels) == 1
        else measure_right(
            wall_points, [*distances, outside], pool_points[1], levels[1], frame, voxel
        ),
        slices=shape.slices,
    )


def _cropped(mask: Mask) -> Mask:
    """The mask in its bounding box with a margin."""
    corners = np.argwhere(mask.voxels)
    low, high = corners.min(0), corners.max(0) + 1
    box = mask.voxels[tuple(slice(a, b) for a, b in zip(low, high, strict=True))]
    affine = mask.affine.copy()
    affine[:3, 3] = mask.affine[:3, :3] @ (low - MARGIN) + mask.affine[:3, 3]
    return Mask(np.pad(box, MARGIN), affine, mask.name, mask.findings)


def _levels(mask: Mask, pools: BloodPools) -> tuple[LevelSet, list[LevelSet]]:
    """Signed distances of wall and pools together, and of each pool."""
    filled = ndi.binary_fill_holes(mask.voxels | pools.blood)
    first, *others = signed_distances([filled, *(cavity.pool for cavity in pools)], mask.affine)
    return first, others


def _centers(mask: Mask, voxels: NDArray[np.bool_]) -> NDArray[np.float64]:
    """World coordinates of the voxels that are set."""
    return mask.to_world(np.argwhere(voxels).astype(float))
