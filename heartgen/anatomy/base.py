"""The base: the plane of the opening if it was cut flat, a surface below the valves if not."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.basal_surface import BasalSurface, fit_basal_surface
from heartgen.anatomy.plane import Plane
from heartgen.errors import AnatomyError
from heartgen.images.levelset import LevelSet

RIM_SECTORS = 36
"""Sectors of 10 degrees in which the height of the rim is measured."""

IRREGULAR_VOXELS = 4.0
"""Voxels; a rim that rises and falls by more than this, and by more than..."""

IRREGULAR = 0.05
"""...this share of the ventricle's length, carries valve anatomy."""

DEFAULT_TRUNCATION = 1 / 18
"""Default truncation below the basal plane over the length of the ventricle: the paper's 5 mm
(section 2.1) on a human heart of 90 mm, and as much in proportion on any other."""

LOW_RIM = 2.0
"""Percentile of the rim's height that a default truncation must not leave above it."""

TRIM = 2.5
"""Outliers of a plane fit, in standard deviations (at least of a voxel's stairs, 0.5 voxel)."""


@dataclass(frozen=True)
class Base:
    """Where the ventricle ends.

    Attributes
    ----------
    plane : Plane
        The basal plane, or the truncation below it.
    surface : Plane or BasalSurface
        End of the mesh: that plane, or a basal surface about it that follows an uneven rim.
    truncation : float or None
        Distance of the truncation below the rim's plane or basal surface, mm; None if there is
        none.
    irregularity : float
        Rise and fall of the rim about its plane (5th to 95th percentile), mm.
    """

    plane: Plane
    surface: Plane | BasalSurface
    truncation: float | None
    irregularity: float


def find_base(
    openings: Sequence[NDArray[np.float64]],
    walls: Sequence[NDArray[np.float64]],
    pool: NDArray[np.float64],
    filled: LevelSet,
    voxel: float,
    truncate: float | str,
    follow: bool = True,
) -> Base:
    """Fit the basal plane that the ventricles have in common and decide about truncation.

    Parameters
    ----------
    openings : sequence of (n, 3) float64
        Centers of the voxels at the opening of each ventricle's pool, mm, world (LPS).
    walls : sequence of (m, 3) float64
        Centers of the myocardium's voxels around each ventricle's pool.
    pool : (p, 3) float64
        Centers of the left ventricle's pool's voxels.
    filled : LevelSet
        Myocardium and pools together.
    voxel : float
        Voxel size, mm.
    truncate : float or {"auto", "off"}
        Distance below the rim in mm; ``"auto"`` truncates where the rim is irregular.
    follow : bool
        Whether the mesh ends on a basal surface that follows an irregular rim, or on a plane below
        it.

    Returns
    -------
    Base

    Raises
    ------
    AnatomyError
        If the opening is too small for a plane, or the truncation leaves nothing.
    """
    below = pool.mean(0)
    opening = np.concatenate(openings)
    plane = fit_plane(opening, below, voxel)
    length = -float(plane.height(pool).min())
    middles = [fit_plane(each, below, voxel).origin for each in openings]
    centers = np.concatenate(
        [_rim(wall, plane, middle) for wall, middle in zip(walls, middles, strict=True)]
    )
    rim_plane = fit_plane(centers, below, voxel)
    residual = rim_plane.height(centers)
    irregularity = float(np.ptp(np.percentile(residual, [5, 95])))
    valves = irregularity > max(IRREGULAR_VOXELS * voxel, IRREGULAR * length)
    plane = rim_plane if valves else _refine(plane, opening, filled, voxel)
    if truncate == "off" or (truncate == "auto" and not valves):
        return Base(plane, plane, None, irregularity)
    basal_surface = fit_basal_surface(plane, centers, length) if valves and follow else None
    distance = (
        _default_truncation(basal_surface or plane, centers, length, voxel)
        if truncate == "auto"
        else float(truncate)
    )
    if not 0 <= distance < length / 2:
        raise AnatomyError(
            f"a truncation of {distance:.3g} mm does not fit a ventricle {length:.3g} mm long: "
            "choose a distance between 0 and half the length"
        )
    plane = plane.shifted(-distance)
    return Base(
        plane,
        plane if basal_surface is None else basal_surface.shifted(-distance),
        distance,
        irregularity,
    )


def _default_truncation(
    base: Plane | BasalSurface, rim: NDArray[np.float64], length: float, voxel: float
) -> float:
    """Distance below a plane or a basal surface at which there is muscle all around, mm."""
    lowest = voxel - float(np.percentile(base.height(rim), LOW_RIM))
    return max(DEFAULT_TRUNCATION * length, lowest) if isinstance(base, Plane) else lowest


def fit_plane(points: NDArray[np.float64], below: NDArray[np.float64], voxel: float) -> Plane:
    """Trimmed least-squares plane through an opening, normal away from the point `below`.

    Parameters
    ----------
    points : (n, 3) float64
        mm.
    below : (3,) float64
        A point on the apical side of the opening, mm, in the same frame.
    voxel : float
        Voxel size, mm.

    Returns
    -------
    Plane

    Raises
    ------
    AnatomyError
        If there are fewer than three points.
    """
    if len(points) < 3:
        raise AnatomyError(
            "the opening of the cavity is smaller than three voxels: crop the mask below the "
            "valves so that the ventricle is open at the base"
        )
    kept = points
    for _ in range(3):
        origin = kept.mean(0)
        normal = np.linalg.eigh(np.cov((kept - origin).T))[1][:, 0]
        off = np.abs((points - origin) @ normal)
        spread = max(float(np.sqrt(np.mean(((kept - origin) @ normal) ** 2))), voxel / 2)
        kept = points[off <= TRIM * spread]
    if (origin - below) @ normal < 0:
        normal = -normal
    return Plane(origin, normal)


def _rim(
    wall: NDArray[np.float64], plane: Plane, middle: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Topmost voxel of the wall in each sector around the middle of the opening, (s, 3)."""
    u = np.linalg.svd(plane.normal[None])[2][1:]
    offset = wall - middle
    height = offset @ plane.normal
    angle = np.arctan2(offset @ u[1], offset @ u[0])
    sector = np.floor((angle + np.pi) / (2 * np.pi) * RIM_SECTORS).astype(int) % RIM_SECTORS
    order = np.lexsort((height, sector))
    last = np.flatnonzero(np.diff(sector[order], append=-1) != 0)
    top = order[last]
    return np.asarray(wall[top])


def _refine(plane: Plane, opening: NDArray[np.float64], filled: LevelSet, voxel: float) -> Plane:
    """Plane through the sub-voxel surface over the opening instead of through voxel centers."""
    below = plane.origin - plane.normal
    points = opening
    for _ in range(3):
        distance, gradient = filled.sample(points)
        slope = np.maximum(gradient @ plane.normal, 0.5)
        points = points - (distance / slope)[:, None] * plane.normal
    return fit_plane(points, below, voxel)
