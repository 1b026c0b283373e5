"""Convex hull of a voxel shape, as voxels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from heartgen.errors import AnatomyError

TOLERANCE = 1e-6
"""Slack in voxels, so that voxels on a facet count as inside in spite of rounding."""

CHUNK = 2048
"""Voxel columns handled at once, to bound memory."""


def convex_hull(voxels: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels whose centers lie in the convex hull of the centers of a shape's voxels.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The shape.

    Returns
    -------
    (nx, ny, nz) bool

    Raises
    ------
    AnatomyError
        If the shape is flat.
    """
    nx, ny, nz = voxels.shape
    columns = np.argwhere(voxels.any(2))
    runs = voxels[tuple(columns.T)]
    first, last = runs.argmax(1), nz - 1 - runs[:, ::-1].argmax(1)
    ends = np.concatenate([np.c_[columns, first], np.c_[columns, last]]).astype(float)
    try:
        hull = ConvexHull(ends)
    except QhullError as error:
        raise AnatomyError(
            "the mask is flat: a ventricle needs a three-dimensional mask"
        ) from error
    planes = np.unique(np.round(hull.equations, 9), axis=0)
    normal, offset = planes[:, :3], planes[:, 3]
    up, down = normal[:, 2] > TOLERANCE, normal[:, 2] < -TOLERANCE
    side = ~up & ~down
    out = np.zeros_like(voxels)
    grid = np.argwhere(np.ones((nx, ny), dtype=bool))
    levels = np.arange(nz)
    for start in range(0, len(grid), CHUNK):
        part = grid[start : start + CHUNK]
        value = part @ normal[:, :2].T + offset
        top = (-value[:, up] / normal[up, 2]).min(1)
        bottom = (-value[:, down] / normal[down, 2]).max(1)
        inside = (levels <= top[:, None] + TOLERANCE) & (levels >= bottom[:, None] - TOLERANCE)
        inside &= np.asarray((value[:, side] <= TOLERANCE).all(1))[:, None]
        out[part[:, 0], part[:, 1]] = inside
    return out
