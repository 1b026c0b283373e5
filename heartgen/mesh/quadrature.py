"""Gauss-Legendre quadrature on the unit interval, square and cube."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

EXACT = 5
"""Gauss points per direction that integrate det J (degree 8) of a tricubic element exactly."""


@lru_cache
def gauss(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss-Legendre points (n,) and weights (n,) on [0, 1].

    Parameters
    ----------
    n : int
        Number of points.
    """
    t, w = np.polynomial.legendre.leggauss(n)
    return (t + 1) / 2, w / 2


@lru_cache
def gauss_cube(n: tuple[int, int, int]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Tensor-product Gauss rule on the unit cube.

    Parameters
    ----------
    n : (int, int, int)
        Points along xi1, xi2, xi3.

    Returns
    -------
    xi : (q, 3) float64
        Points, xi1 fastest.
    weights : (q,) float64
        Weights, sum 1.
    """
    (t1, w1), (t2, w2), (t3, w3) = (gauss(m) for m in n)
    k, j, i = np.meshgrid(t3, t2, t1, indexing="ij")
    weights = np.einsum("k,j,i->kji", w3, w2, w1)
    return np.stack([i.ravel(), j.ravel(), k.ravel()], -1), weights.ravel()


@lru_cache
def gauss_square(n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss rule on the unit square: (n^2, 2) points, first fastest; (n^2,) weights.

    Parameters
    ----------
    n : int
        Points per direction.
    """
    t, w = gauss(n)
    v, u = np.meshgrid(t, t, indexing="ij")
    return np.stack([u.ravel(), v.ravel()], -1), np.outer(w, w).ravel()
