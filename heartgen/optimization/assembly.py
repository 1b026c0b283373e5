"""Sparse normal equations, assembled from dense blocks of elements and faces.

They are symmetric and positive definite, and the degrees of freedom can be put in an order in which
all entries are near the diagonal: the heart is longer than its wall is wide. A banded Cholesky
factorization, dense inside the band, is then two to four times as fast as a general sparse one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import reverse_cuthill_mckee

from heartgen.mesh.dof_map import FaceDofMap
from heartgen.optimization.settings import RIDGE


@dataclass(frozen=True, eq=False)
class Blocks:
    """Quadratic forms of single elements or faces.

    Attributes
    ----------
    dofs : (b, m) int
        Degrees of freedom of each block; number n stands for none.
    matrix : (b, 3 m, 3 m) float64
        Gauss-Newton matrix; x, y, z of each degree of freedom in turn.
    gradient : (b, 3 m) float64
        Of half the sum of squares; in the order of the matrix.
    """

    dofs: NDArray[np.intp]
    matrix: NDArray[np.float64]
    gradient: NDArray[np.float64]


def face_blocks(
    faces: FaceDofMap, matrix: NDArray[np.float64], gradient: NDArray[np.float64]
) -> Blocks:
    """Blocks of free degrees of freedom from those of the faces' Bernstein coefficients.

    Parameters
    ----------
    faces : FaceDofMap
        Free degrees of freedom of the faces.
    matrix : (f, 48, 48) float64
        Of the coefficients of each face: x, y, z of each in turn.
    gradient : (f, 48) float64
        In the same order.

    Returns
    -------
    Blocks
    """
    of_dofs = faces.extraction
    across = of_dofs.transpose(0, 2, 1)
    return Blocks(
        faces.dofs,
        np.matmul(np.matmul(across, matrix), of_dofs),
        np.matmul(across, gradient[..., None])[..., 0],
    )


class Assembler:
    """Adds blocks to one banded matrix; order and pattern are worked out once.

    Parameters
    ----------
    dofs : list of (b, m) int
        Degrees of freedom of the kinds of blocks, such as those of elements and of faces.
    n : int
        Number of degrees of freedom.
    held : (n,) bool, optional
        Those that no step moves.
    """

    def __init__(
        self, dofs: list[NDArray[np.intp]], n: int, held: NDArray[np.bool_] | None = None
    ) -> None:
        self._kinds = dofs
        self._free = np.arange(n) if held is None else np.flatnonzero(~held)
        self._n = n
        free = len(self._free)
        renumbered = np.full(n + 1, free)
        renumbered[self._free] = np.arange(free)
        row = renumbered[np.concatenate([np.repeat(d, d.shape[1], axis=1).ravel() for d in dofs])]
        column = renumbered[np.concatenate([np.tile(d, d.shape[1]).ravel() for d in dofs])]
        pair, n_pairs = np.flatnonzero((row < free) & (column < free)), len(row)
        graph = sp.csr_array((np.ones(len(pair)), (row[pair], column[pair])), shape=(free, free))
        self._order = reverse_cuthill_mckee(graph, symmetric_mode=True)
        row, column = np.argsort(self._order)[[row[pair], column[pair]]]
        pair, row, column = (of[row >= column] for of in (pair, row, column))
        pattern, slot = np.unique(row * free + column, return_inverse=True)
        gather = sp.coo_array((np.ones(len(slot)), (slot, pair)), shape=(len(pattern), n_pairs))
        self._gather = sp.csr_array(gather)
        first, second = (3 * k[:, None] for k in np.divmod(pattern, free))
        first, second = first + np.repeat(np.arange(3), 3), second + np.tile(np.arange(3), 3)
        self._lower = first >= second
        below, along = (first - second)[self._lower], second[self._lower]
        self._width = int(below.max()) + 1
        self._slot = along * self._width + below

    def solve(self, blocks: list[Blocks]) -> NDArray[np.float64]:
        """Newton step (n, 3) that the blocks ask for; each kind of `dofs` has at least one.

        Not a number throughout where rounding leaves no positive definite system to solve, as
        that of elements that have shrunk to nothing.

        Parameters
        ----------
        blocks : list of Blocks
            Of all terms.
        """
        blocks = [_added([b for b in blocks if b.dofs is dofs]) for dofs in self._kinds]
        entries = np.concatenate([_by_pairs(b.matrix) for b in blocks])
        values = np.zeros(3 * len(self._free) * self._width)
        values[self._slot] = (self._gather @ entries)[self._lower]
        band = values.reshape((self._width, 3 * len(self._free)), order="F")  # as LAPACK wants it
        band[0] += RIDGE * band[0].max()
        right = np.zeros((self._n + 1, 3))
        for b in blocks:
            np.add.at(right, b.dofs.ravel(), b.gradient.reshape(-1, 3))
        try:
            factor = scipy.linalg.cholesky_banded(
                band, overwrite_ab=True, lower=True, check_finite=False
            )
        except np.linalg.LinAlgError:
            return np.full((self._n, 3), np.nan)
        moved = self._free[self._order]
        step = np.zeros((self._n, 3))
        step[moved] = -scipy.linalg.cho_solve_banded(
            (factor, True), right[moved].ravel(), overwrite_b=True, check_finite=False
        ).reshape(-1, 3)
        return step


def _added(blocks: list[Blocks]) -> Blocks:
    """The sum of blocks of the same degrees of freedom."""
    first, *others = blocks
    matrix, gradient = first.matrix, first.gradient
    for other in others:
        matrix, gradient = matrix + other.matrix, gradient + other.gradient
    return Blocks(first.dofs, matrix, gradient)


def _by_pairs(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 3 x 3 blocks (b m^2, 9) of matrices (b, 3 m, 3 m), pair by pair of their functions."""
    b, m = len(matrix), matrix.shape[1] // 3
    return np.asarray(matrix.reshape(b, m, 3, m, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 9))
