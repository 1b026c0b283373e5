"""Pools of a stack whose labels tell them."""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.ends import SPECK
from heartgen.anatomy.slice_tracking import LEAST_POOL, whole_pools
from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD

Pixels = NDArray[np.bool_]


def labeled_pools(walls: Pixels, blood: NDArray[np.uint8]) -> Pixels:
    """Take the pools as the labels tell them, without specks.

    Parameters
    ----------
    walls : (n, nx, ny) bool
        Myocardium in each slice.
    blood : (n, nx, ny) uint8
        `LEFT_BLOOD` and `RIGHT_BLOOD`.

    Returns
    -------
    (1 or 2, n, nx, ny) bool
        The left pool, then the right one if there is one.
    """
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


def ring_share(walls: Pixels, pools: Pixels) -> NDArray[np.float64]:
    """Share of the left pool's border in each slice at which there is wall, or the right pool.

    Parameters
    ----------
    walls : (n, nx, ny) bool
        Myocardium in each slice.
    pools : (1 or 2, n, nx, ny) bool
        The left pool, and the right one if it is there, in each slice.

    Returns
    -------
    (n,) float64
    """
    share = np.zeros(len(walls))
    for n, (wall, left) in enumerate(zip(walls, pools[0], strict=True)):
        if left.any():
            border = ndi.binary_dilation(left, iterations=2) & ~left
            near = ndi.binary_dilation(wall | pools[1:, n].any(0))
            share[n] = (border & near).sum() / border.sum()
    return share
