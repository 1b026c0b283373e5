"""Versions of the nodal parameters: value and seven derivatives, as often as they differ.

An element's 64 Bernstein coefficients are eight parameters at each of its eight corners: value,
d/ds1, d/ds2, d2/ds1ds2, d/ds3, d2/ds1ds3, d2/ds2ds3, d3/ds1ds2ds3, where s is xi. Corners that meet
at a node share a parameter if it is the same combination of degrees of freedom in both; where it is
not, as at the pole, the node has several versions of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.mesh.connectivity import merge_coincident, random_dofs
from heartgen.mesh.corner_parameters import CORNERS, PARAMETERS


@dataclass(frozen=True, eq=False)
class Versions:
    """Table of the versions at all nodes, and which of them each element corner takes.

    Attributes
    ----------
    weights : (m, n) sparse
        Parameters from the n degrees of freedom, ordered by node, derivative and version. One that
        no degree of freedom moves, such as d/ds1 at the pole, has none.
    counts : (k, 8) int
        Versions of each derivative at each of k nodes.
    version : (e, 8, 8) int
        Version, counted from 0, of each derivative at each element corner, xi1 fastest.
    """

    weights: sp.csr_array
    counts: NDArray[np.intp]
    version: NDArray[np.intp]


def versions_of(rows: sp.csr_array, nodes: NDArray[np.intp]) -> Versions:
    """The versions of a mesh, as few as there can be.

    Parameters
    ----------
    rows : (64 e, n) sparse
        Parameters by (element, corner, derivative) from the degrees of freedom.
    nodes : (e, 8) int
        Corner nodes of each element.

    Returns
    -------
    Versions
    """
    slot = (PARAMETERS * nodes[..., None] + np.arange(PARAMETERS)).ravel()
    # The slot is a coordinate of its own: only parameters of one kind at one node may coincide.
    number, first = merge_coincident(np.column_stack([rows @ random_dofs(rows), slot]))
    order = np.argsort(slot[first], kind="stable")
    counts = np.bincount(slot[first], minlength=PARAMETERS * (int(nodes.max()) + 1))
    version = np.empty(len(first), dtype=np.intp)
    version[order] = np.arange(len(first)) - np.repeat(np.cumsum(counts) - counts, counts)
    return Versions(
        weights=rows[first[order]],
        counts=counts.reshape(-1, PARAMETERS),
        version=version[number].reshape(-1, CORNERS, PARAMETERS),
    )
