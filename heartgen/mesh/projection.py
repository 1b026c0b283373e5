"""L2 projection of a function onto the degrees of freedom of a mesh (paper, section 2.3)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER, tabulate
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.quadrature import gauss_cube

POLE_WEIGHT = 1e-3
"""Least weight of a point, relative to the mean: the volume element vanishes at the pole, and its
degrees of freedom would otherwise be nearly free."""


@dataclass(frozen=True, eq=False)
class Projector:
    """Factorized normal equations ``M q = b`` of one mesh.

    Attributes
    ----------
    points : (m, 3) float64
        Where the function must be known, mm, world (LPS).
    """

    points: NDArray[np.float64]
    _matrix: sp.csc_array
    _gather: sp.csr_array
    _weighted: NDArray[np.float64]
    _solve: Callable[[NDArray[np.float64]], NDArray[np.float64]]

    def project(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        """Degrees of freedom (n, 3) closest in L2 to the values (m, 3) at `points`.

        Parameters
        ----------
        values : (m, 3) float64
            Of the function, such as positions in mm, world (LPS).
        """
        moments = np.matmul(self._weighted, values.reshape(len(self._weighted), -1, 3))
        right = np.asarray(self._gather @ moments.reshape(-1, 3))
        dofs = self._solve(right)
        # One step of iterative refinement: the DOFs near the pole are poorly conditioned.
        return np.asarray(dofs + self._solve(right - self._matrix @ dofs))


def projector(mesh: HexMesh, n: tuple[int, int, int]) -> Projector:
    """Prepare the projection for a mesh.

    Minimizes ``int |x_h(xi) - f(xi)|^2 dV`` over the mesh (Lamata et al. 2011).

    Parameters
    ----------
    mesh : HexMesh
        Its volume is the measure of the integral.
    n : (int, int, int)
        Gauss points per element along xi1, xi2, xi3.

    Returns
    -------
    Projector
    """
    xi, w = gauss_cube(n)
    det = np.abs(determinants(mesh, xi))
    weights = np.maximum(det, POLE_WEIGHT * det.mean()) * w
    basis = tabulate(xi)
    extraction = mesh.topology.extraction
    e = mesh.n_elements
    weighted = basis.T * weights[:, None, :]
    mass = np.matmul(weighted, basis)
    rows = ORDER**3 * np.arange(e)[:, None, None] + np.arange(ORDER**3)[None, :, None]
    rows, columns = np.broadcast_arrays(rows, rows.transpose(0, 2, 1))
    block = sp.csr_array((mass.ravel(), (rows.ravel(), columns.ravel())))
    matrix = sp.csc_array(extraction.T @ block @ extraction)
    # Positive definite: pivots off the diagonal would only undo the ordering, and fill the factors.
    factor = spla.splu(
        matrix,
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return Projector(
        points=mesh.evaluate(xi).reshape(-1, 3),
        _matrix=matrix,
        _gather=sp.csr_array(extraction.T),
        _weighted=weighted,
        _solve=factor.solve,
    )
