"""Whether small quadrilaterals, of two triangles each, cross."""

from __future__ import annotations

import numba as nb

from heartgen.mesh.vectors import cross, dot, length, minus, same

HALVES = ((0, 3, 15), (0, 15, 12))
"""Corners of the two triangles among the 16 coefficients."""


@nb.njit(cache=True)
def quads_cross(p, q, touch):  # type: ignore[no-untyped-def]
    """Tell whether the triangles of one quadrilateral cross those of another.

    Parameters
    ----------
    p, q : (16, 3) float64
        Coefficients of bicubic patches, u fastest, of which the corners count; each quadrilateral
        is cut from the first to the last.
    touch : float
        Distance below which corners are the same, and nothing is crossed.

    Returns
    -------
    bool
    """
    for s in range(2):
        for t in range(2):
            if _triangles_cross(p, HALVES[s], q, HALVES[t], touch):
                return True
    return False


@nb.njit(cache=True)
def _triangles_cross(p, pc, q, qc, touch):  # type: ignore[no-untyped-def]
    """Whether two triangles, three corners each of rows of points, cross.

    Those that share an edge are neighbors. Those that share a corner cross if the edge opposite to
    it, in one of them, passes through the other.
    """
    if _on_one_side(p, pc, q, qc, touch) or _on_one_side(q, qc, p, pc, touch):
        return False
    shared, of_p, of_q = 0, -1, -1
    for a in range(3):
        for b in range(3):
            if same(p[pc[a]], q[qc[b]], touch):
                shared, of_p, of_q = shared + 1, a, b
    if shared > 1:
        return False
    for c in range(3):
        d, e = (c + 1) % 3, (c + 2) % 3
        if (shared == 0 or of_p == c) and _passes(p[pc[d]], p[pc[e]], q, qc, touch):
            return True
        if (shared == 0 or of_q == c) and _passes(q[qc[d]], q[qc[e]], p, pc, touch):
            return True
    return False


@nb.njit(cache=True)
def _on_one_side(p, pc, q, qc, touch):  # type: ignore[no-untyped-def]
    """Whether no edge of triangle p passes the plane of triangle q, or q has no area."""
    normal = _normal(q, qc)
    size = length(normal)
    if size <= touch * touch:
        return True
    o = q[qc[0]]
    a, b, c = (
        _height(normal, o, p[pc[0]]),
        _height(normal, o, p[pc[1]]),
        _height(normal, o, p[pc[2]]),
    )
    if max(abs(a), abs(b), abs(c)) <= touch * size:
        return True
    return (a < 0.0) == (b < 0.0) and (b < 0.0) == (c < 0.0)


@nb.njit(cache=True)
def _passes(a, b, q, qc, touch):  # type: ignore[no-untyped-def]
    """Whether the line from a to b passes through a triangle or its border."""
    normal = _normal(q, qc)
    o = q[qc[0]]
    of_a, of_b = _height(normal, o, a), _height(normal, o, b)
    # What lies in the plane counts as above it: of surfaces that meet in lines of both, one passes.
    if (of_a < 0.0) == (of_b < 0.0) or max(abs(of_a), abs(of_b)) <= touch * length(normal):
        return False
    first = _turn(a, b, q[qc[0]], q[qc[1]])
    second = _turn(a, b, q[qc[1]], q[qc[2]])
    third = _turn(a, b, q[qc[2]], q[qc[0]])
    return min(first, second, third) >= 0.0 or max(first, second, third) <= 0.0


@nb.njit(cache=True)
def _normal(q, qc):  # type: ignore[no-untyped-def]
    """Normal of a triangle, as long as twice its area."""
    o = q[qc[0]]
    return cross(minus(q[qc[1]], o), minus(q[qc[2]], o))


@nb.njit(cache=True)
def _turn(a, b, c, d):  # type: ignore[no-untyped-def]
    """Six times the volume of a tetrahedron: its sign tells how the lines ab and cd turn."""
    return dot(minus(b, a), cross(minus(c, a), minus(d, a)))


@nb.njit(cache=True)
def _height(normal, origin, x):  # type: ignore[no-untyped-def]
    """Height of a point over a plane, times the length of the normal."""
    return dot(normal, minus(x, origin))
