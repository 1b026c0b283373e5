"""What elements have in common: places that coincide whatever the degrees of freedom.

Two points of a mesh are one if they are the same combination of degrees of freedom. Random degrees
of freedom tell: combinations that differ then give different places, and the patient's shape,
where two points may touch by chance, has no say.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from heartgen.mesh.hexmesh import HexMesh, Topology

SAME = 1e-9
"""Distance below which two places of the generic mesh are one: far above the rounding of places of
size 1, and far below what sets different combinations apart."""


def generic_mesh(topology: Topology) -> HexMesh:
    """Mesh of a topology with random degrees of freedom, always the same ones, of size 1.

    If elements do not meet under random ones, the degrees of freedom are those under which they do.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    """
    generic_dofs = topology.generic_dofs
    return HexMesh(random_dofs(topology) if generic_dofs is None else generic_dofs, topology)


def random_dofs(topology: Topology) -> NDArray[np.float64]:
    """Random degrees of freedom (n, 3) of size 1, always the same ones.

    Parameters
    ----------
    topology : Topology
        Says how many there are.
    """
    return np.random.default_rng(0).standard_normal((topology.extraction.shape[1], 3))


def merge_coincident(places: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Number places so that those that coincide get the same number.

    Parameters
    ----------
    places : (n, d) float64
        Of a `generic_mesh`.

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
