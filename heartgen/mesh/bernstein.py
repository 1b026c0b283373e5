"""Cubic Bernstein polynomials: the one set of 1-D functions behind every element.

Index letters used throughout `heartgen.mesh`: ``e`` element, ``q`` quadrature or sample point,
``a`` one of the 64 coefficients of an element (xi1 fastest), ``x`` space, ``d`` xi direction.
"""

from __future__ import annotations

from math import comb

import numpy as np
from numpy.typing import NDArray

DEGREE = 3
"""Degree of an element per direction."""

ORDER = DEGREE + 1
"""Coefficients of an element per direction."""

HERMITE_TO_BERNSTEIN = np.array(
    [[1, 0, 0, 0], [1, 1 / 3, 0, 0], [0, 0, 1, -1 / 3], [0, 0, 1, 0]], dtype=float
)
"""Bernstein coefficients (rows) of a cubic given by (value, slope) at 0 and at 1."""

BERNSTEIN_TO_HERMITE = np.array(
    [[1, 0, 0, 0], [-3, 3, 0, 0], [0, 0, 0, 1], [0, 0, -3, 3]], dtype=float
)
"""The inverse: (value, slope) at 0 and at 1 from Bernstein coefficients."""


def bernstein(t: NDArray[np.float64], degree: int = DEGREE) -> NDArray[np.float64]:
    """Bernstein polynomials at parameters t.

    Parameters
    ----------
    t : (n,) float64
        Parameters, usually in [0, 1].
    degree : int
        Polynomial degree.

    Returns
    -------
    (n, degree + 1) float64
    """
    t = np.asarray(t, dtype=float)
    return np.stack(
        [comb(degree, i) * t**i * (1 - t) ** (degree - i) for i in range(degree + 1)], -1
    )


def bernstein_derivative(
    t: NDArray[np.float64], order: int = 1, degree: int = DEGREE
) -> NDArray[np.float64]:
    """Derivative of the Bernstein polynomials.

    Parameters
    ----------
    t : (n,) float64
        Parameters, usually in [0, 1].
    order : int
        Order of the derivative; 0 gives the values.
    degree : int
        Polynomial degree.

    Returns
    -------
    (n, degree + 1) float64
    """
    if order == 0:
        return bernstein(t, degree)
    lower = bernstein_derivative(t, order - 1, degree - 1)
    out = np.zeros((len(lower), degree + 1))
    out[:, 1:] += degree * lower
    out[:, :-1] -= degree * lower
    return out


def tabulate(
    xi: NDArray[np.float64], derivative: tuple[int, int, int] = (0, 0, 0)
) -> NDArray[np.float64]:
    """Tricubic Bernstein functions of an element, or a mixed derivative of them.

    Parameters
    ----------
    xi : (q, 3) float64
        Local coordinates in the unit cube.
    derivative : (int, int, int)
        Order of the derivative along xi1, xi2, xi3.

    Returns
    -------
    (q, 64) float64
        Function ``i + 4 j + 16 k`` in column order.
    """
    f1, f2, f3 = (bernstein_derivative(xi[:, d], derivative[d]) for d in range(3))
    return np.asarray(np.einsum("qk,qj,qi->qkji", f3, f2, f1).reshape(len(xi), ORDER**3))


def lattice(n: int = ORDER) -> NDArray[np.float64]:
    """Evenly spaced points of the unit cube, (n^3, 3) float64, xi1 fastest, ends included.

    Parameters
    ----------
    n : int
        Points per direction.
    """
    t = np.linspace(0, 1, n)
    k, j, i = np.meshgrid(t, t, t, indexing="ij")
    return np.stack([i.ravel(), j.ravel(), k.ravel()], -1)


def lagrange_to_bernstein(order: int = DEGREE) -> NDArray[np.float64]:
    """Bernstein coefficients of the polynomial through evenly spaced values.

    Parameters
    ----------
    order : int
        Degree of the polynomial, at most 3.

    Returns
    -------
    (4, order + 1) float64
    """
    of_order = np.linalg.inv(bernstein(np.linspace(0, 1, order + 1), order))
    nodes = np.linspace(0, 1, ORDER)
    return np.asarray(np.linalg.solve(bernstein(nodes), bernstein(nodes, order) @ of_order))


def cube(line: NDArray[np.float64]) -> NDArray[np.float64]:
    """Matrix for all three directions of an element, xi1 fastest, from that of one.

    Parameters
    ----------
    line : (a, b) float64
        Matrix for one direction.
    """
    return np.kron(line, np.kron(line, line))


def subdivision(n: int) -> NDArray[np.float64]:
    """Split a cubic into n equal pieces.

    Parameters
    ----------
    n : int
        Number of pieces.

    Returns
    -------
    (n, 4, 4) float64
        Matrix of each piece: its Bernstein coefficients from those of the whole.
    """
    nodes = np.linspace(0, 1, ORDER)
    to_bernstein = np.linalg.inv(bernstein(nodes))
    return np.stack([to_bernstein @ bernstein((nodes + piece) / n) for piece in range(n)])
