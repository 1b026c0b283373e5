"""Jacobian determinants, volume, and the element quality built on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.quadrature import EXACT, gauss_cube

QUALITY_GAUSS = 4
"""Gauss points per direction at which element quality is measured (paper, section 3.2)."""


def determinants(mesh: HexMesh, xi: NDArray[np.float64]) -> NDArray[np.float64]:
    """Determinant of dx/dxi at local coordinates (q, 3) of every element: (e, q) float64, mm^3.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    xi : (q, 3) float64
        Local coordinates in the unit cube.
    """
    j = mesh.gradient(xi)
    return np.asarray(np.einsum("eqx,eqx->eq", j[..., 0], np.cross(j[..., 1], j[..., 2])))


def volume(mesh: HexMesh) -> float:
    """Volume in mm^3 by Gauss quadrature (exact).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    xi, weights = gauss_cube((EXACT,) * 3)
    return float(np.sum(determinants(mesh, xi) @ weights))


def jacobian_ratio(mesh: HexMesh, n: int = QUALITY_GAUSS) -> NDArray[np.float64]:
    """Jacobian ratio of each element, the paper's quality metric (equation 3.1).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    n : int
        Gauss points per direction.

    Returns
    -------
    (e,) float64
        min(det J) / max(det J); with a point that is not positive, min(det J) / max|det J|, so that
        a folded element scores at or below zero.
    """
    det = determinants(mesh, gauss_cube((n,) * 3)[0])
    least = det.min(1)
    top = np.where(least > 0, det.max(1), np.abs(det).max(1))
    return np.asarray(least / np.maximum(top, np.finfo(float).tiny))


def scaled_jacobian(mesh: HexMesh, n: int = QUALITY_GAUSS) -> NDArray[np.float64]:
    """Least scaled Jacobian of each element: det J over the product of its column lengths, (e,).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    n : int
        Gauss points per direction.
    """
    j = mesh.gradient(gauss_cube((n,) * 3)[0])
    det = np.einsum("eqx,eqx->eq", j[..., 0], np.cross(j[..., 1], j[..., 2]))
    lengths = np.prod(np.linalg.norm(j, axis=-2), axis=-1)
    return np.asarray((det / np.maximum(lengths, np.finfo(float).tiny)).min(1))
