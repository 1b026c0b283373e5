"""Euclidean distance transforms of voxel shapes."""

from __future__ import annotations

import edt
import numba as nb
import numpy as np
from numpy.typing import NDArray


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
        mm between voxel centres; zero outside the shape.
    """
    solid = np.ascontiguousarray(voxels)
    return np.asarray(edt.edt(solid, anisotropy=tuple(spacing), parallel=nb.get_num_threads()))
