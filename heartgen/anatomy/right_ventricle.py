"""The right ventricle seen from the left one: walls, depth, extent around the axis, width."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.plane import Plane
from heartgen.anatomy.sizes import Distances, wall_thickness
from heartgen.errors import AnatomyError
from heartgen.images.levelset import LevelSet

RAYS = 360
"""Rays around the axis on which the extent is measured: one per degree, interpolated between."""

STEP = 0.5
"""Distance between the samples on a ray, voxels."""

LEVELS = 24
"""Heights at which the width is measured."""

CROSSING = np.radians(45.0)
"""Angle from x within which rays cross the pool from septum to free wall."""


@dataclass(frozen=True, eq=False)
class RvAnatomy:
    """What the shape analysis measured of a right ventricle.

    Attributes
    ----------
    wall_thickness, septal_thickness : float
        Median thickness, at the mid-heights of its pool, of its free wall and of the septum, mm.
    pool_volume : float
        Below the base, mm^3.
    apex_level : float
        Lowest height of the pool in the heart's frame, mm, negative.
    insertion : (2,) float64
        Angles about the axis of the left ventricle between which the pool lies at half its depth,
        around x, radians: the first negative, the second positive.
    width : float
        Largest distance between septum and free wall on rays from the axis, mm.
    """

    wall_thickness: float
    septal_thickness: float
    pool_volume: float
    apex_level: float
    insertion: NDArray[np.float64]
    width: float


def measure_right(
    wall: NDArray[np.float64],
    distances: Sequence[Distances],
    right_points: NDArray[np.float64],
    right: LevelSet,
    frame: NDArray[np.float64],
    voxel: float,
) -> RvAnatomy:
    """Measure the right ventricle.

    Parameters
    ----------
    wall : (n, 3) float64
        Centers of the myocardium's voxels below the base, mm, world (LPS).
    distances : sequence of three (n,) float32
        Signed distances there of the left pool, of the right pool, and of the outside, mm.
    right_points : (m, 3) float64
        Centers of the right pool's voxels below the base, mm, world (LPS).
    right : LevelSet
        Signed distance of the right pool.
    frame : (4, 4) float64
        Heart to world, mm.
    voxel : float
        Voxel size, mm.

    Returns
    -------
    RvAnatomy

    Raises
    ------
    AnatomyError
        If one of its walls is not there.
    """
    of_left, of_right, outside = distances
    base = Plane(frame[:3, 3], frame[:3, 2])
    apex_level = float(base.height(right_points).min())
    depth = base.height(wall) / apex_level
    free, _ = wall_thickness(
        (of_right, outside), [of_left], depth, "free wall of the right ventricle"
    )
    septum, _ = wall_thickness((of_left, of_right), [outside], depth, "septum")
    reach = float(np.linalg.norm((right_points - frame[:3, 3]) @ frame[:3, :2], axis=1).max())
    radii = np.arange(0, reach + voxel, STEP * voxel)
    return RvAnatomy(
        wall_thickness=free,
        septal_thickness=septum,
        pool_volume=len(right_points) * voxel**3,
        apex_level=apex_level,
        insertion=_insertion(right, frame, radii, apex_level / 2),
        width=_width(right, frame, radii, apex_level),
    )


def _on_rays(
    level: LevelSet,
    frame: NDArray[np.float64],
    angles: NDArray[np.float64],
    radii: NDArray[np.float64],
    height: float,
) -> NDArray[np.float64]:
    """Signed distance on rays from the axis of the heart at one height, (angles, radii)."""
    points = np.empty((len(angles), len(radii), 3))
    points[..., 0] = np.cos(angles)[:, None] * radii
    points[..., 1] = np.sin(angles)[:, None] * radii
    points[..., 2] = height
    world = points.reshape(-1, 3) @ frame[:3, :3].T + frame[:3, 3]
    return level.sample(world)[0].reshape(points.shape[:2])


def _insertion(
    right: LevelSet, frame: NDArray[np.float64], radii: NDArray[np.float64], height: float
) -> NDArray[np.float64]:
    """Angles between which rays meet the right pool at one height, (2,)."""
    angles = np.linspace(-np.pi, np.pi, RAYS + 1)
    nearest = _on_rays(right, frame, angles, radii, height).min(1)
    met = np.flatnonzero(nearest < 0)
    if len(met) == 0 or met[0] == 0 or met[-1] == RAYS:
        raise AnatomyError(
            "the extent of the right ventricle could not be measured: its pool does not lie to one "
            "side of the left ventricle at mid-height; check that the mask shows both ventricles "
            "from base to apex"
        )
    ends = []
    for inner, outer in ((met[0], met[0] - 1), (met[-1], met[-1] + 1)):
        share = nearest[inner] / (nearest[inner] - nearest[outer])
        ends.append(angles[inner] + share * (angles[outer] - angles[inner]))
    return np.array(ends)


def _width(
    right: LevelSet, frame: NDArray[np.float64], radii: NDArray[np.float64], apex_level: float
) -> float:
    """Largest length of a ray from the axis in the right pool, mm."""
    angles = np.linspace(-CROSSING, CROSSING, RAYS // 8 + 1)
    heights = (np.arange(LEVELS) + 0.5) / LEVELS * apex_level
    inside = [(_on_rays(right, frame, angles, radii, z) < 0).sum(1).max() for z in heights]
    return float(max(inside) * (radii[1] - radii[0]))
