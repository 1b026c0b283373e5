"""Parts of the heart in the slices of a short-axis stack: filled heart and blood pools.

A pool is what the wall encloses in the plane of a slice. The pools of neighbouring slices are told
apart by their overlap, so that neither the walls of neighbouring slices need to touch nor the
slices need to lie on each other exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from skimage.morphology import convex_hull_image, disk

from heartgen.errors import AnatomyError
from heartgen.images.levelset import INSIDE, smooth_indicator
from heartgen.images.mask import Finding
from heartgen.images.stack import Stack

Pixels = NDArray[np.bool_]

ISLAND = 0.05
"""Area over that of the largest piece of a slice below which a piece is no part of the heart."""

LEAST_POOL = 9
"""Pixels of the smallest pool: three by three."""

SECOND_POOL = 0.1
"""Area over that of the largest pool of a slice from which another one counts as a pool."""

SECOND_SLICES = 0.25
"""Share of the slices with a pool in which there must be a second one in a heart with two."""

REACH = 0.5
"""Distance between the pools of neighbouring slices, over that of the slices, up to which they
belong together."""

SEEN_AGAIN = 0.4
"""Share of the smaller of two pools of neighbouring slices that must overlap if a gap in the wall
had to be closed to find one."""

WIDEST_GAP = 0.8
"""Radius of the disc that closes gaps in a wall, at most, over the radius of the pool."""

LEAST_SHARE = 0.5
"""Share of the slices in which a short-axis stack shows the left ventricle's pool."""

JOINED = 0.5
"""Share of both pools of the slice before that a single pool covers if the septum has a gap."""

THIN = 25.0
"""Percentile of the thickness of a wall, over its pixels, that tells it."""

SHRUNK = 0.3
"""Area over that of the pool of the next slice below which it is looked for behind gaps, too."""

INCOMPLETE = 2
"""Slices at the base, at most, that show only a part of the wall."""

WIDE = 0.4
"""Area of the pool in the uppermost slice, at least, over the largest: there it opens."""

SOLID = 0.75
"""Area of a closed apex, at least, over that of its convex hull."""

SQUARE = np.ones((2, 2), dtype=bool)
"""Narrower channels through a wall are no pool."""

CLEARANCE = 1.5
"""Pixels of wall that are kept outside of a pool whose parts are joined."""


@dataclass(frozen=True)
class Sections:
    """Parts of the heart in each slice, from apex to base.

    Attributes
    ----------
    stack : Stack
        Its slices in order from apex to base, without those that could not be read.
    heart : (n, nx, ny) bool
        Wall and pools together.
    left : (n, nx, ny) bool
        Pool of the left ventricle; empty in slices below it.
    right : (n, nx, ny) bool or None
        Pool of the right ventricle; None if there is none.
    findings : tuple of Finding
        What had to be mended.
    """

    stack: Stack
    heart: Pixels
    left: Pixels
    right: Pixels | None
    findings: tuple[Finding, ...]


def find_sections(stack: Stack, ventricles: str = "auto") -> Sections | None:
    """Find the parts of the heart in the slices of a stack.

    Parameters
    ----------
    stack : Stack
    ventricles : {"auto", "lv", "biv"}
        What the slices must show: a left ventricle alone, both, or either.

    Returns
    -------
    Sections or None
        None if the slices do not lie across the long axis: most of them show no enclosed pool, or
        it is not wide at either end of the stack.

    Raises
    ------
    AnatomyError
        If there are too few slices, no cavity, or not what `ventricles` asks for.
    """
    walls = np.stack([_without_islands(wall) for wall in stack.pixels])
    holes = [_holes(wall) for wall in walls]
    areas = [np.sort(np.bincount(h.ravel())[1:])[::-1] for h in holes]
    largest = np.array([a[0] if len(a) and a[0] >= LEAST_POOL else 0 for a in areas])
    if not largest.any():
        return None
    second = np.array([a[1] if len(a) > 1 and a[1] >= _least(a[0]) else 0 for a in areas])
    both = np.sum(second > 0) >= max(2, SECOND_SLICES * np.sum(largest > 0))
    if both and ventricles == "lv":
        raise AnatomyError(
            "two blood pools found where a left ventricle has one: the mask is biventricular; "
            "analyse both ventricles, or give a mask of the left ventricle alone"
        )
    if not both and ventricles == "biv":
        raise AnatomyError(
            "one blood pool found where a biventricular heart has two: the mask shows a left "
            "ventricle alone, or a right ventricle that is not enclosed by its wall"
        )
    seed = int(np.argmax(second if both else largest))
    pools, gaps = _followed(walls, holes, seed, 2 if both else 1, stack)
    if both and _thickness(walls, pools) < 0:
        pools = pools[::-1]
    return _oriented(stack, walls, pools, gaps)


def _without_islands(wall: Pixels) -> Pixels:
    """A slice without pieces much smaller than the largest."""
    pieces, count = ndi.label(wall, np.ones((3, 3)))
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    return np.asarray((sizes >= ISLAND * sizes.max())[pieces] & wall)


def _holes(wall: Pixels) -> NDArray[np.int32]:
    """Numbers, from 1, of the regions that a wall encloses."""
    return np.asarray(ndi.label(ndi.binary_fill_holes(wall) & ~wall)[0], dtype=np.int32)


def _followed(
    walls: Pixels, holes: list[NDArray[np.int32]], seed: int, pools: int, stack: Stack
) -> tuple[Pixels, NDArray[np.intp]]:
    """Pools (pools, n, nx, ny) followed from one slice to the next, and the gaps closed (n,)."""
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
    for n, wall in enumerate(walls):
        filled = ndi.binary_fill_holes(wall | found[:, n].any(0))
        for p in range(pools):
            pool = _joined(found[p, n], filled) & ~found[:p, n].any(0)
            found[p, n] = pool if smooth_indicator(pool).max() > INSIDE else False
    return found, gaps


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
            behind = _behind_gaps(wall, radius)
            again = _assigned(behind, last, stack)[p] & ~found.any(0)
            least = min(int(again.sum()), area)
            if least > max(SHRUNK * area, LEAST_POOL) and (
                (again & before).sum() > SEEN_AGAIN * least
            ):
                found[p], closed = again, radius
                break
    return found, closed


def _behind_gaps(wall: Pixels, radius: int) -> NDArray[np.int32]:
    """Regions that a wall encloses once its gaps are closed by a disc, without thin channels."""
    inside = np.asarray(ndi.binary_fill_holes(_closed(wall, radius)) & ~wall)
    return np.asarray(ndi.label(ndi.binary_opening(inside, SQUARE))[0], dtype=np.int32)


def _closed(shape: Pixels, radius: int) -> Pixels:
    """Closing by a disc, which the border of the image does not cut."""
    ball: Pixels = disk(radius).astype(bool)  # type: ignore[no-untyped-call]
    inside = (slice(radius, -radius),) * 2
    return np.asarray(shape | ndi.binary_closing(np.pad(shape, radius), ball)[inside])


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
    if len(last) == 2 and len(largest) == 2 and sizes[largest].min() >= _least(sizes.max()):
        apart = np.stack([_distance_to(holes == numbers[i], stack.spacing) for i in largest], -1)
        back = np.stack([apart[before].mean(0) if before.any() else 0 for before in last])
        cost = np.where(np.isfinite(mean[:, largest]), mean[:, largest], 0) + back
        owner[largest] = (0, 1) if np.trace(cost) <= np.trace(cost[:, ::-1]) else (1, 0)
    for i, number in enumerate(numbers):
        hole = holes == number
        shares = [(hole & before).sum() / max(before.sum(), 1) for before in last]
        if (
            len(last) == 2
            and len(sizes[sizes >= _least(sizes.max())]) == 1
            and min(shares) > JOINED
        ):
            found |= hole & (away == away.min(0))  # there is a gap in the septum
        elif near[owner[i], i] and (
            i in largest or shares[owner[i]] * last[owner[i]].sum() > hole.sum() / 2
        ):
            found[owner[i]] |= hole
    return found


def _least(largest: int) -> float:
    """Area from which a pool beside one of the given area counts."""
    return max(LEAST_POOL, SECOND_POOL * largest)


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
    return np.asarray(ndi.binary_fill_holes(pool | (_closed(pool, radius) & inside)))


def _thickness(walls: Pixels, pools: Pixels) -> float:
    """How much thicker the wall of the first pool is than that of the second, pixels.

    Where a pool tapers, its wall is cut at a slant and looks thick: the thin parts tell.
    """
    thick: tuple[list[NDArray[np.float64]], ...] = ([], [])
    for wall, first, second in zip(walls, *pools, strict=True):
        if not (first.any() and second.any()):
            continue
        outside = ndi.distance_transform_edt(ndi.binary_fill_holes(wall | first | second))
        away = [ndi.distance_transform_edt(~pool) for pool in (first, second)]
        for which, (own, other) in enumerate((away, away[::-1])):
            thick[which].append((own + outside)[wall & (own < other) & (outside < other)])
    first, second = (float(np.percentile(np.concatenate(t), THIN)) for t in thick)
    return first - second


def _points_down(hearts: Pixels, area: NDArray[np.intp]) -> bool:
    """Whether the apex is at the upper end of the slices, told by their pools' areas (n,)."""
    has = np.flatnonzero(area)
    if (area[0] > 0) == (area[-1] > 0):
        return bool(area[has[0]] > area[has[-1]])
    # One end has no pool: the apex if it is solid, the base if the wall is open there.
    beyond = hearts[has[0] - 1] if has[0] > 0 else hearts[has[-1] + 1]
    pieces, _ = ndi.label(beyond, np.ones((3, 3)))
    largest = pieces == np.bincount(pieces.ravel())[1:].argmax() + 1
    hull: Pixels = convex_hull_image(largest)  # type: ignore[no-untyped-call]
    solid = bool(largest.sum() >= SOLID * hull.sum())
    return solid == bool(has[0] == 0)


def _oriented(
    stack: Stack, walls: Pixels, pools: Pixels, gaps: NDArray[np.intp]
) -> Sections | None:
    """Sections from apex to base, without slices whose pool could not be found."""
    area = pools[0].sum(axis=(1, 2))
    has = np.flatnonzero(area)
    if _points_down(walls | pools.any(0), area):
        stack, walls, pools, gaps = stack.reversed(), walls[::-1], pools[:, ::-1], gaps[::-1]
        area = area[::-1]
        has = np.flatnonzero(area)
    above = len(area) - 1 - has[-1]
    if (
        len(has) < LEAST_SHARE * len(area)
        or above > INCOMPLETE
        or area[has[-1]] < WIDE * area.max()
    ):
        return None
    keep = (area > 0) | (np.arange(len(area)) < has[0])
    findings = []
    if not keep.all():
        findings.append(
            Finding(
                "slices",
                f"{int(np.sum(~keep))} slice(s) were left out: their wall does not close around "
                "the pool",
            )
        )
    if gaps[keep].any():
        findings.append(
            Finding("gaps", f"gaps in the wall of {int(np.sum(gaps > 0))} slice(s) were closed")
        )
    stack = replace(stack, pixels=stack.pixels[keep], heights=stack.heights[keep])
    blood = pools[:, keep]
    heart = [
        ndi.binary_fill_holes(w | p.any(0))
        for w, p in zip(walls[keep], blood.swapaxes(0, 1), strict=True)
    ]
    right = blood[1] if len(blood) > 1 else None
    return Sections(stack, np.stack(heart), blood[0], right, tuple(findings))
