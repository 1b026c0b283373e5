"""Blood pools in the slices of a stack, followed from one slice to the next.

A pool is what the wall encloses in the plane of a slice, after gaps in it are closed if need be.
The pools of neighboring slices are told apart by their overlap, so that neither the walls of
neighboring slices need to touch nor the slices need to lie on each other exactly.
"""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from skimage.morphology import disk
from skimage.segmentation import expand_labels

from heartgen.images.levelset import INSIDE, smooth_indicator
from heartgen.images.stack import Stack

Pixels = NDArray[np.bool_]

LEAST_POOL = 9
"""Pixels of the smallest pool: three by three."""

SECOND_POOL = 0.1
"""Area over that of the largest pool of a slice from which another one counts as a pool."""

REACH = 0.5
"""Distance between the pools of neighboring slices, over that of the slices, up to which they
belong together."""

SEEN_AGAIN = 0.4
"""Share of the smaller of two pools of neighboring slices that must overlap if a gap in the wall
had to be closed to find one."""

WIDEST_GAP = 0.8
"""Radius of the disc that closes gaps in a wall, at most, over the radius of the pool."""

JOINED = 0.5
"""Share of both pools of the slice before that a single pool covers if the septum has a gap."""

SHRUNK = 0.3
"""Area over that of the pool of the next slice below which it is looked for behind gaps, too."""

SQUARE = np.ones((2, 2), dtype=bool)
"""Narrower channels through a wall are no pool."""

SLIT = 1
"""Pixels: radius of the disc that closes slits through a wall, which are up to two pixels wide."""

CLEARANCE = 1.5
"""Pixels of wall that are kept outside of a pool whose parts are joined."""


def follow_pools(
    walls: Pixels, holes: list[NDArray[np.int32]], seed: int, pools: int, stack: Stack
) -> tuple[Pixels, NDArray[np.intp]]:
    """Pools (pools, n, nx, ny) followed from one slice to the next, and the gaps closed (n,).

    Parameters
    ----------
    walls : (n, nx, ny) bool
        Myocardium in each slice.
    holes : list of (nx, ny) int
        Numbers of the regions that the wall encloses in each slice.
    seed : int
        Number of the slice to start from.
    pools : {1, 2}
        How many to follow.
    stack : Stack
        The slices.
    """
    found = np.zeros((pools, *walls.shape), dtype=bool)
    gaps = np.zeros(len(walls), dtype=int)
    sizes = np.bincount(holes[seed].ravel())
    sizes[0] = 0
    for p, number in enumerate(np.argsort(sizes)[::-1][:pools]):
        found[p, seed] = holes[seed] == number
    for way in (1, -1):
        last = found[:, seed].copy()
        for n in range(seed + way, len(walls) if way > 0 else -1, way):
            found[:, n], gaps[n] = _matched(walls[n], holes[n], last, stack)
            for p in range(pools):
                if found[p, n].any():
                    last[p] = found[p, n]
    return whole_pools(walls, found), gaps


def whole_pools(walls: Pixels, pools: Pixels) -> Pixels:
    """Pools (pools, n, nx, ny) with what stands in them, without those too thin for a contour.

    Parameters
    ----------
    walls : (n, nx, ny) bool
        Myocardium in each slice.
    pools : (pools, n, nx, ny) bool
        Blood in each slice.
    """
    found = pools.copy()
    for n, wall in enumerate(walls):
        filled = ndi.binary_fill_holes(wall | found[:, n].any(0))
        for p in range(len(found)):
            pool = _joined(found[p, n], filled) & ~found[:p, n].any(0)
            found[p, n] = pool if smooth_indicator(pool).max() > INSIDE else False
    return found


def holes_of(wall: Pixels) -> NDArray[np.int32]:
    """Numbers, from 1, of the regions that a wall encloses.

    Parameters
    ----------
    wall : (nx, ny) bool
        Myocardium in a slice.
    """
    return np.asarray(ndi.label(ndi.binary_fill_holes(wall) & ~wall)[0], dtype=np.int32)


def least_second(largest: int) -> float:
    """Area from which a pool beside one of the given area counts.

    Parameters
    ----------
    largest : int
        Area of the larger pool, pixels.
    """
    return max(LEAST_POOL, SECOND_POOL * largest)


def closing(shape: Pixels, radius: int) -> Pixels:
    """Closing (nx, ny) by a disc, pixels, which the border of the image does not cut.

    Parameters
    ----------
    shape : (nx, ny) bool
        What to close.
    radius : int
        Of the disc, pixels.
    """
    ball: Pixels = disk(radius).astype(bool)  # type: ignore[no-untyped-call]
    inside = (slice(radius, -radius),) * 2
    return np.asarray(shape | ndi.binary_closing(np.pad(shape, radius), ball)[inside])


def without_slits(heart: Pixels, pools: Pixels) -> Pixels:
    """Filled heart (nx, ny) whose wall has no slits that lead to a pool.

    Concave corners of the wall stay as they are.

    Parameters
    ----------
    heart, pools : (nx, ny) bool
        Wall and pools together, and pools, in a slice.
    """
    around = np.ones((3, 3), dtype=bool)
    pieces, _ = ndi.label(closing(heart, SLIT) & ~heart, around)
    through = np.unique(pieces[ndi.binary_dilation(pools, around)])
    return np.asarray(heart | np.isin(pieces, through[through > 0]))


def grown(shape: Pixels, radius: int) -> Pixels:
    """Dilation (nx, ny) by a disc, pixels.

    Parameters
    ----------
    shape : (nx, ny) bool
        What to grow.
    radius : int
        Of the disc, pixels.
    """
    return np.asarray(ndi.distance_transform_edt(~shape) <= radius)


def behind_gaps(wall: Pixels, radius: int) -> NDArray[np.int32]:
    """Regions that a wall encloses once its gaps are closed by a disc, without thin channels.

    They are the regions that a disc inside cannot leave (a wall may be a pixel wide, in which a
    morphological closing closes no gap), grown into the corners that the disc does not reach.

    Parameters
    ----------
    wall : (nx, ny) bool
        Myocardium in a slice.
    radius : int
        Of the disc, pixels.
    """
    reached, _ = ndi.label(np.pad(~grown(wall, radius), 1, constant_values=True))
    region = expand_labels(reached, 2 * radius + 1)[1:-1, 1:-1]  # type: ignore[no-untyped-call]
    inside = (region > 0) & (region != reached[0, 0]) & ~wall
    return np.asarray(ndi.label(ndi.binary_opening(inside, SQUARE))[0], dtype=np.int32)


def _matched(
    wall: Pixels, holes: NDArray[np.int32], last: Pixels, stack: Stack
) -> tuple[Pixels, int]:
    """Pools of a slice, told by those of the slice before, and the radius of gaps closed for it."""
    found = _assigned(holes, last, stack)
    closed = 0
    for p, before in enumerate(last):
        area = int(before.sum())
        if found[p].sum() >= SHRUNK * area or area < LEAST_POOL:
            continue
        widest = int(np.ceil(WIDEST_GAP * np.sqrt(area / np.pi)))
        for radius in range(1, widest + 1):
            behind = behind_gaps(wall, radius)
            again = _assigned(behind, last, stack)[p] & ~found.any(0)
            least = min(int(again.sum()), area)
            if least > max(SHRUNK * area, LEAST_POOL) and (
                (again & before).sum() > SEEN_AGAIN * least
            ):
                found[p], closed = again, radius
                break
    return found, closed


def _assigned(holes: NDArray[np.int32], last: Pixels, stack: Stack) -> Pixels:
    """Holes (pools, nx, ny) given to the pools of the slice before.

    The largest holes go to different pools, all others to the nearest.
    """
    found = np.zeros_like(last)
    sizes = np.bincount(holes.ravel())[1:]
    if len(sizes) == 0:
        return found
    away = np.stack([_distance_to(before, stack.spacing) for before in last])
    numbers = np.arange(1, len(sizes) + 1)
    mean = np.stack([ndi.mean(a, holes, numbers) for a in away])
    near = np.stack([ndi.minimum(a, holes, numbers) for a in away]) <= REACH * stack.distance
    owner = mean.argmin(0)
    largest = np.argsort(sizes)[::-1][: len(last)]
    if len(last) == 2 and len(largest) == 2 and sizes[largest].min() >= least_second(sizes.max()):
        apart = np.stack([_distance_to(holes == numbers[i], stack.spacing) for i in largest], -1)
        back = np.stack([apart[before].mean(0) if before.any() else 0 for before in last])
        cost = np.where(np.isfinite(mean[:, largest]), mean[:, largest], 0) + back
        owner[largest] = (0, 1) if np.trace(cost) <= np.trace(cost[:, ::-1]) else (1, 0)
    for i, number in enumerate(numbers):
        hole = holes == number
        shares = [(hole & before).sum() / max(before.sum(), 1) for before in last]
        if (
            len(last) == 2
            and len(sizes[sizes >= least_second(sizes.max())]) == 1
            and min(shares) > JOINED
        ):
            found |= hole & (away == away.min(0))  # there is a gap in the septum
        elif near[owner[i], i] and (
            i in largest or shares[owner[i]] * last[owner[i]].sum() > hole.sum() / 2
        ):
            found[owner[i]] |= hole
    return found


def _distance_to(shape: Pixels, spacing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of every pixel to a shape, mm; infinite to an empty one."""
    if not shape.any():
        return np.full(shape.shape, np.inf)
    return np.asarray(ndi.distance_transform_edt(~shape, sampling=spacing))


def _joined(pool: Pixels, filled: Pixels) -> Pixels:
    """A pool with what stands in it: islands, and muscles between its parts."""
    pool = np.asarray(ndi.binary_fill_holes(pool))
    _, parts = ndi.label(pool)
    if parts < 2:
        return pool
    radius = int(np.ceil(np.sqrt(pool.sum() / np.pi) / 2))
    inside = np.asarray(ndi.distance_transform_edt(filled)) > CLEARANCE
    return np.asarray(ndi.binary_fill_holes(pool | (closing(pool, radius) & inside)))
