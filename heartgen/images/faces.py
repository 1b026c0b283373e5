"""Voxel shapes that face each other: what a wall encloses, covers of a pool, and leaves open."""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from skimage import morphology


def shared_faces(
    inside: NDArray[np.bool_], other: NDArray[np.bool_], spacing: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Area of the voxel faces at which one shape meets another.

    Parameters
    ----------
    inside, other : (nx, ny, nz) bool
        Shapes without common voxels.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    (3, 2) float64
        mm^2, for each index axis: faces that look down the axis from `inside`, and up.
    """
    area = np.prod(spacing) / spacing
    count = np.zeros((3, 2))
    for axis in range(3):
        a, b = np.moveaxis(inside, axis, 0), np.moveaxis(other, axis, 0)
        count[axis] = (a[1:] & b[:-1]).sum(), (a[:-1] & b[1:]).sum()
    return np.asarray(count * area[:, None])


def opening_of(
    pool: NDArray[np.bool_], wall: NDArray[np.bool_], spacing: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Direction in which a ventricle opens, and how widely.

    The normals of a closed surface sum up to zero. So those of the part of the pool's surface that
    is not covered by the wall sum up to minus those of the part that is, and depend on the rim of
    the opening alone: for a plane one they give its normal and its area exactly.

    Parameters
    ----------
    pool, wall : (nx, ny, nz) bool
        Blood pool and myocardium.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    (3,) float64
        Along the index axes, out of the pool; as long as the opening is wide, mm^2.
    """
    covered = shared_faces(pool, wall, spacing)
    return np.asarray(covered[:, 0] - covered[:, 1])


def box_around(voxels: NDArray[np.bool_], margin: NDArray[np.int64]) -> tuple[slice, ...]:
    """Slices of the box around a shape that is not empty, `margin` voxels wider where it can be.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The shape.
    margin : (3,) int
        Voxels to add along each axis, on both sides.
    """
    box = ndi.find_objects(voxels.view(np.uint8))[0]
    return tuple(
        slice(max(side.start - m, 0), side.stop + m) for side, m in zip(box, margin, strict=True)
    )


def cavity_of(wall: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cavity of a wall: the largest part of what its convex hull adds to it.

    Parameters
    ----------
    wall : (nx, ny, nz) bool
        Myocardium of one ventricle.

    Returns
    -------
    (nx, ny, nz) bool
        Empty if the wall has none.
    """
    inside = np.zeros_like(wall)
    box = box_around(wall, np.zeros(3, dtype=int))
    hull: NDArray[np.bool_] = morphology.convex_hull_image(wall[box])  # type: ignore[no-untyped-call]
    hollow, _ = ndi.label(hull & ~wall[box])
    sizes = np.bincount(hollow.ravel())
    sizes[0] = 0
    inside[box] = hollow == sizes.argmax() if sizes.any() else False
    return inside
