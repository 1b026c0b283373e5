"""Pieces of a surface so flat that they meet nowhere but where they belong together.

A map from a convex domain is one-to-one if P J, for some matrix P, stays closer to the identity
than 1, J being its matrix of derivatives. That is shown of a piece, and of two that share an edge;
at the pole, where u has no length, of y T(x / y, y) in the place of v T(u, v). Two that share a
corner, or the pole, meet only there if a plane through it has the coefficients of the one on this
side and those of the other on that side.

Trees of pieces are those of `heartgen.mesh.subdivisions`.
"""

from __future__ import annotations

import numba as nb
import numpy as np

from heartgen.mesh.vectors import dot, length, minus, plus, same, times

CORNERS = (0, 3, 12, 15)
"""Which of the 16 coefficients of a piece are its corners: of corner c, u is c % 2 and v c // 2."""


@nb.njit(cache=True)
def one_to_one(tree, piece, touch):  # type: ignore[no-untyped-def]
    """Tell whether a piece is so flat that it cannot meet itself.

    Parameters
    ----------
    tree : tuple of arrays
        Of pieces, see `heartgen.mesh.subdivisions`.
    piece : int
        Number of the piece.
    touch : float
        Distance below which points are the same, mm.

    Returns
    -------
    bool
        False if it could not be shown.
    """
    control = tree[0][piece]
    for c, d in ((0, 1), (1, 3), (3, 2), (2, 0)):
        if same(control[CORNERS[c]], control[CORNERS[d]], touch):
            x, y = np.empty((9, 3)), np.empty((12, 3))
            _fan(control, c, c ^ 3 ^ (c ^ d), 1.0, x, y)
            return _nearly_constant(x, y)
    s = tree[2][piece]
    a, b = (s[0], s[1], s[2]), (s[3], s[4], s[5])
    aa, bb = dot(a, a), dot(b, b)
    if aa == 0.0 or bb == 0.0:
        return False
    return s[6] ** 2 / aa + s[7] ** 2 / bb < 1 - abs(dot(a, b)) / np.sqrt(aa * bb)


@nb.njit(cache=True)
def meet_properly(tree, p, q, touch):  # type: ignore[no-untyped-def]
    """Tell whether two pieces share an edge, a corner or the pole, and meet nowhere else.

    Parameters
    ----------
    tree : tuple of arrays
        Of pieces, see `heartgen.mesh.subdivisions`.
    p, q : int
        Two pieces.
    touch : float
        Distance below which points are the same, mm.

    Returns
    -------
    bool
        False if it could not be shown.
    """
    control_p, control_q = tree[0][p], tree[0][q]
    shared, pole = 0, 0
    p1, q1, p2, q2 = 0, 0, 0, 0
    for a in range(4):
        for b in range(4):
            if same(control_p[CORNERS[a]], control_q[CORNERS[b]], touch):
                shared += 1
                if _at_pole(control_p, a, touch) and _at_pole(control_q, b, touch):
                    pole += 1
                    p1, q1 = a, b
                else:
                    p1, q1, p2, q2 = (p2, q2, a, b) if pole == 0 else (p1, q1, a, b)
    if shared == 1:
        return _opposite(control_p, CORNERS[p2], control_q, CORNERS[q2], touch)
    if shared == 2 and pole == 0 and p1 != p2 and q1 != q2:
        return _share_edge(control_p, p1, p2, control_q, q1, q2, touch) and _beside(
            tree[2][p], p1, p2, tree[2][q], q1, q2
        )
    if shared == 4 and pole == 4:
        return _opposite(control_p, CORNERS[p1], control_q, CORNERS[q1], touch)
    if shared == 5 and pole == 4:
        return _beside_at_pole(control_p, p2, control_q, q2, touch)
    return False


@nb.njit(cache=True)
def _at_pole(control, corner, touch):  # type: ignore[no-untyped-def]
    """Whether an edge at a corner has no length."""
    at = control[CORNERS[corner]]
    return same(at, control[CORNERS[corner ^ 1]], touch) or same(
        at, control[CORNERS[corner ^ 2]], touch
    )


@nb.njit(cache=True)
def _beside_at_pole(p, p2, q, q2, touch):  # type: ignore[no-untyped-def]
    """Whether two pieces at the pole that share the edge to it from a corner meet only there."""
    p1 = p2 ^ 2 if _at_pole(p, p2 ^ 2, touch) else p2 ^ 1
    q1 = q2 ^ 2 if _at_pole(q, q2 ^ 2, touch) else q2 ^ 1
    if not _share_edge(p, p1, p2, q, q1, q2, touch):
        return False
    x, y = np.empty((18, 3)), np.empty((24, 3))
    _fan(p, p1, p2, -1.0, x[:9], y[:12])
    _fan(q, q1, q2, 1.0, x[9:], y[12:])
    return _nearly_constant(x, y)


@nb.njit(cache=True)
def _fan(p, pole, out, side, x, y):  # type: ignore[no-untyped-def]
    """Coefficients (9, 3) and (12, 3) of the derivatives of y T(x / y, y), from a piece v T(u, v).

    v leads from corner `pole` to corner `out`, and u the other way; x = v u or, on the other side,
    -v u. The derivatives are T_u and S_v - u T_u.
    """
    start = CORNERS[pole]
    step = (CORNERS[out] - start) // 3
    along = (CORNERS[pole ^ 3 ^ (pole ^ out)] - start) // 3
    for k in range(3):
        for i in range(4):
            at = start + i * along + (k + 1) * step
            for axis in range(3):
                slope = 3 * (p[at, axis] - p[at - step, axis])
                if i > 0:
                    turn = 9 / (k + 1) * (p[at, axis] - p[at - along, axis])
                    x[3 * k + i - 1, axis] = side * turn
                    slope -= i / 3 * turn
                y[4 * k + i, axis] = slope


@nb.njit(cache=True)
def _nearly_constant(x, y):  # type: ignore[no-untyped-def]
    """Whether a map whose derivatives are means of vectors (n, 3) and (m, 3) is one-to-one."""
    a, off_a = _middle(x)
    b, off_b = _middle(y)
    aa, bb = dot(a, a), dot(b, b)
    if aa == 0.0 or bb == 0.0:
        return False
    return off_a**2 / aa + off_b**2 / bb < 1 - abs(dot(a, b)) / np.sqrt(aa * bb)


@nb.njit(cache=True)
def _middle(vectors):  # type: ignore[no-untyped-def]
    """Mean of vectors (n, 3), and the distance of the farthest one from it."""
    middle = (0.0, 0.0, 0.0)
    for n in range(len(vectors)):
        middle = plus(middle, vectors[n])
    middle = times(1 / len(vectors), middle)
    farthest = 0.0
    for n in range(len(vectors)):
        farthest = max(farthest, length(minus(vectors[n], middle)))
    return middle, farthest


@nb.njit(cache=True)
def _share_edge(p, p1, p2, q, q1, q2, touch):  # type: ignore[no-untyped-def]
    """Whether the lines between corners 1 and 2 of two pieces are edges, and the same."""
    if p1 + p2 == 3 or q1 + q2 == 3:
        return False  # a diagonal is no edge
    for i in (1, 2):
        a = CORNERS[p1] + i * (CORNERS[p2] - CORNERS[p1]) // 3
        b = CORNERS[q1] + i * (CORNERS[q2] - CORNERS[q1]) // 3
        if not same(p[a], q[b], touch):
            return False
    return True


@nb.njit(cache=True)
def _beside(p, p1, p2, q, q1, q2):  # type: ignore[no-untyped-def]
    """Whether pieces of slopes p and q that share edges between corners 1 and 2 meet only there.

    Together they are a map from a rectangle: along the edge, and across it from p to q.
    """
    along_p, off_along_p, in_p, off_p = _from_edge(p, p1, p2)
    along_q, off_along_q, in_q, off_q = _from_edge(q, q1, q2)
    along, size_p, size_q = times(0.5, plus(along_p, along_q)), length(in_p), length(in_q)
    size = length(along)
    if size == 0.0 or size_p == 0.0 or size_q == 0.0:
        return False
    in_p, in_q = times(1 / size_p, in_p), times(1 / size_q, in_q)
    across = times(0.5, minus(in_q, in_p))
    width = length(across)
    if width == 0.0:
        return False
    along, across = times(1 / size, along), times(1 / width, across)
    upright = 1 - abs(dot(along, across))
    if upright <= 0.0:
        return False
    of_p = _distance(along, across, times(1 / size, along_p), times(-1 / width, in_p)) / upright
    of_q = _distance(along, across, times(1 / size, along_q), times(1 / width, in_q)) / upright
    of_p += np.hypot(off_along_p / size, off_p / size_p / width) / np.sqrt(upright)
    of_q += np.hypot(off_along_q / size, off_q / size_q / width) / np.sqrt(upright)
    return max(of_p, of_q) < 1.0


@nb.njit(cache=True)
def _from_edge(slopes, c, d):  # type: ignore[no-untyped-def]
    """Slopes along the edge from corner c to d and inwards, and how far each may be off."""
    a, b = (slopes[0], slopes[1], slopes[2]), (slopes[3], slopes[4], slopes[5])
    a = times(-1.0 if c % 2 else 1.0, a)
    b = times(-1.0 if c >= 2 else 1.0, b)
    if c ^ d == 1:
        return a, slopes[6], b, slopes[7]
    return b, slopes[7], a, slopes[6]


@nb.njit(cache=True)
def _distance(a, b, c, d):  # type: ignore[no-untyped-def]
    """Size of the matrix of inner products of unit vectors a and b with c - a and d - b."""
    c, d = minus(c, a), minus(d, b)
    return np.sqrt(dot(a, c) ** 2 + dot(a, d) ** 2 + dot(b, c) ** 2 + dot(b, d) ** 2)


@nb.njit(cache=True)
def _opposite(p, at_p, q, at_q, touch):  # type: ignore[no-untyped-def]
    """Whether a plane through a point that is a coefficient of both keeps p and q apart."""
    to_p, to_q = _direction(p, at_p, touch), _direction(q, at_q, touch)
    w = minus(to_p, to_q)
    for c in range(16):
        if not same(p[c], p[at_p], touch) and dot(w, minus(p[c], p[at_p])) <= 0.0:
            return False
        if not same(q[c], q[at_q], touch) and dot(w, minus(q[c], q[at_q])) >= 0.0:
            return False
    return True


@nb.njit(cache=True)
def _direction(p, at, touch):  # type: ignore[no-untyped-def]
    """Middle of the directions from one coefficient to the others, of length 1."""
    total = (0.0, 0.0, 0.0)
    for c in range(16):
        if not same(p[c], p[at], touch):
            to = minus(p[c], p[at])
            total = plus(total, times(1 / length(to), to))
    return times(1 / max(length(total), touch), total)
