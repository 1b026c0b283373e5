"""The free degrees of freedom of a mesh, and functions of them.

When the wall is straight across, all degrees of freedom follow from those of the surfaces; else all
are free. This module expresses points of elements and faces in these, sparsely or element by
element.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.bernstein import tabulate
from heartgen.mesh.hexmesh import COEFFICIENTS, HexMesh, Topology
from heartgen.mesh.surface_faces import (
    FACE_COEFFICIENTS,
    face_coefficients,
    face_control,
    face_signs,
    tabulate_face,
)

FACE_DERIVATIVES = ((0, 0), (1, 0), (0, 1))


class DofMap:
    """Free degrees of freedom of a topology: those of the surfaces, or all if it is `bent`.

    Attributes
    ----------
    topology : Topology
        With a straightening, unless `bent`.
    bent : bool
        Whether the wall may bend, so that all degrees of freedom are free.
    free : (n,) int
        Which degrees of freedom of the topology are free.
    straight : (m, n) sparse
        All m degrees of freedom from the free ones.
    extraction : (64 e, n) sparse
        Bernstein coefficients of the elements from the free degrees of freedom.
    """

    def __init__(self, topology: Topology, bent: bool = False) -> None:
        if topology.straightening is None:
            raise MeshError(
                f"a mesh in the {topology.basis} basis that was converted or read from a file "
                "cannot be optimized: optimize it before"
            )
        size = topology.extraction.shape[1]
        straightening = sp.csc_array(sp.eye_array(size) if bent else topology.straightening)
        self.free = np.flatnonzero(np.diff(straightening.indptr))
        self.straight = sp.csr_array(straightening[:, self.free])
        self.extraction = sp.csr_array(topology.extraction @ self.straight)

    @property
    def n(self) -> int:
        """Number of free degrees of freedom."""
        return len(self.free)

    @cached_property
    def _blocks(self) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Free degrees of freedom (e, m) of each element, and its extraction (e, 64, m)."""
        return _dense_blocks(self.extraction, COEFFICIENTS)

    @property
    def dofs(self) -> NDArray[np.intp]:
        """Free degrees of freedom of each element, (e, m) int; number n stands for none."""
        return self._blocks[0]

    def functions(
        self, xi: NDArray[np.float64], derivative: tuple[int, int, int] = (0, 0, 0)
    ) -> NDArray[np.float64]:
        """Functions of each element, or a derivative of them, at local coordinates.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates in the unit cube.
        derivative : (int, int, int)
            Order along xi1, xi2, xi3.

        Returns
        -------
        (e, q, m) float64
            One function for each of `dofs`.
        """
        return np.asarray(np.matmul(tabulate(xi, derivative), self._blocks[1]))

    def on_faces(
        self, faces: NDArray[np.intp], uv: NDArray[np.float64]
    ) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array]:
        """Value and the two tangents at points of faces.

        Parameters
        ----------
        faces : (p, 2) int
            (element, face) of each point.
        uv : (p, 2) float64
            Parameters on that face.

        Returns
        -------
        three (p, n) sparse
            Functions of the free degrees of freedom.
        """
        columns = COEFFICIENTS * faces[:, :1] + face_coefficients()[faces[:, 1]]
        starts = np.arange(0, FACE_COEFFICIENTS * len(uv) + 1, FACE_COEFFICIENTS)
        shape = (len(uv), self.extraction.shape[0])
        value, along_u, along_v = (
            sp.csr_array(
                sp.csr_array((tabulate_face(uv, d).ravel(), columns.ravel(), starts), shape=shape)
                @ self.extraction
            )
            for d in FACE_DERIVATIVES
        )
        return value, along_u, along_v


class FaceDofMap:
    """Free degrees of freedom of the named faces of a topology.

    Attributes
    ----------
    dof_map : DofMap
        Free degrees of freedom of the same topology.
    topology : Topology
        Whose named faces are taken.
    faces : (f, 2) int
        All named faces, (element, face).
    rows : dict of str to slice
        Where the faces of each surface stand in that list.
    signs : (f,) float64
        +1 where the product of a face's tangents points out of the element.
    dofs : (f, m) int
        Free degrees of freedom of each face; number n stands for none.
    extraction : (f, 48, 3 m) float64
        Coordinates of the Bernstein coefficients of each face from those of its `dofs`.
    """

    def __init__(self, dof_map: DofMap, topology: Topology) -> None:
        self.faces = topology.external
        ends = np.cumsum([0] + [len(f) for f in topology.surfaces.values()])
        self.rows = {
            name: slice(int(a), int(b))
            for name, a, b in zip(topology.surfaces, ends[:-1], ends[1:], strict=True)
        }
        self.signs = face_signs()[self.faces[:, 1]]
        columns = COEFFICIENTS * self.faces[:, :1] + face_coefficients()[self.faces[:, 1]]
        part = sp.csr_array(dof_map.extraction[columns.ravel()])
        self.dofs, local = _dense_blocks(part, FACE_COEFFICIENTS)
        space = np.einsum("fam,xy->faxmy", local, np.eye(3))
        self.extraction = space.reshape(len(local), 3 * FACE_COEFFICIENTS, -1)

    def control(self, mesh: HexMesh) -> NDArray[np.float64]:
        """Bernstein coefficients of the faces, (f, 16, 3) float64, mm, world (LPS).

        Parameters
        ----------
        mesh : HexMesh
            mm, world (LPS).
        """
        return face_control(mesh, self.faces)

    def at(self, q: NDArray[np.float64]) -> NDArray[np.float64]:
        """Bernstein coefficients (f, 16, 3) of the faces from free degrees of freedom (n, 3).

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom, mm, world (LPS).
        """
        local = np.concatenate([q, np.zeros((1, 3))])[self.dofs].reshape(len(self.dofs), -1, 1)
        control = np.matmul(self.extraction, local)
        return np.asarray(control.reshape(-1, FACE_COEFFICIENTS, 3))


def _dense_blocks(
    extraction: sp.csr_array, size: int
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Columns (b, m) in use by each run of `size` rows, and these rows densely (b, size, m)."""
    n = extraction.shape[1]
    block = extraction.tocoo()
    owner, row = np.divmod(block.row, size)
    pairs, at = np.unique(owner * (n + 1) + block.col, return_inverse=True)
    of = pairs // (n + 1)
    count = np.bincount(of)
    place = np.arange(len(pairs)) - (np.cumsum(count) - count)[of]
    dofs = np.full((len(count), count.max()), n)
    dofs[of, place] = pairs % (n + 1)
    local = np.zeros((len(count), size, count.max()))
    local[owner, row, place[at]] = block.data
    return dofs, local
