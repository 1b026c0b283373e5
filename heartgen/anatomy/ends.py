"""Which end of a short-axis stack is the apex."""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from skimage.morphology import convex_hull_image

from heartgen.anatomy.slice_tracking import closing

Pixels = NDArray[np.bool_]

SPECK = 0.02
"""Area over that of the largest pool up to which what is found in a slice at an end is a hole in
its wall rather than a pool."""

TAPERED = 1.5
"""Area of the right pool in the two slices at its one end over that at its other end from which it
tells where the apex is."""

SWOLLEN = 2.0
"""Area of a heart in an end slice without a pool, over that in the slice at the other end, from
which it is no apex, but a base that was filled."""

SOLID = 0.75
"""Area of a closed apex, at least, over that of its convex hull..."""

COVERED = 0.3
"""...or share of the pool next to it that it covers, where the apex has holes..."""

NOTCH = 0.3
"""...and radius of the disc that closes these, over the radius of that pool."""


def points_down(hearts: Pixels, pools: Pixels) -> bool:
    """Tell whether the apex is at the upper end of the slices.

    Parameters
    ----------
    hearts : (n, nx, ny) bool
        Wall and pools in each slice.
    pools : (1 or 2, n, nx, ny) bool
        The left pool, then the right one if there is one.

    Returns
    -------
    bool
    """
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
