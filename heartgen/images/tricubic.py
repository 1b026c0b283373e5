"""Catmull-Rom interpolation on a grid of voxels: tricubic, with a continuous gradient."""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np
from numpy.typing import NDArray

CHUNK = 2048
"""Points that one thread interpolates at a time..."""

PARALLEL_FROM = 32768
"""...where there are enough of them to pay for the threads."""


def interpolate(
    values: NDArray[np.floating[Any]], index: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Interpolate at points inside a grid.

    Parameters
    ----------
    values : (nx, ny, nz) float
        On the grid.
    index : (n, 3) float64
        Points, in voxels; contiguous.

    Returns
    -------
    values : (n,) float64
    slope : (n, 3) float64
        Gradient by the index.
    """
    out, slope = np.empty(len(index)), np.empty((len(index), 3))
    fill = _tricubic if len(index) < PARALLEL_FROM else _tricubic_in_chunks
    fill(values, index, out, slope)
    return out, slope


@nb.njit(cache=True)
def _tricubic(values, index, out, slope):  # type: ignore[no-untyped-def]
    """Catmull-Rom values and index-space gradients at points inside the grid."""
    weight = np.empty((3, 4))
    change = np.empty((3, 4))
    first = np.empty(3, dtype=np.int64)
    for p in range(len(index)):
        for x in range(3):
            first[x] = max(min(int(index[p, x]), values.shape[x] - 2), 0)
            t = index[p, x] - first[x]
            weight[x, 0] = ((-0.5 * t + 1.0) * t - 0.5) * t
            weight[x, 1] = (1.5 * t - 2.5) * t * t + 1.0
            weight[x, 2] = ((-1.5 * t + 2.0) * t + 0.5) * t
            weight[x, 3] = (0.5 * t - 0.5) * t * t
            change[x, 0] = (-1.5 * t + 2.0) * t - 0.5
            change[x, 1] = (4.5 * t - 5.0) * t
            change[x, 2] = (-4.5 * t + 4.0) * t + 0.5
            change[x, 3] = (1.5 * t - 1.0) * t
        v, g0, g1, g2 = 0.0, 0.0, 0.0, 0.0
        for a in range(4):
            i = min(max(first[0] + a - 1, 0), values.shape[0] - 1)
            for b in range(4):
                j = min(max(first[1] + b - 1, 0), values.shape[1] - 1)
                line, rise = 0.0, 0.0
                for c in range(4):
                    k = min(max(first[2] + c - 1, 0), values.shape[2] - 1)
                    line += weight[2, c] * values[i, j, k]
                    rise += change[2, c] * values[i, j, k]
                v += weight[0, a] * weight[1, b] * line
                g0 += change[0, a] * weight[1, b] * line
                g1 += weight[0, a] * change[1, b] * line
                g2 += weight[0, a] * weight[1, b] * rise
        out[p], slope[p, 0], slope[p, 1], slope[p, 2] = v, g0, g1, g2


@nb.njit(cache=True, parallel=True)
def _tricubic_in_chunks(values, index, out, slope):  # type: ignore[no-untyped-def]
    """The same on all threads."""
    for chunk in nb.prange((len(index) + CHUNK - 1) // CHUNK):
        rows = slice(chunk * CHUNK, (chunk + 1) * CHUNK)
        _tricubic(values, index[rows], out[rows], slope[rows])
