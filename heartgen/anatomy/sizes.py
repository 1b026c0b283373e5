"""Frame and sizes of a heart, from the positions of its voxels and from signed distances."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.plane import Plane
from heartgen.errors import AnatomyError

Distances = NDArray[np.floating]

MID_WALL = (0.25, 0.75)
"""Heights over the length between which the wall thickness is measured."""


def heart_frame(
    pools: Sequence[NDArray[np.float64]], plane: Plane
) -> tuple[NDArray[np.float64], float]:
    """Heart frame, and the radius of the left pool from the variances of its cross-section.

    Parameters
    ----------
    pools : sequence of (n, 3) float64
        Centers of the voxels of the left pool, and of the right one if there is one, below the
        base, mm, world (LPS).
    plane : Plane
        The base; mm, world (LPS).

    Returns
    -------
    frame : (4, 4) float64
        Heart to world, mm.
    radius : float
        mm.
    """
    z = plane.normal
    u = np.linalg.svd(z[None])[2][1:]
    left = pools[0]
    height = plane.height(left)
    near_base = left[height > 0.5 * height.min()]
    flat = (near_base - near_base.mean(0)) @ u.T
    variance, axes = np.linalg.eigh(np.cov(flat.T))
    if len(pools) == 1:
        along = flat @ axes[:, 1]
        # The wider axis has two directions; the skewness of the pool tells them apart.
        x = u.T @ axes[:, 1] * (1.0 if np.mean(along**3) >= 0 else -1.0)
    else:
        x = u.T @ (u @ (pools[1].mean(0) - left.mean(0)))
        x /= np.linalg.norm(x)
    frame = np.eye(4)
    frame[:3, :3] = np.stack([x, np.cross(z, x), z], -1)
    center = near_base.mean(0)
    frame[:3, 3] = center - plane.height(center[None]) * z
    return frame, float(2 * np.sqrt(variance.mean()))


def wall_thickness(
    near: tuple[Distances, Distances], far: Sequence[Distances], depth: Distances, name: str
) -> tuple[float, float]:
    """Thickness of a wall, the sum of the distances to its two surfaces: median, and at the apex.

    Parameters
    ----------
    near : two of (n,) float32
        Signed distances, at the voxels of the myocardium, of what lies on either side of the wall,
        positive in the wall, mm.
    far : sequence of (n,) float32
        Signed distance of a third region, if there is one: only where it is farther than the wall
        is thick is the wall one between the first two.
    depth : (n,) float64
        Depth of the voxels below the base over the length of the ventricle.
    name : str
        Of the wall, in messages.

    Returns
    -------
    typical, apex : float
        mm; the former again where there is no wall below the length.

    Raises
    ------
    AnatomyError
        If there is no such wall at mid-height.
    """
    local = near[0] + near[1]
    own = np.all([third > local for third in far], axis=0) if far else np.full(len(local), True)
    middle = own & (depth > MID_WALL[0]) & (depth < MID_WALL[1])
    if not middle.any():
        raise AnatomyError(
            f"the {name} could not be measured: there is none at mid-height; check the mask there"
        )
    below = local[own & (depth > 1)]
    typical = float(np.median(local[middle]))
    return typical, float(np.median(below)) if len(below) else typical
