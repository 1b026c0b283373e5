"""Which end of a short-axis stack is the apex."""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from skimage.morphology import convex_hull_image

from heartgen.anatomy.slice_tracking import closing
from heartgen.images.stack import narrow_end

Pixels = NDArray[np.bool_]

SPECK = 0.02
"""Area over that of the largest pool up to which what is found in a slice at an end is a hole in
its wall rather than a pool."""

NARROWS = 0.045
"""How far the middle of a heart's area lies off that of its slices, over half their extent, from
which the heart narrows towards one end, its apex. In 240 left ventricles, as they are and with
slices that were left out, filled or broken, it is 0.05 and more, but for those whose apex is as
wide as their base: there it is -0.04 to 0.04, and may be wrong."""

FILLED = 0.09
"""The same from which it narrows away from an end that muscle closes, which is a base that was
filled then: 0.15 and more in filled bases of hearts whose apex is not as wide."""

CAP = 0.75
"""Area of an end slice without a pool over that of the next, up to which it is the cap of an apex:
0.3 to 0.75 in stacks with one, 0.75 to 1 where a base was filled."""

SOLID = 0.75
"""Area of a closed apex, at least, over that of its convex hull..."""

COVERED = 0.3
"""...or share of the pool next to it that it covers, where the apex has holes..."""

NOTCH = 0.3
"""...and radius of the disc that closes these, over the radius of that pool."""


def points_down(
    hearts: Pixels, pools: Pixels, beside: NDArray[np.intp] | None = None
) -> tuple[bool, bool]:
    """Tell whether the apex is at the upper end of the slices.

    Parameters
    ----------
    hearts : (n, nx, ny) bool
        Wall and pools in each slice.
    pools : (1 or 2, n, nx, ny) bool
        The left pool, then the right one if there is one.
    beside : (n,) int, optional
        Area of a right pool that is none of these, pixels.

    Returns
    -------
    down : bool
        Whether it is.
    clear : bool
        Whether the right ventricle or the shape of the heart tells; it is a guess if not.
    """
    right = pools[1].sum(axis=(1, 2)) if len(pools) > 1 else beside
    if right is not None and (end := narrow_end(right)) != 0:
        return end > 0, True
    size, area = hearts.sum(axis=(1, 2)), pools[0].sum(axis=(1, 2))
    has = np.flatnonzero(area > SPECK * area.max())
    first, last = has[0], has[-1]
    narrows = _narrows(size[first : last + 1])
    down, least = narrows < 0, NARROWS
    if (first == 0) != (last == len(area) - 1):
        # One end has no pool: the apex if muscle closes it, the base if the wall is open or filled.
        end, beyond = (first, first - 1) if first > 0 else (last, last + 1)
        closed = _closes(hearts[beyond], pools[0, end])
        closed_down = closed == (beyond > end)
        if abs(narrows) < NARROWS:
            return closed_down, closed and size[beyond] <= CAP * size[end]
        if closed and closed_down != down:
            least = FILLED
    return down, abs(narrows) >= least


def _narrows(size: NDArray[np.intp]) -> float:
    """Middle of the area (n,) of slices, from -1 in the first to 1 in the last."""
    return float(np.average(np.linspace(-1, 1, len(size)), weights=size)) if len(size) > 1 else 0.0


def _closes(beyond: Pixels, pool: Pixels) -> bool:
    """Whether what the slice beyond the last pool shows is the muscle of an apex."""
    pieces, _ = ndi.label(beyond, np.ones((3, 3)))
    largest = pieces == np.bincount(pieces.ravel())[1:].argmax() + 1
    hull: Pixels = convex_hull_image(largest)  # type: ignore[no-untyped-call]
    radius = int(np.ceil(NOTCH * np.sqrt(pool.sum() / np.pi)))
    filled = ndi.binary_fill_holes(closing(largest, radius))
    covered = (filled & pool).sum() / pool.sum()
    return bool(largest.sum() >= SOLID * hull.sum() or covered > COVERED)
