"""A blood pool: the deep, enclosed part of what the convex hull adds to the myocardium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.errors import AnatomyError
from heartgen.images.distance import box_around, inner_distance, near

CORE_DEPTH = 0.15
"""Depth of the pool's core below its surface, over the pool's greatest depth: cuts the pool off
from hollows on the outside of the heart that it touches over a low rim or through a pin-hole."""

EXPOSED = 0.3
"""Share of a part's faces on the hull above which it lies outside the wall."""

MUSCLE_RADIUS = 0.4
"""Papillary muscles and trabeculae up to this radius, over the pool's inner radius, are pool."""

MUSCLE_DEPTH = 1.5
"""Voxels; what a closing adds in a thinner layer is rounding of the voxel surface, not muscle."""

MUSCLE_CLEARANCE = 0.2
"""Distance from the outside, over the pool's inner radius, within which there is wall alone."""

CHANNEL_RADIUS = 1.5
"""Voxels; narrower channels of the pool are pin-holes of the wall, not pool."""

CONNECTED = np.ones((3, 3, 3), dtype=bool)
"""Voxels that touch at a face, an edge or a corner are connected."""


@dataclass(frozen=True, eq=False)
class Space:
    """A myocardium and what its convex hull adds to it.

    Attributes
    ----------
    wall, empty, hull : (nx, ny, nz) bool
        Myocardium (with at least one empty voxel on every side), the rest of its hull, and both.
    depth : (nx, ny, nz) float32
        Distance in the empty part to the wall or the outside, mm.
    spacing : (3,) float64
        Voxel size, mm.
    """

    wall: NDArray[np.bool_]
    empty: NDArray[np.bool_]
    hull: NDArray[np.bool_]
    depth: NDArray[np.float32]
    spacing: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Leak:
    """An opening of a pool that is not the one at the base.

    Attributes
    ----------
    size : int
        Voxels.
    center : (3,) float64
        Voxel index.
    """

    size: int
    center: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Cavity:
    """The blood pool of a ventricle.

    Attributes
    ----------
    pool : (nx, ny, nz) bool
        Blood pool up to the hull over its opening; papillary muscles and trabeculae belong to it.
    opening : (n, 3) int
        Voxels of the pool at its opening.
    muscle_voxels : int
        Voxels of the mask taken as papillary muscle or trabeculae.
    leaks : tuple of Leak
        Each further opening, far from the first.
    """

    pool: NDArray[np.bool_]
    opening: NDArray[np.intp]
    muscle_voxels: int
    leaks: tuple[Leak, ...]


def find_cavity(space: Space, seed_region: NDArray[np.bool_], ventricle: str) -> Cavity:
    """Find the blood pool of one ventricle and its opening.

    Parameters
    ----------
    space : Space
        What the wall leaves empty of its convex hull.
    seed_region : (nx, ny, nz) bool
        The part of the empty space that may belong to this ventricle.
    ventricle : str
        Its name in messages.

    Returns
    -------
    Cavity

    Raises
    ------
    AnatomyError
        If there is no opening.
    """
    inner_radius = float(space.depth[seed_region].max())
    whole = _with_enclosed(deepest_residue(space, seed_region), seed_region, space.hull)
    pool = without_channels(whole, space.spacing)
    muscle = _muscles(pool, space.wall, space.spacing, inner_radius)
    pool = pool | muscle
    opening = _opening(pool, space.hull, ventricle)
    far = _far(opening, pool, space.spacing, inner_radius)
    leaks = _leaks(whole | pool, space.hull, opening, far)
    outside = (~space.hull & far) | (space.empty & ~seed_region)
    pool = pool | _narrow_recesses(whole, pool, outside, space.spacing)
    return Cavity(pool, opening, int((muscle & space.wall).sum()), leaks)


def deepest_residue(space: Space, part: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Core of the deepest part of the convex hull's residue, and its surroundings.

    Parameters
    ----------
    space : Space
        What the wall leaves empty of its convex hull.
    part : (nx, ny, nz) bool
        The part of it to look in.

    Returns
    -------
    (nx, ny, nz) bool
    """
    radius = core_radius(space, part)
    cores, count = ndi.label(part & (space.depth > radius), structure=CONNECTED)
    core = cores == int(np.argmax(greatest(space.depth, cores, count))) + 1
    reach = radius + float(np.max(space.spacing))
    return np.asarray(part & near(core, reach, space.spacing))


def greatest(
    values: NDArray[np.float32], labels: NDArray[np.integer], count: int
) -> NDArray[np.float64]:
    """Greatest value in each labeled region; quick where most of the array is unlabeled.

    Parameters
    ----------
    values : (nx, ny, nz) float32
        Not negative.
    labels : (nx, ny, nz) int
        Regions 1 to count; 0 outside.
    count : int
        Number of regions.

    Returns
    -------
    (count,) float64
    """
    inside = labels > 0
    out = np.zeros(count + 1)
    np.maximum.at(out, labels[inside], values[inside])
    return out[1:]


def core_radius(space: Space, part: NDArray[np.bool_]) -> float:
    """Depth from which voxels are the core of a part of the empty space, mm.

    Parameters
    ----------
    space : Space
        What the wall leaves empty of its convex hull.
    part : (nx, ny, nz) bool
        A part of it.
    """
    return max(CORE_DEPTH * float(space.depth[part].max()), float(np.min(space.spacing)))


def without_channels(pool: NDArray[np.bool_], spacing: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Pool without channels too narrow to be blood: opening by a small ball, largest part.

    Parameters
    ----------
    pool : (nx, ny, nz) bool
        What is taken for blood, channels and all.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    (nx, ny, nz) bool
    """
    radius = CHANNEL_RADIUS * float(np.min(spacing))
    core = inner_distance(pool, spacing) > radius
    parts, count = ndi.label(core, structure=CONNECTED)
    if count > 1:
        sizes = ndi.sum_labels(core, parts, np.arange(1, count + 1))
        core = parts == int(np.argmax(sizes)) + 1
    reach = radius + 0.5 * float(np.max(spacing))
    return np.asarray(pool & near(core, reach, spacing))


def exposure(
    labels: NDArray[np.integer], hull: NDArray[np.bool_], which: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Share of the faces of each labeled region that lies on the hull.

    Parameters
    ----------
    labels : (nx, ny, nz) int
        Numbers of the regions; 0 outside.
    hull : (nx, ny, nz) bool
        The convex hull.
    which : (n,) int
        Numbers of the regions asked for.

    Returns
    -------
    (n,) float64
    """
    on_hull, faces = _faces(labels, ~hull, which), _faces(labels, labels == 0, which)
    return np.asarray(on_hull / np.maximum(faces, 1))


def _with_enclosed(
    pool: NDArray[np.bool_], empty: NDArray[np.bool_], hull: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Pool and all enclosed parts of the residue."""
    rest, count = ndi.label(empty & ~pool)
    if count == 0:
        return pool
    enclosed = exposure(rest, hull, np.arange(1, count + 1)) < EXPOSED
    return np.asarray(pool | np.concatenate([[False], enclosed])[rest])


def _faces(
    labels: NDArray[np.integer], outside: NDArray[np.bool_], which: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Number of voxel faces that each labeled region shares with `outside`."""
    count = np.zeros(labels.shape, dtype=np.int16)
    for axis in range(3):
        for step in (-1, 1):
            count += np.roll(outside, step, axis)
    return np.asarray(ndi.sum_labels(count, labels, which))


def _muscles(
    pool: NDArray[np.bool_],
    wall: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    inner_radius: float,
) -> NDArray[np.bool_]:
    """What a ball of the muscles' size cannot enter from outside: a closing of the pool."""
    radius = MUSCLE_RADIUS * inner_radius
    box = box_around(pool, radius, spacing)
    blood, out = pool[box], np.zeros_like(pool)
    distance = inner_distance(~blood, spacing)
    closed = inner_distance(distance <= radius, spacing) > radius
    deep = inner_distance(wall[box] | blood, spacing) > MUSCLE_CLEARANCE * inner_radius
    parts, count = ndi.label(closed & ~blood & deep, structure=CONNECTED)
    thick = greatest(distance, parts, count) > MUSCLE_DEPTH * np.max(spacing)
    out[box] = np.concatenate([[False], thick])[parts]
    return out


def _opening(pool: NDArray[np.bool_], hull: NDArray[np.bool_], ventricle: str) -> NDArray[np.intp]:
    """Largest patch of the pool's voxels next to the outside of the hull."""
    valve_plane = pool & ndi.binary_dilation(~hull)
    parts, count = ndi.label(valve_plane, structure=CONNECTED)
    if count == 0:
        raise AnatomyError(
            f"the cavity of the {ventricle} ventricle has no opening: the wall closes all around "
            "it; crop the mask below the valves so that the ventricle is open at the base"
        )
    sizes = ndi.sum_labels(valve_plane, parts, np.arange(1, count + 1))
    return np.argwhere(parts == int(np.argmax(sizes)) + 1)


def _far(
    opening: NDArray[np.intp],
    pool: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    inner_radius: float,
) -> NDArray[np.bool_]:
    """Voxels that are farther from a pool's opening than its inner radius."""
    valve_plane = np.zeros_like(pool)
    valve_plane[tuple(opening.T)] = True
    return ~near(valve_plane, inner_radius, spacing)


def _leaks(
    pool: NDArray[np.bool_],
    hull: NDArray[np.bool_],
    opening: NDArray[np.intp],
    far: NDArray[np.bool_],
) -> tuple[Leak, ...]:
    """Places far from the opening where the pool, channels included, gets outside."""
    parts, _ = ndi.label(pool)
    joined = parts == parts[tuple(opening[0])]
    parts, count = ndi.label(joined & ndi.binary_dilation(~hull) & far, structure=CONNECTED)
    numbers = range(1, count + 1)
    centers = ndi.center_of_mass(parts > 0, parts, numbers)
    sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:]
    return tuple(
        Leak(int(size), np.asarray(center)) for size, center in zip(sizes, centers, strict=True)
    )


def _narrow_recesses(
    whole: NDArray[np.bool_],
    pool: NDArray[np.bool_],
    outside: NDArray[np.bool_],
    spacing: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """What is as narrow as a channel, but leads nowhere: corners where two walls meet."""
    thin, count = ndi.label(whole & ~pool)
    core = inner_distance(whole, spacing) > CHANNEL_RADIUS * float(np.min(spacing))
    elsewhere = ndi.binary_dilation(outside) | core
    leading = np.zeros(count + 1, dtype=bool)
    leading[thin[elsewhere]] = True
    leading[0] = True
    return np.asarray(~leading[thin])
