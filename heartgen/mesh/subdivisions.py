"""Faces split into quarters of quarters where they are looked at: bicubic patches, as a tree.

A tree of pieces is a tuple of arrays that numba knows, the faces first: Bernstein coefficients
(m, 16, 3), mm, u fastest; boxes around them (m, 6), least and greatest coordinates, mm; slopes
(m, 8): middle derivatives along u and along v, and how far the others may be from each, mm; first
of the four quarters (m,), 0 before there are any; level (m,), 0 for a face; number of pieces (1,).
"""

from __future__ import annotations

import numba as nb
import numpy as np

ROOM = 16
"""Pieces for each face that there is room for at first."""


@nb.njit(cache=True)
def whole_faces(patches):  # type: ignore[no-untyped-def]
    """Tree of faces that are not split yet, from their coefficients (f, 16, 3), mm.

    Parameters
    ----------
    patches : (f, 16, 3) float64
        Bernstein coefficients of the faces, mm.
    """
    tree = _empty(ROOM * len(patches) + 4, np.array([len(patches)]))
    tree[0][: len(patches)] = patches
    for face in range(len(patches)):
        _measure(tree, face)
    return tree


@nb.njit(cache=True)
def split(tree, piece):  # type: ignore[no-untyped-def]
    """Tree with the quarters of a piece, maybe in other arrays.

    Parameters
    ----------
    tree : tuple of arrays
        The pieces so far.
    piece : int
        Number of the piece.
    """
    if tree[3][piece]:
        return tree
    first = tree[5][0]
    if first + 4 > len(tree[3]):
        tree = _with_room(tree)
    control, _, _, quarters, level, count = tree
    halves = np.empty((2, 16, 3))
    for j in range(4):
        _halve(control[piece], halves[0], halves[1], 4 * j, 1)
    for right in range(2):
        low, high = control[first + right], control[first + 2 + right]
        for i in range(4):
            _halve(halves[right], low, high, i, 4)
    for new in range(first, first + 4):
        level[new] = level[piece] + 1
        _measure(tree, new)
    quarters[piece] = first
    count[0] += 4
    return tree


@nb.njit(cache=True)
def apart(boxes, a, b):  # type: ignore[no-untyped-def]
    """Tell whether two of the boxes (m, 6) have no point in common.

    Parameters
    ----------
    boxes : (m, 6) float64
        Lower and upper corners, mm.
    a, b : int
        Numbers of the two.
    """
    away = False
    for x in range(3):
        away |= boxes[a, x] > boxes[b, x + 3] or boxes[b, x] > boxes[a, x + 3]
    return away


@nb.njit(cache=True)
def _empty(room, count):  # type: ignore[no-untyped-def]
    """A tree with room for pieces."""
    return (
        np.empty((room, 16, 3)),
        np.empty((room, 6)),
        np.empty((room, 8)),
        np.zeros(room, dtype=np.int64),
        np.zeros(room, dtype=np.int64),
        count,
    )


@nb.njit(cache=True)
def _with_room(tree):  # type: ignore[no-untyped-def]
    """The tree in arrays of twice the length."""
    control, boxes, slopes, quarters, level, count = tree
    n = len(quarters)
    more = _empty(2 * n, count)
    more[0][:n], more[1][:n], more[2][:n] = control, boxes, slopes
    more[3][:n], more[4][:n] = quarters, level
    return more


@nb.njit(cache=True)
def _halve(whole, low, high, start, step):  # type: ignore[no-untyped-def]
    """De Casteljau subdivision at 1/2 of a row of coefficients: the same to the bit in reverse."""
    for x in range(3):
        a, b = whole[start, x], whole[start + step, x]
        c, d = whole[start + 2 * step, x], whole[start + 3 * step, x]
        ab, bc, cd = (a + b) / 2, (b + c) / 2, (c + d) / 2
        abc, bcd = (ab + bc) / 2, (bc + cd) / 2
        middle = (abc + bcd) / 2
        low[start, x], low[start + step, x] = a, ab
        low[start + 2 * step, x], low[start + 3 * step, x] = abc, middle
        high[start, x], high[start + step, x] = middle, bcd
        high[start + 2 * step, x], high[start + 3 * step, x] = cd, d


@nb.njit(cache=True)
def _measure(tree, piece):  # type: ignore[no-untyped-def]
    """Box and slopes of a piece."""
    p, box, slopes = tree[0][piece], tree[1][piece], tree[2][piece]
    box[:3], box[3:] = np.inf, -np.inf
    for c in range(16):
        for x in range(3):
            box[x], box[x + 3] = min(box[x], p[c, x]), max(box[x + 3], p[c, x])
    for axis in range(2):
        step, across = (1, 4) if axis == 0 else (4, 1)
        for x in range(3):
            total = 0.0
            for j in range(4):
                total += p[j * across + 3 * step, x] - p[j * across, x]
            slopes[3 * axis + x] = total / 4
        farthest = 0.0
        for j in range(4):
            for i in range(3):
                at = j * across + i * step
                off = 0.0
                for x in range(3):
                    off += (3 * (p[at + step, x] - p[at, x]) - slopes[3 * axis + x]) ** 2
                farthest = max(farthest, off)
        slopes[6 + axis] = np.sqrt(farthest)
