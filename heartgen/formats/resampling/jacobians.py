"""Jacobians of linear and quadratic cells: whether they fold, and how good they are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.resampling.kinds import CellKind
from heartgen.mesh.quadrature import gauss

GAUSS = 4
"""Gauss points of a cell in each direction: exact for the volume of all kinds."""

REGULAR = {8: 1.0, 6: 2 / np.sqrt(3), 4: np.sqrt(2)}
"""One over the scaled Jacobian at a vertex of a regular cell, by its number of vertices."""


def determinants(
    kind: CellKind, points: NDArray[np.float64], xi: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Jacobian determinants (m, q) of cells with nodes (m, n, 3) at reference places (q, 3).

    Parameters
    ----------
    kind : CellKind
        Of the cells.
    points : (m, n, 3) float64
        Nodes of the cells, mm.
    xi : (q, 3) float64
        Places in the reference cell.
    """
    return np.asarray(np.linalg.det(np.einsum("qnd,mnx->mqxd", kind.gradient(xi), points)))


def least_determinants(kind: CellKind, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least determinant (m,) of cells with nodes (m, n, 3), at their nodes and Gauss points.

    Parameters
    ----------
    kind : CellKind
        Of the cells.
    points : (m, n, 3) float64
        Nodes of the cells, mm.
    """
    xi = np.concatenate([gauss_points(kind)[0], kind.reference])
    return np.asarray(determinants(kind, points, xi).min(1))


def volumes(kind: CellKind, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Volumes (m,) of cells with nodes (m, n, 3).

    Parameters
    ----------
    kind : CellKind
        Of the cells.
    points : (m, n, 3) float64
        Nodes of the cells, mm.
    """
    xi, weights = gauss_points(kind)
    return np.asarray(determinants(kind, points, xi) @ weights)


def gauss_points(kind: CellKind) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Gauss points (q, 3) and weights (q,) in the reference cell; collapsed if it is no cube.

    Parameters
    ----------
    kind : CellKind
        Of the cells.
    """
    t, w = gauss(GAUSS)
    z, y, x = (a.ravel() for a in np.meshgrid(t, t, t, indexing="ij"))
    weights = np.einsum("k,j,i->kji", w, w, w).ravel()
    if kind.vertices < 8:
        y, weights = y * (1 - x), weights * (1 - x)
    if kind.vertices < 6:
        z, weights = z * (1 - x - y), weights * (1 - x - y)
    return np.stack([x, y, z], -1), weights


def scaled_jacobian(kind: CellKind, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Least scaled Jacobian at the vertices of cells.

    Parameters
    ----------
    kind : CellKind
        Of the cells.
    points : (m, n, 3) float64
        Nodes of the cells, mm.

    Returns
    -------
    (m,) float64
        Determinant of the unit vectors along the three edges that leave a vertex, 1 in a regular
        cell.
    """
    reference = kind.reference[: kind.vertices]
    jacobian = np.einsum("qnd,mnx->mqxd", kind.gradient(reference), points)
    edges = reference[kind.neighbors] - reference[:, None]  # (vertex, edge, direction)
    along = np.einsum("mqxd,qsd->mqxs", jacobian, edges)
    length = np.linalg.norm(along, axis=2, keepdims=True)
    det = np.linalg.det(along / np.maximum(length, np.finfo(float).tiny))
    return np.asarray(REGULAR[kind.vertices] * det.min(1))
