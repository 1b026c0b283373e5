"""The blood pool: the deep, enclosed part of what the convex hull adds to the myocardium."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.hull import convex_hull
from heartgen.errors import AnatomyError
from heartgen.images.distance import inner_distance

CORE_DEPTH = 0.15
"""Depth of the pool's core below its surface, over the pool's greatest depth: cuts the pool off
from hollows on the outside of the heart that it touches over a low rim or through a pin-hole."""

EXPOSED = 0.3
"""Share of a pocket's faces on the hull above which it lies outside the wall."""

MIN_DEPTH = 2.0
"""Least inner radius of a pool, in voxels."""

RIVAL = 0.4
"""Inner radius over the largest pool's from which a second enclosed pool is a second ventricle."""

MUSCLE_RADIUS = 0.4
"""Papillary muscles and trabeculae up to this radius, over the pool's inner radius, are pool."""

MUSCLE_DEPTH = 1.5
"""Voxels; what a closing adds in a thinner layer is rounding of the voxel surface, not muscle."""

SECOND_OPENING = 0.9
"""Size over the opening's from which a further opening is the other end of a tube."""

MUSCLE_CLEARANCE = 0.2
"""Distance from the outside, over the pool's inner radius, within which there is wall alone."""

CHANNEL_RADIUS = 1.5
"""Voxels; narrower channels of the pool are pin-holes of the wall, not pool."""

_CONNECTED = np.ones((3, 3, 3), dtype=bool)


@dataclass(frozen=True)
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
    leaks : int
        Further, small openings: pin-holes of the wall.
    """

    pool: NDArray[np.bool_]
    opening: NDArray[np.intp]
    muscle_voxels: int
    leaks: int


def find_cavity(voxels: NDArray[np.bool_], spacing: NDArray[np.float64]) -> Cavity:
    """Find the blood pool of a left ventricle and its opening.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        Myocardium, with at least one empty voxel on every side.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    Cavity

    Raises
    ------
    AnatomyError
        If there is no cavity, more than one, or no opening.
    """
    hull = convex_hull(voxels)
    empty = hull & ~voxels
    depth = inner_distance(empty, spacing)
    voxel = float(np.min(spacing))
    if depth.max() < MIN_DEPTH * voxel:
        raise AnatomyError(
            "no cavity found: the mask fills its convex hull; give a mask of the myocardium "
            "without the blood pool"
        )
    whole = _grow(empty, depth, hull, spacing)
    pool = _without_channels(whole, spacing)
    muscle = _muscles(pool, voxels, spacing, float(depth.max()))
    pool = pool | muscle
    opening = _opening(pool, hull)
    leaks = _leaks(whole | pool, hull, opening, spacing, float(depth.max()))
    if max(leaks, default=0) > SECOND_OPENING * len(opening):
        raise AnatomyError(
            "the cavity is open at both ends: a left ventricle is open at the base and closed at "
            "the apex; check that the mask reaches the apex"
        )
    return Cavity(pool, opening, int((muscle & voxels).sum()), len(leaks))


def _grow(
    empty: NDArray[np.bool_],
    depth: NDArray[np.float32],
    hull: NDArray[np.bool_],
    spacing: NDArray[np.float64],
) -> NDArray[np.bool_]:
    """Core of the deepest pocket, its surroundings, and all enclosed pockets."""
    radius = max(CORE_DEPTH * float(depth.max()), float(np.min(spacing)))
    cores, _ = ndi.label(depth > radius, structure=_CONNECTED)
    greatest = ndi.maximum(depth, cores, np.arange(1, cores.max() + 1))
    main = int(np.argmax(greatest)) + 1
    core = cores == main
    near = inner_distance(~core, spacing) <= radius + float(np.max(spacing))
    pool = empty & near
    rest, count = ndi.label(empty & ~pool)
    if count:
        labels = np.arange(1, count + 1)
        on_hull, faces = _faces(rest, ~hull, labels), _faces(rest, rest == 0, labels)
        enclosed = on_hull < EXPOSED * faces
        rivals = np.unique(rest[np.isin(cores, np.flatnonzero(greatest > RIVAL * depth.max()) + 1)])
        rivals = rivals[(rivals > 0) & enclosed[np.maximum(rivals - 1, 0)]]
        if len(rivals):
            raise AnatomyError(
                f"{1 + len(rivals)} blood pools found where a left ventricle has one: the mask "
                "looks biventricular; give a mask of the left ventricle alone"
            )
        pool |= np.concatenate([[False], enclosed])[rest]
    return np.asarray(pool)


def _faces(
    labels: NDArray[np.integer], outside: NDArray[np.bool_], which: NDArray[np.intp]
) -> NDArray[np.float64]:
    """Number of voxel faces that each labelled region shares with `outside`."""
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
    distance = inner_distance(~pool, spacing)
    closed = inner_distance(distance <= radius, spacing) > radius
    deep = inner_distance(wall | pool, spacing) > MUSCLE_CLEARANCE * inner_radius
    added = closed & ~pool & deep
    parts, count = ndi.label(added, structure=_CONNECTED)
    if count == 0:
        return added
    thick = ndi.maximum(distance, parts, np.arange(1, count + 1)) > MUSCLE_DEPTH * np.max(spacing)
    return np.asarray(np.concatenate([[False], thick])[parts])


def _without_channels(pool: NDArray[np.bool_], spacing: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Pool without channels too narrow to be blood: opening by a small ball, largest part."""
    radius = CHANNEL_RADIUS * float(np.min(spacing))
    core = inner_distance(pool, spacing) > radius
    parts, count = ndi.label(core, structure=_CONNECTED)
    if count > 1:
        sizes = ndi.sum_labels(core, parts, np.arange(1, count + 1))
        core = parts == int(np.argmax(sizes)) + 1
    reach = radius + 0.5 * float(np.max(spacing))
    return np.asarray(pool & (inner_distance(~core, spacing) <= reach))


def _opening(pool: NDArray[np.bool_], hull: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Largest patch of the pool's voxels next to the outside of the hull."""
    lid = pool & ndi.binary_dilation(~hull)
    parts, count = ndi.label(lid, structure=_CONNECTED)
    if count == 0:
        raise AnatomyError(
            "the cavity has no opening: the wall closes all around it; crop the mask below the "
            "valves so that the ventricle is open at the base"
        )
    sizes = ndi.sum_labels(lid, parts, np.arange(1, count + 1))
    return np.argwhere(parts == int(np.argmax(sizes)) + 1)


def _leaks(
    pool: NDArray[np.bool_],
    hull: NDArray[np.bool_],
    opening: NDArray[np.intp],
    spacing: NDArray[np.float64],
    inner_radius: float,
) -> list[int]:
    """Sizes of the places far from the opening where the pool, channels included, gets outside."""
    away = np.ones_like(pool)
    away[tuple(opening.T)] = False
    far = inner_distance(away, spacing) > inner_radius
    parts, _ = ndi.label(pool)
    joined = parts == parts[tuple(opening[0])]
    parts, _ = ndi.label(joined & ndi.binary_dilation(~hull) & far, structure=_CONNECTED)
    return [int(size) for size in np.bincount(parts.ravel())[1:]]
