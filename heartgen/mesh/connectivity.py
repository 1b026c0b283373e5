"""What elements have in common: places that coincide whatever the degrees of freedom.

Two points of a mesh are one if they are the same combination of degrees of freedom. Random degrees
of freedom tell: combinations that differ then give different places, and the patient's shape,
where two points may touch by chance, has no say. This is decided here alone: what a mesh shares is
asked of its topology, which keeps nodes (`Topology.nodes`), versions (`Topology.versions`) and, for
points of any kind, `Topology.numbered`.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from heartgen.mesh.bernstein import ORDER
from heartgen.renamed import keep_former_names

SAME = 1e-9
"""Distance below which two generic places are one: far above the rounding of places of size 1, and
far below what sets different combinations apart."""


def random_dofs(extraction: sp.csr_array) -> NDArray[np.float64]:
    """Random degrees of freedom (n, 3) of size 1, always the same ones.

    Parameters
    ----------
    extraction : (64 e, n) sparse
        Says how many there are.
    """
    return np.random.default_rng(0).standard_normal((extraction.shape[1], 3))


def generic_control(
    extraction: sp.csr_array, generic_dofs: NDArray[np.float64] | None
) -> NDArray[np.float64]:
    """Bernstein coefficients of elements under generic degrees of freedom.

    Parameters
    ----------
    extraction : (64 e, n) sparse
        Bernstein coefficients of all elements from the n degrees of freedom.
    generic_dofs : (n, 3) float64 or None
        If elements do not meet under random ones, those under which they do, see `Topology`.

    Returns
    -------
    (e, 64, 3) float64
    """
    dofs = random_dofs(extraction) if generic_dofs is None else generic_dofs
    return np.asarray(extraction @ dofs).reshape(-1, ORDER**3, 3)


def corner_nodes(
    extraction: sp.csr_array, generic_dofs: NDArray[np.float64] | None = None
) -> NDArray[np.intp]:
    """Number the corner nodes of elements.

    Parameters
    ----------
    extraction : (64 e, n) sparse
        Bernstein coefficients of all elements from the n degrees of freedom.
    generic_dofs : (n, 3) float64, optional
        As of `generic_control`.

    Returns
    -------
    (e, 8) int
        xi1 fastest; counted from 0 in the order in which elements meet them.
    """
    ends = np.ix_(*[[0, ORDER - 1]] * 3)
    corners = np.arange(ORDER**3).reshape(ORDER, ORDER, ORDER)[ends].ravel()
    places = generic_control(extraction, generic_dofs)[:, corners]
    return merge_coincident(places.reshape(-1, 3))[0].reshape(len(places), -1)


def merge_coincident(places: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Number places so that those that coincide get the same number.

    Parameters
    ----------
    places : (n, d) float64
        Generic ones, of size 1.

    Returns
    -------
    number : (n,) int
        Counted from 0 in order of first appearance.
    first : (m,) int
        Where each number appears first.
    """
    pairs = cKDTree(places).query_pairs(SAME, output_type="ndarray")
    links = (np.ones(len(pairs), dtype=bool), (pairs[:, 0], pairs[:, 1]))
    graph = sp.coo_array(links, shape=(len(places), len(places)))
    _, component = connected_components(graph, directed=False)
    _, first, number = np.unique(component, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return rank[number], first[order]


keep_former_names(__name__)
