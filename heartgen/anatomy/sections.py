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

from heartgen.anatomy.following import LEAST_POOL, follow_pools, holes_of, least_second
from heartgen.errors import AnatomyError
from heartgen.images.mask import Finding
from heartgen.images.stack import Stack, with_border

Pixels = NDArray[np.bool_]

ISLAND = 0.05
"""Area over that of the largest piece of a slice below which a piece is no part of the heart."""

SECOND_SLICES = 0.25
"""Share of the slices with a pool in which there must be a second one in a heart with two."""

LEAST_SHARE = 0.5
"""Share of the slices in which a short-axis stack shows the left ventricle's pool."""

THIN = 25.0
"""Percentile of the thickness of a wall, over its pixels, that tells it."""

INCOMPLETE = 2
"""Slices at the base, at most, that show only a part of the wall."""

WIDE = 0.4
"""Area of the pool in the uppermost slice, at least, over the largest: there it opens."""

SOLID = 0.75
"""Area of a closed apex, at least, over that of its convex hull."""


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
    walls = np.stack([_without_islands(wall) for wall in stack.pixels])
    holes = [holes_of(wall) for wall in walls]
    areas = [np.sort(np.bincount(h.ravel())[1:])[::-1] for h in holes]
    largest = np.array([a[0] if len(a) and a[0] >= LEAST_POOL else 0 for a in areas])
    if not largest.any():
        return None
    second = np.array([a[1] if len(a) > 1 and a[1] >= least_second(a[0]) else 0 for a in areas])
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
    pools, gaps = follow_pools(walls, holes, seed, 2 if both else 1, stack)
    if both and _thickness(walls, pools) < 0:
        pools = pools[::-1]
    return _oriented(stack, walls, pools, gaps)


def _without_islands(wall: Pixels) -> Pixels:
    """A slice without pieces much smaller than the largest."""
    pieces, count = ndi.label(wall, np.ones((3, 3)))
    sizes = np.bincount(pieces.ravel(), minlength=count + 1)
    sizes[0] = 0
    return np.asarray((sizes >= ISLAND * sizes.max())[pieces] & wall)


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
    none = np.zeros((len(heart), 2))
    return Sections(stack, np.stack(heart), blood[0], right, tuple(findings), none)
