"""Euclidean distance transforms of voxel shapes."""

from __future__ import annotations

import edt
import numba as nb
import numpy as np
from numpy.typing import NDArray

Box = tuple[slice, slice, slice]
"""Part of a voxel grid."""


def inner_distance(voxels: NDArray[np.bool_], spacing: NDArray[np.float64]) -> NDArray[np.float32]:
    """Distance from every voxel of a shape to the nearest voxel outside it.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The shape; beyond the array there is nothing to be distant from.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    (nx, ny, nz) float32
        mm between voxel centers; zero outside the shape.
    """
    # What is nearest lies next to the shape: most shapes fill a small part of their array.
    box = box_around(voxels, 0.0, spacing)
    out = np.zeros(voxels.shape, dtype=np.float32)
    solid = np.ascontiguousarray(voxels[box])
    if solid.size:
        out[box] = edt.edt(solid, anisotropy=tuple(spacing), parallel=nb.get_num_threads())
    return out


def near(
    voxels: NDArray[np.bool_], reach: float, spacing: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Voxels no farther from a shape than some distance.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The shape.
    reach : float
        mm between voxel centers.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    (nx, ny, nz) bool
    """
    box = box_around(voxels, reach, spacing)
    out = np.zeros(voxels.shape, dtype=bool)
    out[box] = inner_distance(~voxels[box], spacing) <= reach
    return out


def box_around(voxels: NDArray[np.bool_], reach: float, spacing: NDArray[np.float64]) -> Box:
    """Box of a shape and all voxels up to some distance from it, and one more on each side.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The shape.
    reach : float
        mm.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    tuple of 3 slices
        Empty if the shape is.
    """
    filled = [np.flatnonzero(voxels.any(axis)) for axis in ((1, 2), (0, 2), (0, 1))]
    if not len(filled[0]):
        return (slice(0), slice(0), slice(0))
    margin = np.ceil(reach / spacing).astype(int) + 1
    first, second, third = (
        slice(max(0, int(f[0]) - m), int(f[-1]) + m + 1)
        for f, m in zip(filled, margin.tolist(), strict=True)
    )
    return first, second, third
