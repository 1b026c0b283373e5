"""HexMesh: tricubic hexahedra whose Bernstein coefficients are `extraction @ dofs`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, Protocol

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER, lattice, subdivision, tabulate
from heartgen.mesh.numbering import corner_nodes

COEFFICIENTS = ORDER**3

ROUNDING = 1e-13
"""Distance from a whole number within which the weight of a degree of freedom is that number."""


@dataclass(frozen=True)
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


class Grid(Protocol):
    """Voxels and where they are."""

    @property
    def voxels(self) -> NDArray[Any]:
        """(nx, ny, nz)."""

    @property
    def affine(self) -> NDArray[np.float64]:
        """Voxel index to world coordinates, (4, 4), mm, LPS."""


@dataclass(frozen=True)
class HexMesh:
    """A mesh of tricubic hexahedra.

    Attributes
    ----------
    dofs : (n, 3) float64
        Degrees of freedom, mm, world (LPS).
    topology : Topology
        Shared by all meshes that differ only in shape.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> mesh.n_elements, mesh.dofs.shape
    (72, (1164, 3))
    >>> mesh.evaluate(np.full((1, 3), 0.5)).shape  # the middle of each element
    (72, 1, 3)
    >>> mesh.refined(radial=2).n_elements
    144
    """

    dofs: NDArray[np.float64]
    topology: Topology

    @cached_property
    def control(self) -> NDArray[np.float64]:
        """Bernstein coefficients, (e, 64, 3) float64, mm, world (LPS)."""
        return np.asarray(self.topology.extraction @ self.dofs).reshape(-1, COEFFICIENTS, 3)

    @property
    def n_elements(self) -> int:
        """Number of elements."""
        return self.topology.n_elements

    def evaluate(self, xi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions at the same local coordinates of every element.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates.

        Returns
        -------
        (e, q, 3) float64, mm, world (LPS)
        """
        return np.asarray(np.matmul(tabulate(xi), self.control))

    def gradient(self, xi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Jacobian matrices dx/dxi at the same local coordinates of every element.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates.

        Returns
        -------
        (e, q, 3, 3) float64
            Last axis is the xi direction; mm.
        """
        directions = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
        return np.stack([np.matmul(tabulate(xi, d), self.control) for d in directions], -1)

    def with_dofs(self, dofs: NDArray[np.float64]) -> HexMesh:
        """Return the mesh of the same topology with other degrees of freedom (n, 3), mm, LPS.

        Parameters
        ----------
        dofs : (n, 3) float64
            mm, world (LPS).
        """
        return HexMesh(np.asarray(dofs, dtype=float), self.topology)

    def transformed(self, affine: NDArray[np.float64]) -> HexMesh:
        """Return the mesh under an affine map.

        Parameters
        ----------
        affine : (4, 4) float64
            mm, world (LPS) to world.

        Returns
        -------
        HexMesh
            Exact: the space of a mesh contains all its affine images.
        """
        shift = np.outer(self.topology.constant, affine[:3, 3])
        return self.with_dofs(self.dofs @ affine[:3, :3].T + shift)

    def lagrange_points(self) -> NDArray[np.float64]:
        """Positions at the 4x4x4 Lagrange nodes of each element, (e, 64, 3), xi1 fastest, mm, LPS.

        They are the cubic Lagrange coefficients of the very same geometry.
        """
        values = self.topology.functionals(tabulate(lattice())) @ self.dofs
        return np.asarray(values).reshape(-1, COEFFICIENTS, 3)

    def rasterize(self, like: Grid, partial: bool = False) -> NDArray[np.float32]:
        """Return the image of the mesh on the voxels of another image.

        Parameters
        ----------
        like : Mask, or anything with its `voxels` and `affine`
            The image whose voxels are taken; mm, world (LPS).
        partial : bool
            Give the share of each voxel that is in the mesh, not whether its center is.

        Returns
        -------
        (nx, ny, nz) float32
            0 to 1, see `heartgen.mesh.rasterization.rasterize`.
        """
        from heartgen.mesh.rasterization import rasterize

        return rasterize(self, like.voxels.shape, like.affine, partial)

    def refined(self, radial: int = 1, circumferential: int = 1, longitudinal: int = 1) -> HexMesh:
        """Split every element; the geometry and the degrees of freedom stay the same.

        Parameters
        ----------
        radial, circumferential, longitudinal : int
            Pieces per element in each direction.

        Returns
        -------
        HexMesh
        """
        return replace(
            self, topology=_refine(self.topology, (circumferential, longitudinal, radial))
        )

    def to_lagrange(self, order: int = 3) -> HexMesh:
        """Return the mesh in the Lagrange basis: values on a lattice in each element, C0.

        Parameters
        ----------
        order : {1, 2, 3}
            3 leaves the geometry as it is. Lower orders resample it: the elements then pass
            through lattices of 2 or 3 points per direction; `heartgen.mesh.bases.deviation` tells
            how far that moves them.

        Returns
        -------
        HexMesh
            Still of tricubic elements, which contain those of lower order.
        """
        from heartgen.mesh.bases import to_lagrange

        return to_lagrange(self, order)

    def to_hermite(self) -> HexMesh:
        """Return the mesh in the cubic Hermite basis; the geometry stays as it is.

        Returns
        -------
        HexMesh
            In the topology that the mesh had before `to_lagrange` if its geometry lies in that;
            otherwise nodes have versions of the derivatives in which their elements differ.
        """
        from heartgen.mesh.bases import to_hermite

        return to_hermite(self)


def _refine(topology: Topology, pieces: tuple[int, int, int]) -> Topology:
    """Topology with every element split into pieces along (xi1, xi2, xi3)."""
    split = [subdivision(n) for n in pieces]
    cells = [
        (i, j, k) for k in range(pieces[2]) for j in range(pieces[1]) for i in range(pieces[0])
    ]
    blocks = [np.kron(split[2][k], np.kron(split[1][j], split[0][i])) for i, j, k in cells]
    n_cells, n_old = len(cells), topology.n_elements
    extraction = sp.csr_array(
        sp.kron(sp.eye_array(n_old), sp.csr_array(np.concatenate(blocks))) @ topology.extraction
    )
    cell = np.array(cells)
    in_structure = cell[:, [2, 0, 1]]
    factor = np.array([pieces[2], pieces[0], pieces[1]])
    index = (topology.index[:, None, :] * factor + in_structure[None]).reshape(-1, 3)

    def split_faces(faces: NDArray[np.intp]) -> NDArray[np.intp]:
        out = []
        for element, face in faces:
            axis, end = divmod(int(face), 2)
            on_face = np.flatnonzero(cell[:, axis] == (pieces[axis] - 1 if end else 0))
            out.append(np.stack([element * n_cells + on_face, np.full(len(on_face), face)], -1))
        return np.concatenate(out) if out else np.zeros((0, 2), dtype=np.intp)

    return replace(
        topology,
        extraction=extraction,
        shape=tuple(int(n * f) for n, f in zip(topology.shape, factor, strict=True)),  # type: ignore[arg-type]
        index=index,
        surfaces={name: split_faces(f) for name, f in topology.surfaces.items()},
        collapsed=split_faces(topology.collapsed),
        nodes=corner_nodes(extraction, topology.generic_dofs),
        parts={
            name: (n_cells * part[:, None] + np.arange(n_cells)).ravel()
            for name, part in topology.parts.items()
        },
        patches={name: split_faces(f) for name, f in topology.patches.items()},
        hermite=None if topology.hermite is None else _refine(topology.hermite, pieces),
    )
