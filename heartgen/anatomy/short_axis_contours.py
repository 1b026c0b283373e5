"""Parts of the heart in the slices of a short-axis stack: filled heart and blood pools.

The stack is turned so that its slices run from apex to base; slices that cannot be read are left
out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.ends import points_down
from heartgen.anatomy.labeled import labeled_pools, ring_share
from heartgen.anatomy.slice_tracking import (
    LEAST_POOL,
    behind_gaps,
    follow_pools,
    grown,
    holes_of,
    least_second,
    without_slits,
)
from heartgen.errors import AnatomyError
from heartgen.images.mask import Finding
from heartgen.images.stack import Stack, with_border

Pixels = NDArray[np.bool_]

CLOSED, LEAST_RING = 0.95, 0.6
"""Share of the border of a labeled pool at which there is wall, or the other pool, from which the
wall has no gap, and from which the slice may be the uppermost: valves leave it open at less."""

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

INCOMPLETE = 2
"""Slices at the base, at most, that show only a part of the wall, or of the valves above it."""

WIDE = 0.4
"""Area of the left pool in the uppermost slice, at least, over the largest, if there are no labels:
there it opens. A smaller one behind a gap is what valves and parts of the wall leave of it."""

NARROW = 0.2
"""The same if the wall has no gap there: below it, slices do not lie across the long axis."""

RIGHT_WIDE = 0.6
"""The same of the right pool: above, it closes towards the pulmonary valve, and its wall overhangs.
"""


@dataclass(frozen=True, eq=False)
class ShortAxisContours:
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

    def padded(self, pixels: int) -> ShortAxisContours:
        """Return the same with more empty pixels around the heart.

        Parameters
        ----------
        pixels : int
            How many to add on each side.
        """
        return replace(
            self,
            stack=self.stack.padded(pixels),
            heart=with_border(self.heart, pixels),
            left=with_border(self.left, pixels),
            right=None if self.right is None else with_border(self.right, pixels),
        )


def find_sections(stack: Stack, ventricles: str = "auto") -> ShortAxisContours | None:
    """Find the parts of the heart in the slices of a stack.

    Parameters
    ----------
    stack : Stack
        Slices of the mask.
    ventricles : {"auto", "lv", "biv"}
        What the slices must show: a left ventricle alone, both, or either.

    Returns
    -------
    ShortAxisContours or None
        None if the slices do not lie across the long axis: most of them show no enclosed pool, or
        it is not wide at either end of the stack.

    Raises
    ------
    AnatomyError
        If there are too few slices, no cavity, or not what `ventricles` asks for.
    """
    if stack.blood is not None:
        walls, pools = stack.pixels, labeled_pools(stack.pixels, stack.blood)
        _check_choice(len(pools) > 1, ventricles)
        ring = ring_share(walls, pools)
        return _oriented(stack, walls, pools, (ring < CLOSED).astype(int), ring >= LEAST_RING)
    walls, holes, largest, second = _enclosed(stack.pixels)
    if not largest.any():
        return None
    both, pools, gaps = False, np.zeros((0, *walls.shape), dtype=bool), np.zeros(0, dtype=int)
    if second.any():
        pools, gaps = follow_pools(walls, holes, int(np.argmax(second)), 2, stack)
        thick = _thickness(walls, pools)
        left = int(np.argmax(np.multiply(thick, _roundness(pools))))
        pools = pools[[left, 1 - left]]
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
            "analyze both ventricles, or give a mask of the left ventricle alone"
        )
    if not both and ventricles == "biv":
        raise AnatomyError(
            "one blood pool found where a biventricular heart has two: the mask shows a left "
            "ventricle alone, or a right ventricle that is not enclosed by its wall"
        )


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


def _roundness(pools: Pixels) -> tuple[float, float]:
    """Area of two pools over that of the disc of their second moments; 1 is round.

    Median over the slices that show both. A right pool is a crescent around the left one, and tells
    them apart where the wall of a dilated left ventricle is as thin as the right one's.
    """
    seen = (pools.sum(axis=(2, 3)) >= LEAST_POOL).all(axis=0)
    first, second = (
        float(np.median([_disc_share(pool) for pool in slices]) if seen.any() else 1.0)
        for slices in pools[:, seen]
    )
    return first, second


def _disc_share(pool: Pixels) -> float:
    """Area of a pool in a slice over that of the disc of its second moments."""
    return float(pool.sum() / (2 * np.pi * np.trace(np.cov(np.argwhere(pool).T))))


def _oriented(
    stack: Stack,
    walls: Pixels,
    pools: Pixels,
    gaps: NDArray[np.intp],
    closed: NDArray[np.bool_],
) -> ShortAxisContours | None:
    """Short-axis contours from apex to base, without slices whose pool could not be found.

    The uppermost slice shows the left pool, in a wall that is `closed` (n,), and the right pool if
    there is one.
    """
    down, clear = points_down(walls | pools.any(0), pools, stack.beside)
    if down:
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
    findings = [] if clear else [_guessed(down)]
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
    pool: Pixels = np.any(blood, axis=0)
    heart = [
        ndi.binary_fill_holes(without_slits(w | p, p))
        for w, p in zip(walls[keep], pool, strict=True)
    ]
    right = blood[1] if len(blood) > 1 else None
    none = np.zeros((len(heart), 2))
    return ShortAxisContours(stack, np.stack(heart), blood[0], right, tuple(findings), none)


def _guessed(down: bool) -> Finding:
    """Say that the apex may be at the other end."""
    return Finding(
        "slices",
        "the slices do not tell at which end the apex is, the heart being as wide at both: it was "
        f"taken to be at the {'last' if down else 'first'} slice of the image; a label map that "
        "has the right ventricle's blood pool tells, also if the left ventricle alone is meshed",
        serious=True,
    )


def _numbers(chosen: NDArray[np.bool_]) -> str:
    """Numbers, from 1, of what is chosen (n,)."""
    return ", ".join(str(n + 1) for n in np.flatnonzero(chosen))
