"""Vectors of three numbers for numba: tuples are faster than arrays."""

from __future__ import annotations

import numba as nb
import numpy as np


@nb.njit(cache=True)
def plus(a, b):  # type: ignore[no-untyped-def]
    """Sum a + b.

    Parameters
    ----------
    a, b : (3,) of float
        Vectors.
    """
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@nb.njit(cache=True)
def minus(a, b):  # type: ignore[no-untyped-def]
    """Difference a - b.

    Parameters
    ----------
    a, b : (3,) of float
        Vectors.
    """
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@nb.njit(cache=True)
def times(s, a):  # type: ignore[no-untyped-def]
    """Multiple s a.

    Parameters
    ----------
    s : float
        Factor.
    a : (3,) of float
        Vector.
    """
    return s * a[0], s * a[1], s * a[2]


@nb.njit(cache=True)
def dot(a, b):  # type: ignore[no-untyped-def]
    """Inner product.

    Parameters
    ----------
    a, b : (3,) of float
        Vectors.
    """
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@nb.njit(cache=True)
def cross(a, b):  # type: ignore[no-untyped-def]
    """Cross product.

    Parameters
    ----------
    a, b : (3,) of float
        Vectors.
    """
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@nb.njit(cache=True)
def length(a):  # type: ignore[no-untyped-def]
    """Length.

    Parameters
    ----------
    a : (3,) of float
        Vector.
    """
    return np.sqrt(dot(a, a))


@nb.njit(cache=True)
def same(a, b, touch):  # type: ignore[no-untyped-def]
    """Tell whether two points are one: less than `touch` apart.

    Parameters
    ----------
    a, b : (3,) of float
        Points, mm.
    touch : float
        Sum of the coordinates' differences below which they are one, mm.
    """
    return abs(a[0] - b[0]) + abs(a[1] - b[1]) + abs(a[2] - b[2]) < touch
