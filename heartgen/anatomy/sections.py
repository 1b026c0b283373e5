"""Parts of the heart in the slices of a short-axis stack: filled heart and blood pools.

The stack is turned so that its slices run from apex to base; slices that cannot be read are left
out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from skimage.morphology import convex_hull_image

from heartgen.anatomy.following import (
    LEAST_POOL,
    behind_gaps,
    closing,
    follow_pools,
    grown,
    holes_of,
    least_second,
    whole_pools,
)
from heartgen.errors import AnatomyError
from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD, Finding
from heartgen.images.stack import Stack, with_border

Pixels = NDArray[np.bool_]

ISLAND = 0.05
"""Area over that of the largest piece of a slice below which a piece is no part of the heart."""

SECOND_SLICES = 0.25
"""Share of the slices with a pool in which a second one tells by itself that a heart has two."""

FAINT = 0.03
"""Area over that of the largest pool of all slices up to which a hole is none of two pools."""

BROKEN = 3
"""Pixels: radius of the disc, at most, that closes gaps in the walls of all slices."""

LEAST_SHARE = 0.5
"""Share of the slices in which a short-axis stack shows the left ventricle's pool."""

THIN = 25.0
"""Percentile of the thickness of a wall, over its pixels, that tells it."""

FREE = 0.6
"""Thickness of the outer wall of a second pool over that of the first up to which it is a right
ventricle, be it seen in one slice: muscles in a left one part its pool, but not its wall."""

TAPERED = 1.5
"""Area of the right pool in the two slices at its one end over that at its other end from which it
tells where the apex is."""

SWOLLEN = 2.0
"""Area of a heart in an end slice without a pool, over that in the slice at the other end, from
which it is no apex, but a base that was filled."""

SPECK = 0.02
"""Area over that of the largest pool up to which what is found in a slice at an end is a hole in
its wall rather than a pool."""

INCOMPLETE = 2
"""Slices at the base, at most, that show only a part of the wall, or of the valves above it."""

CLOSED, LEAST_RING = 0.95, 0.6
"""Share of the border of a labeled pool at which there is wall, or the other pool, from which the
wall has no gap, and from which the slice may be the uppermost: valves leave it open at less."""

WIDE = 0.4
"""Area of the left pool in the uppermost slice, at least, over the largest, if there are no labels:
there it opens. A smaller one behind a gap is what valves and parts of the wall leave of it."""

NARROW = 0.2
"""The same if the wall has no gap there: below it, slices do not lie across the long axis."""

RIGHT_WIDE = 0.6
"""The same of the right pool: above, it closes towards the pulmonary valve, and its wall overhangs.
"""

SOLID = 0.75
"""Area of a closed apex, at least, over that of its convex hull..."""

COVERED = 0.3
"""...or share of the pool next to it that it covers, where the apex has holes..."""

NOTCH = 0.3
"""...and radius of the disc that closes these, over the radius of that pool."""


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
    shifts : (n, 2) float64
        How far each slice is shifted along the axes of its pixels, to be taken back, mm.
    """

    stack: Stack
    heart: Pixels
    left: Pixels
    right: Pixels | None
    findings: tuple[Finding, ...]
    shifts: NDArray[np.float64]

    def padded(self, pixels: int) -> Sections:
        """Return the same with more empty pixels around the heart."""
        return replace(
            self,
            stack=self.stack.padded(pixels),
            heart=with_border(self.heart, pixels),
            left=with_border(self.left, pixels),
            right=None if self.right is None else with_border(self.right, pixels),
        )


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
    if stack.blood is not None:
        walls, pools = stack.pixels, _labeled(stack.pixels, stack.blood)
        _check_choice(len(pools) > 1, ventricles)
        ring = _covered(walls, pools)
        return _oriented(stack, walls, pools, (ring < CLOSED).astype(int), ring >= LEAST_RING)
    walls, holes, largest, second = _enclosed(stack.pixels)
    if not largest.any():
        return None
    both, pools, gaps = False, np.zeros((0, *walls.shape), dtype=bool), np.zeros(0, dtype=int)
    if second.any():
        pools, gaps = follow_pools(walls, holes, int(np.argmax(second)), 2, stack)
        thick = _thickness(walls, pools)
        pools = pools[np.argsort(thick)[::-1]]
        both = _enough(largest, second) or ventricles == "biv" or min(thick) < FREE * max(thick)
    _check_choice(both, ventricles)
    if not both:
        pools, gaps = follow_pools(walls, holes, int(np.argmax(largest)), 1, stack)
    area = pools[0].sum(axis=(1, 2))
    return _oriented(stack, walls, pools, gaps, (area >= WIDE * area.max()) | (gaps == 0))


def _check_choice(both: bool, ventricles: str) -> None:
    """Raise if the slices do not show the ventricles that they must."""
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


def _labeled(walls: Pixels, blood: NDArray[np.uint8]) -> Pixels:
    """Pools (1 or 2, n, nx, ny) as the labels tell them, without specks."""
    pools: list[Pixels] = []
    for code in (LEFT_BLOOD, RIGHT_BLOOD):
        pool = np.asarray(blood == code)
        least = SPECK * pool.sum(axis=(1, 2)).max()
        pool = np.stack([_without_specks(p, max(LEAST_POOL, least)) for p in pool])
        if pool.any() or not pools:
            pools.append(pool)
    return whole_pools(walls, np.stack(pools))


def _without_specks(pool: Pixels, least: float) -> Pixels:
    """A pool (nx, ny) without pieces smaller than an area, pixels."""
    pieces, count = ndi.label(pool)
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    return np.asarray((sizes >= least)[pieces])


def _covered(walls: Pixels, pools: Pixels) -> NDArray[np.float64]:
    """Share (n,) of the border of the left pool in each slice at which there is wall or pool."""
    share = np.zeros(len(walls))
    for n, (wall, left) in enumerate(zip(walls, pools[0], strict=True)):
        if left.any():
            border = ndi.binary_dilation(left, iterations=2) & ~left
            near = ndi.binary_dilation(wall | pools[1:, n].any(0))
            share[n] = (border & near).sum() / border.sum()
    return share


def _enclosed(
    pixels: Pixels,
) -> tuple[Pixels, list[NDArray[np.int32]], NDArray[np.intp], NDArray[np.intp]]:
    """Walls without islands, holes in them, and areas (n,) of the two largest in each slice.

    If there are no two pools, one may be open to the outside in all slices, because the right
    ventricle's wall may be a pixel wide: gaps are closed by the disc that shows two in the most.
    """
    found = []
    for radius in range(BROKEN + 1):
        walls = np.stack([_without_islands(wall, radius) for wall in pixels])
        holes = [behind_gaps(wall, radius) if radius else holes_of(wall) for wall in walls]
        found.append((walls, holes, *_two_largest(holes)))
        if radius == 0 and _enough(*found[0][2:]):
            return found[0]
    best = max(found, key=lambda each: int(np.sum(each[3] > 0)))
    if _enough(*best[2:]):
        return best
    return next((each for each in found if each[2].any()), found[0])


def _two_largest(
    holes: list[NDArray[np.int32]],
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Areas (n,) of the largest and the second pool of each slice; 0 where there is none."""
    areas = [np.sort(np.bincount(h.ravel(), minlength=3)[1:])[::-1] for h in holes]
    largest = np.array([a[0] if a[0] >= LEAST_POOL else 0 for a in areas])
    least = [max(least_second(area), FAINT * largest.max()) for area in largest]
    second = [a[1] if a[1] >= size else 0 for a, size in zip(areas, least, strict=True)]
    return largest, np.array(second)


def _enough(largest: NDArray[np.intp], second: NDArray[np.intp]) -> bool:
    """Whether a second pool is seen in enough of the slices that show a pool."""
    return bool(np.sum(second > 0) >= max(2, SECOND_SLICES * np.sum(largest > 0)))


def _without_islands(wall: Pixels, radius: int) -> Pixels:
    """A slice without pieces much smaller than the largest, once both grow by a disc."""
    pieces, count = ndi.label(grown(wall, radius) if radius else wall, np.ones((3, 3)))
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    return np.asarray((sizes >= ISLAND * sizes.max())[pieces] & wall)


def _thickness(walls: Pixels, pools: Pixels) -> tuple[float, float]:
    """Thickness of the walls of two pools where they do not lie between both, pixels.

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
    first, second = (
        float(np.percentile(np.concatenate(t), THIN)) if t and sum(map(len, t)) else 0.0
        for t in thick
    )
    return first, second


def _points_down(hearts: Pixels, pools: Pixels) -> bool:
    """Whether the apex is at the upper end of the slices, told by the pools (., n, nx, ny)."""
    if len(pools) > 1:
        right = pools[1].sum(axis=(1, 2))
        low, high = (float(part.sum()) for part in (right[right > 0][:2], right[right > 0][-2:]))
        if max(low, high) > TAPERED * min(low, high):
            return low > high
    pool, area = pools[0], pools[0].sum(axis=(1, 2))
    has = np.flatnonzero(area > SPECK * area.max())
    first, last = has[0], has[-1]
    if (first == 0) == (last == len(area) - 1):
        return bool(area[first] > area[last])
    # One end has no pool: the apex if muscle closes it, the base if the wall is open or filled.
    size = hearts.sum(axis=(1, 2))
    if first > 0:
        filled = size[first - 1] > SWOLLEN * size[-1]
        return filled or not _closes(hearts[first - 1], pool[first])
    filled = size[last + 1] > SWOLLEN * size[0]
    return not filled and _closes(hearts[last + 1], pool[last])


def _closes(beyond: Pixels, pool: Pixels) -> bool:
    """Whether what the slice beyond the last pool shows is the muscle of an apex."""
    pieces, _ = ndi.label(beyond, np.ones((3, 3)))
    largest = pieces == np.bincount(pieces.ravel())[1:].argmax() + 1
    hull: Pixels = convex_hull_image(largest)  # type: ignore[no-untyped-call]
    radius = int(np.ceil(NOTCH * np.sqrt(pool.sum() / np.pi)))
    filled = ndi.binary_fill_holes(closing(largest, radius))
    covered = (filled & pool).sum() / pool.sum()
    return bool(largest.sum() >= SOLID * hull.sum() or covered > COVERED)


def _oriented(
    stack: Stack,
    walls: Pixels,
    pools: Pixels,
    gaps: NDArray[np.intp],
    closed: NDArray[np.bool_],
) -> Sections | None:
    """Sections from apex to base, without slices whose pool could not be found.

    The uppermost slice shows the left pool, in a wall that is `closed` (n,), and the right pool if
    there is one.
    """
    if _points_down(walls | pools.any(0), pools):
        stack, walls, pools = stack.reversed(), walls[::-1], pools[:, ::-1]
        gaps, closed = gaps[::-1], closed[::-1]
    area = pools[0].sum(axis=(1, 2))
    has = np.flatnonzero(area)
    complete = np.flatnonzero((area > 0) & closed)
    if not len(complete):
        return None
    top = complete[-1]
    wide = area[top] >= (WIDE if gaps[top] else NARROW) * area.max()
    if len(has) < LEAST_SHARE * len(area) or len(area) - 1 - top > INCOMPLETE or not wide:
        return None
    index = np.arange(len(area))
    keep = ((area > 0) | (index < has[0])) & (index <= top)
    findings = []
    if not keep.all():
        findings.append(
            Finding(
                "slices",
                f"slice(s) {_numbers(~keep)} of {len(keep)}, from the apex, were left out: they "
                "show no pool that their wall encloses",
            )
        )
    above = np.zeros_like(keep)
    if len(pools) > 1:
        right = pools[1].sum(axis=(1, 2))
        enough = np.flatnonzero(keep & (right >= RIGHT_WIDE * right[keep].max()))
        above = keep & (index > enough[-1])
    if above.any():
        keep &= ~above
        findings.append(
            Finding(
                "slices",
                f"slice(s) {_numbers(above)} of {len(keep)}, from the apex, were left out: they "
                "show the left ventricle above the right one, and the mesh ends where both do",
            )
        )
    if gaps[keep].any():
        findings.append(
            Finding("gaps", f"gaps in the wall of {int(np.sum(gaps > 0))} slice(s) were closed")
        )
    stack = stack.part(keep)
    blood = pools[:, keep]
    heart = [
        ndi.binary_fill_holes(w | p.any(0))
        for w, p in zip(walls[keep], blood.swapaxes(0, 1), strict=True)
    ]
    right = blood[1] if len(blood) > 1 else None
    none = np.zeros((len(heart), 2))
    return Sections(stack, np.stack(heart), blood[0], right, tuple(findings), none)


def _numbers(chosen: NDArray[np.bool_]) -> str:
    """Numbers, from 1, of what is chosen (n,)."""
    return ", ".join(str(n + 1) for n in np.flatnonzero(chosen))
