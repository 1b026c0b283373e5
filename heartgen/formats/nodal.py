"""Nodal parameters of tricubic Hermite elements: value and seven derivatives, with versions.

An element's 64 Bernstein coefficients are eight parameters at each of its eight corners: value,
d/ds1, d/ds2, d2/ds1ds2, d/ds3, d2/ds1ds3, d2/ds2ds3, d3/ds1ds2ds3, where s is xi. Corners that meet
at a node share a parameter if it is the same combination of degrees of freedom in both; where it is
not, as at the pole, the node has several versions of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bases import CORNERS, PARAMETERS, corner_parameters
from heartgen.mesh.connectivity import merge_coincident, random_dofs
from heartgen.mesh.hexmesh import HexMesh


@dataclass(frozen=True, eq=False)
class NodalParameters:
    """Parameters of all nodes, and which of them each element corner takes.

    Attributes
    ----------
    values : (m, 3) float64
        Parameters, mm, world (LPS), ordered by node, derivative and version.
    counts : (n, 8) int
        Versions of each derivative at each node.
    version : (e, 8, 8) int
        Version, counted from 0, of each derivative at each element corner, xi1 fastest.
    """

    values: NDArray[np.float64]
    counts: NDArray[np.intp]
    version: NDArray[np.intp]


def nodal_parameters(mesh: HexMesh) -> NodalParameters:
    """Nodal parameters of a mesh, exact, with as few versions as there can be.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    NodalParameters
        A parameter that no degree of freedom moves, such as d/ds1 at the pole, is exactly zero.
    """
    topology = mesh.topology
    rows = topology.functionals(corner_parameters().reshape(CORNERS * PARAMETERS, -1))
    slot = (PARAMETERS * topology.nodes[..., None] + np.arange(PARAMETERS)).ravel()
    # The slot is a coordinate of its own: only parameters of one kind at one node may coincide.
    number, first = merge_coincident(np.column_stack([rows @ random_dofs(topology), slot]))
    order = np.argsort(slot[first], kind="stable")
    counts = np.bincount(slot[first], minlength=PARAMETERS * (int(topology.nodes.max()) + 1))
    version = np.empty(len(first), dtype=np.intp)
    version[order] = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    return NodalParameters(
        values=np.asarray(rows @ mesh.dofs)[first[order]],
        counts=counts.reshape(-1, PARAMETERS),
        version=version[number].reshape(-1, CORNERS, PARAMETERS),
    )
