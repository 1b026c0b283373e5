"""Sparse normal equations, assembled from dense blocks of elements and faces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

SHIFT = 1e-10
"""Share of the largest diagonal entry added to all of them: the pole's are nearly free."""


@dataclass(frozen=True)
class Blocks:
    """Quadratic forms of single elements or faces.

    Attributes
    ----------
    dofs : (b, m) int
        Degrees of freedom of each block; number n stands for none.
    matrix : (b, 3 m, 3 m) float64
        Gauss-Newton matrix; x, y, z of each degree of freedom in turn.
    gradient : (b, 3 m) float64
    """

    dofs: NDArray[np.intp]
    matrix: NDArray[np.float64]
    gradient: NDArray[np.float64]


class Assembler:
    """Adds blocks to one sparse matrix; the pattern is worked out once."""

    def __init__(self, dofs: list[NDArray[np.intp]], n: int) -> None:
        self.n = n
        keys = [block[:, :, None] * (n + 1) + block[:, None, :] for block in dofs]
        pattern, slot = np.unique(np.concatenate([k.ravel() for k in keys]), return_inverse=True)
        row, self._column = np.divmod(pattern, n + 1)
        self._starts = np.searchsorted(row, np.arange(n + 2))
        ones = (np.ones(len(slot)), (slot, np.arange(len(slot))))
        self._gather = sp.csr_array(sp.coo_array(ones, shape=(len(pattern), len(slot))))

    def solve(self, blocks: list[Blocks]) -> NDArray[np.float64]:
        """Newton step (n, 3) that the blocks ask for; their `dofs` are those of the constructor."""
        entries = np.concatenate([_by_pairs(b.matrix) for b in blocks])
        data = np.asarray(self._gather @ entries).reshape(-1, 3, 3)
        size = 3 * (self.n + 1)
        whole = sp.bsr_array((data, self._column, self._starts), shape=(size, size))
        matrix = sp.csc_array(whole.tocsc()[: 3 * self.n, : 3 * self.n])
        shift = SHIFT * float(matrix.diagonal().max())
        matrix = sp.csc_array(matrix + shift * sp.eye_array(3 * self.n, format="csc"))
        right = np.zeros((self.n + 1, 3))
        for b in blocks:
            np.add.at(right, b.dofs.ravel(), b.gradient.reshape(-1, 3))
        factor = spla.splu(
            matrix,
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
        return np.asarray(-factor.solve(right[: self.n].ravel()).reshape(-1, 3))


def _by_pairs(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    """The 3 x 3 blocks (b m^2, 9) of matrices (b, 3 m, 3 m), pair by pair of their functions."""
    b, m = len(matrix), matrix.shape[1] // 3
    return np.asarray(matrix.reshape(b, m, 3, m, 3).transpose(0, 1, 3, 2, 4).reshape(-1, 9))
