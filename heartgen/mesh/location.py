"""Which element a point lies in, and where in it: the inverse of a mesh's map, by Newton's method.

An element lies within the box around its Bernstein coefficients, so that no element that a point
may lie in is left out. In each of them Newton's method, kept in the unit cube, starts from the
nearest of a lattice of samples, and from further ones if no element has the point.
"""

from __future__ import annotations

from typing import Any

import numba as nb
import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.errors import MeshError
from heartgen.mesh.bernstein import ORDER, lattice, tabulate

Array = NDArray[np.float64]

STARTS = 4
"""Samples per direction of an element, from which Newton's method starts."""

TRIES = 8
"""Starts in each element, once the nearest of every element has failed."""

NEWTON_STEPS = 60

TOLERANCE = 4e-12
"""Distance from a point, over the extent of the mesh, at which it is found: 4e-10 mm of 100 mm."""

DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-4, 1e-12, 1e8
"""Of a step, relative to the diagonal of its matrix: the first that is tried after a failure, that
of Newton's method, which is none but for rounding, and the one at which there is no way down."""

TINY = 1e-300
"""Added to the diagonal, mm^2: no more, as near a pole the slope around it is small, and counts."""


def at(control: Array, elements: ArrayLike, xi: ArrayLike) -> Array:
    """Values of points, each at local coordinates of an element of its own.

    Parameters
    ----------
    control : (e, 64, k) float64
        Bernstein coefficients of the elements.
    elements : (n,) int
        -1 for a point in none.
    xi : (n, 3) float64
        Local coordinates.

    Returns
    -------
    (n, k) float64
        NaN in no element.

    Raises
    ------
    MeshError
        If there are no such elements, or their number is not that of the local coordinates.
    """
    index, where = np.asarray(elements), np.asarray(xi, dtype=float)
    if index.ndim != 1 or where.shape != (len(index), 3) or index.dtype.kind not in "iu":
        raise MeshError(
            f"elements of shape {index.shape} and local coordinates of shape {where.shape} do not "
            "belong together: give n whole numbers, and (n, 3) numbers"
        )
    if len(index) and not -1 <= index.min() <= index.max() < len(control):
        raise MeshError(
            f"elements {index.min()} to {index.max()} are not those of the mesh: give 0 to "
            f"{len(control) - 1}, or -1 for none"
        )
    values = np.einsum("na,nak->nk", tabulate(np.nan_to_num(where)), control[index])
    values[(index < 0) | np.isnan(where).any(axis=1)] = np.nan
    return np.asarray(values)


def locate(control: Array, points: ArrayLike) -> tuple[NDArray[np.intp], Array]:
    """Element of each point, and its local coordinates there.

    Parameters
    ----------
    control : (e, 64, 3) float64
        Bernstein coefficients of the elements, mm.
    points : (n, 3) float64
        mm, in the same frame.

    Returns
    -------
    elements : (n,) int
        One of them, of a point where elements meet; -1 in none.
    xi : (n, 3) float64
        In [0, 1]; NaN in none.

    Raises
    ------
    MeshError
        If these are no points in space.
    """
    places = np.ascontiguousarray(points, dtype=float)
    if places.ndim != 2 or places.shape[1] != 3:
        raise MeshError(f"points of shape {places.shape} are none in space: give (n, 3) in mm")
    control = np.ascontiguousarray(control)
    tolerance = TOLERANCE * float(np.ptp(control, axis=(0, 1)).max())
    starts = (lattice(STARTS) * (STARTS - 1) + 0.5) / STARTS
    samples = np.matmul(tabulate(starts), control)
    low, high = control.min(axis=1) - tolerance, control.max(axis=1) + tolerance
    elements, xi = _search(control, places, low, high, starts, samples, tolerance)
    return elements, xi


def _jit(function: Any) -> Any:
    return nb.njit(cache=True)(function)


@_jit
def _search(control, points, low, high, starts, samples, tolerance):  # type: ignore[no-untyped-def]
    """Elements and local coordinates of all points."""
    elements = np.full(len(points), -1, dtype=np.intp)
    xi = np.full((len(points), 3), np.nan)
    work = np.empty((6, ORDER))
    state = np.empty((4, 3))
    place = np.empty(3)
    candidates = np.empty(len(control), dtype=np.int64)
    distance = np.empty(len(starts))
    for n in range(len(points)):
        p = points[n]
        count = 0
        for e in range(len(control)):
            inside = True
            for x in range(3):
                if not low[e, x] <= p[x] <= high[e, x]:
                    inside = False
            if inside:
                candidates[count] = e
                count += 1
        for first, last in ((0, 1), (1, TRIES)):
            for c in range(count):
                e = candidates[c]
                for s in range(len(starts)):
                    distance[s] = 0.0
                    for x in range(3):
                        distance[s] += (samples[e, s, x] - p[x]) ** 2
                for attempt in range(last):
                    s = int(np.argmin(distance))
                    distance[s] = np.inf
                    if attempt < first:
                        continue
                    place[:] = starts[s]
                    if _newton(control[e], p, place, tolerance, work, state):
                        elements[n] = e
                        xi[n] = place
                        break
                if elements[n] >= 0:
                    break
            if elements[n] >= 0:
                break
    return elements, xi


@_jit
def _evaluate(control, xi, work, state):  # type: ignore[no-untyped-def]
    """Position, and its slopes along xi1, xi2, xi3, into the rows of `state`."""
    for d in range(3):
        t, s = xi[d], 1.0 - xi[d]
        f, g = work[2 * d], work[2 * d + 1]
        f[0], f[1], f[2], f[3] = s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t
        g[0], g[3] = -3 * s * s, 3 * t * t
        g[1], g[2] = 3 * s * s - 6 * s * t, 6 * s * t - 3 * t * t
    state[:] = 0.0
    for k in range(ORDER):
        for j in range(ORDER):
            both, slope_j, slope_k = (
                work[4, k] * work[2, j],
                work[4, k] * work[3, j],
                work[5, k] * work[2, j],
            )
            for x in range(3):
                along = 0.0
                slope = 0.0
                for i in range(ORDER):
                    c = control[i + ORDER * j + ORDER * ORDER * k, x]
                    along += work[0, i] * c
                    slope += work[1, i] * c
                state[0, x] += both * along
                state[1, x] += both * slope
                state[2, x] += slope_j * along
                state[3, x] += slope_k * along


@_jit
def _newton(control, p, xi, tolerance, work, state):  # type: ignore[no-untyped-def]
    """Move `xi` in the unit cube to where the element is at p; whether that is found."""
    matrix, gradient, step, new = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    _evaluate(control, xi, work, state)
    value = _square(state[0], p)
    damping = LEAST_DAMPING
    for _ in range(NEWTON_STEPS):
        if value <= (0.01 * tolerance) ** 2:
            break
        for d in range(3):
            gradient[d] = 0.0
            for x in range(3):
                gradient[d] += state[1 + d, x] * (state[0, x] - p[x])
            for c in range(3):
                matrix[d, c] = 0.0
                for x in range(3):
                    matrix[d, c] += state[1 + d, x] * state[1 + c, x]
        for d in range(3):
            matrix[d, d] = matrix[d, d] * (1.0 + damping) + TINY
        for d in range(3):
            held_low = xi[d] <= 0.0 and gradient[d] > 0.0
            held_high = xi[d] >= 1.0 and gradient[d] < 0.0
            if held_low or held_high:  # the step would leave the cube
                gradient[d] = 0.0
                for c in range(3):
                    if c != d:
                        matrix[d, c] = 0.0
                        matrix[c, d] = 0.0
        _solve(matrix, gradient, step)
        for d in range(3):
            new[d] = min(max(xi[d] - step[d], 0.0), 1.0)
        _evaluate(control, new, work, state)
        lower = _square(state[0], p)
        if lower < value:
            xi[:] = new
            value = lower
            damping = max(0.1 * damping, LEAST_DAMPING)
        else:
            damping = max(10.0 * damping, DAMPING)
            if damping > MOST_DAMPING:
                break
            _evaluate(control, xi, work, state)
    return value <= tolerance * tolerance


@_jit
def _square(a, b):  # type: ignore[no-untyped-def]
    """Square of the distance of two points."""
    return (a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2


@_jit
def _solve(m, right, out):  # type: ignore[no-untyped-def]
    """Solve a symmetric positive definite system of three, by Cholesky's factors."""
    a = np.sqrt(m[0, 0])
    b, c = m[1, 0] / a, m[2, 0] / a
    d = np.sqrt(max(m[1, 1] - b * b, 1e-300))
    e = (m[2, 1] - b * c) / d
    f = np.sqrt(max(m[2, 2] - c * c - e * e, 1e-300))
    y0 = right[0] / a
    y1 = (right[1] - b * y0) / d
    y2 = (right[2] - c * y0 - e * y1) / f
    out[2] = y2 / f
    out[1] = (y1 - e * out[2]) / d
    out[0] = (y0 - b * out[1] - c * out[2]) / a
