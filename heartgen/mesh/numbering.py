"""Which corners of elements are one node: those that coincide whatever the degrees of freedom."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER

DIGITS = 9
"""Decimals to which places made from random numbers of size 1 are compared."""


def corner_nodes(
    extraction: sp.csr_array, generic_dofs: NDArray[np.float64] | None = None
) -> NDArray[np.intp]:
    """Number the corner nodes of elements.

    Parameters
    ----------
    extraction : (64 e, n) sparse
        Bernstein coefficients of all elements from the n degrees of freedom.
    generic_dofs : (n, 3) float64, optional
        See `heartgen.mesh.hexmesh.Topology`.

    Returns
    -------
    (e, 8) int
        xi1 fastest; counted from 0 in the order in which elements meet them.
    """
    ends = np.array([0, ORDER - 1])
    corners = (ends[None, None, :] + ORDER * ends[None, :, None]).reshape(1, -1)
    corners = (corners + ORDER**2 * ends[:, None]).ravel()
    random = np.random.default_rng(0).standard_normal((extraction.shape[1], 3))
    dofs = random if generic_dofs is None else generic_dofs
    places = np.asarray(extraction @ dofs).reshape(-1, ORDER**3, 3)[:, corners].reshape(-1, 3)
    _, first, number = np.unique(
        np.round(places, DIGITS), axis=0, return_index=True, return_inverse=True
    )
    rank = np.empty(len(first), dtype=np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[number.ravel()].reshape(-1, 8)
