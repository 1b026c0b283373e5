"""Topology: how degrees of freedom make tricubic elements, and what the parts are called."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER, tabulate
from heartgen.mesh.connectivity import generic_control, merge_coincident
from heartgen.mesh.corner_parameters import CORNERS, PARAMETERS, corner_parameters
from heartgen.mesh.versions import Versions, versions_of

COEFFICIENTS = ORDER**3

ROUNDING = 1e-13
"""Distance from a whole number within which the weight of a degree of freedom is that number."""


@dataclass(frozen=True, eq=False)
class Topology:
    """How degrees of freedom make elements, and what the parts of the mesh are called.

    Attributes
    ----------
    extraction : (64 e, n) sparse
        Bernstein coefficients of all elements from the n degrees of freedom.
    shape : (int, int, int)
        Elements (radial, circumferential, longitudinal). A square patch at the apex is one row.
    index : (e, 3) int
        Place of each element in that structure: (radial, circumferential, longitudinal). The
        elements of a square patch are those of row 0, counted through.
    surfaces : mapping of str to (f, 2) int
        Named external surfaces, ``apex`` being the side of an apical hole, as (element, face);
        faces are numbered xi1=0, xi1=1, xi2=0, xi2=1, xi3=0, xi3=1. Local directions: xi1
        circumferential, xi2 apex to base, xi3 endocardium to epicardium (right-handed).
    collapsed : (m, 2) int
        Faces of zero area (the pole), where det J = 0 by construction.
    nodes : (e, 8) int
        Corner nodes of each element, xi1 fastest; repeated where the element collapses.
    constant : (n,) float64
        Degrees of freedom of the function 1.
    straightening : (n, n) sparse or None
        Degrees of freedom after linearization across the wall, from those before; None if the
        topology does not know how its wall is to be straightened.
    parts : mapping of str to (m,) int
        Named regions: their elements.
    patches : mapping of str to (f, 2) int
        Named pieces of the surfaces, as (element, face).
    basis : {"hermite", "lagrange"}
        What the degrees of freedom are: values and derivatives at the nodes, or values on the
        lattices of the elements.
    hermite : Topology or None
        The cubic Hermite topology that one of the Lagrange basis was made from.
    generic_dofs : (n, 3) float64 or None
        Degrees of freedom of size 1 under which elements meet where they are to meet, if not all do
        so: in files, each element may have derivatives of its own. None if all do.

    Examples
    --------
    >>> from heartgen.mesh.hermite import cup_topology
    >>> topology = cup_topology((1, 12, 6))
    >>> topology.n_elements, sorted(topology.surfaces)
    (72, ['base', 'epi', 'lv_endo'])
    >>> topology.surfaces["base"].shape, len(topology.collapsed)
    ((12, 2), 12)
    """

    extraction: sp.csr_array
    shape: tuple[int, int, int]
    index: NDArray[np.intp]
    surfaces: Mapping[str, NDArray[np.intp]]
    collapsed: NDArray[np.intp]
    nodes: NDArray[np.intp]
    constant: NDArray[np.float64]
    straightening: sp.csr_array | None = field(repr=False)
    parts: Mapping[str, NDArray[np.intp]] = field(default_factory=dict)
    patches: Mapping[str, NDArray[np.intp]] = field(default_factory=dict)
    basis: Literal["hermite", "lagrange"] = "hermite"
    hermite: Topology | None = field(default=None, repr=False)
    generic_dofs: NDArray[np.float64] | None = field(default=None, repr=False)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return len(self.index)

    @cached_property
    def generic(self) -> NDArray[np.float64]:
        """Bernstein coefficients (e, 64, 3) of size 1 under which only what is one coincides."""
        return generic_control(self.extraction, self.generic_dofs)

    @cached_property
    def versions(self) -> Versions:
        """Versions of the nodal parameters, by `nodes`."""
        one = corner_parameters().reshape(CORNERS * PARAMETERS, -1)
        return versions_of(self.functionals(one), self.nodes)

    def numbered(self, xi: NDArray[np.float64]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Number points of all elements; those in which elements meet are one.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates, the same for every element.

        Returns
        -------
        number : (e, q) int
            Counted from 0 in order of first appearance.
        first : (m,) int
            Where each number appears first among the e q points.
        """
        places = np.matmul(tabulate(xi), self.generic)
        number, first = merge_coincident(places.reshape(-1, 3))
        return number.reshape(len(places), -1), first

    def functionals(self, one: NDArray[np.float64]) -> sp.csr_array:
        """Linear functions of the coefficients of every element, as ones of the degrees of freedom.

        Parameters
        ----------
        one : (m, 64) float64
            Weights of the coefficients of one element.

        Returns
        -------
        (m e, n) sparse
            Weights of the degrees of freedom; whole numbers where they are but for rounding, so
            that a degree of freedom that is asked for comes back to the bit.
        """
        rows = sp.csr_array(sp.kron(sp.eye_array(self.n_elements), sp.csr_array(one)))
        rows = sp.csr_array(rows @ self.extraction)
        whole = np.rint(rows.data)
        rows.data = np.where(np.abs(rows.data - whole) < ROUNDING, whole, rows.data)
        rows.eliminate_zeros()
        return rows

    @property
    def external(self) -> NDArray[np.intp]:
        """All named faces, (f, 2) int: (element, face)."""
        return np.concatenate(list(self.surfaces.values()))
