"""The energy of a mesh: what its terms are, and how much each counts.

    E = E_out + E_in                       distances between mesh and patient   (`distances`)
      + sum_e w_e (E_det + E_angle)        quality of the elements              (`quality`)
      + sum_f (E_fair + E_smooth + E_place)  course of the lines                (`lines`)

The weights w_e of the elements are how the policy works (`policy`): quality can weigh more where an
element needs it; and all but the data can weigh less everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.biventricular_topology import right_apex
from heartgen.mesh.dof_map import DofMap, FaceDofMap
from heartgen.mesh.hexmesh import HexMesh
from heartgen.optimization.assembly import Assembler
from heartgen.optimization.distances import MeshToPatient, PatientToMesh
from heartgen.optimization.quality import EvenJacobians, RightAngles
from heartgen.optimization.settings import MOVEMENT, FitSettings
from heartgen.optimization.surface_lines import SurfaceLines
from heartgen.optimization.target import TRUNCATION_SURFACES, FitTarget
from heartgen.optimization.terms import Term


class Energy:
    """Energy of the meshes of a topology, as a function of the surfaces' degrees of freedom.

    Parameters
    ----------
    mesh : HexMesh
        The unoptimized mesh, mm, world (LPS).
    target : FitTarget
        What the mesh is to follow.
    settings : FitSettings
        Weights of the terms.
    """

    def __init__(self, mesh: HexMesh, target: FitTarget, settings: FitSettings) -> None:
        self.dof_map = DofMap(mesh.topology)
        faces = FaceDofMap(self.dof_map, mesh.topology)
        self.assembler = Assembler([self.dof_map.dofs, faces.dofs], self.dof_map.n)
        self._mesh, self._target, self._settings, self._faces = mesh, target, settings, faces
        self._unoptimized = faces.at(self.degrees(mesh))
        self._cut = np.zeros(len(faces.faces), dtype=bool)
        for name in TRUNCATION_SURFACES:
            self._cut[faces.rows.get(name, slice(0))] = True

    def degrees(self, mesh: HexMesh) -> NDArray[np.float64]:
        """Free degrees of freedom (n, 3) of a mesh.

        Parameters
        ----------
        mesh : HexMesh
            mm, world (LPS).
        """
        return mesh.dofs[self.dof_map.free]

    def shape(self, q: NDArray[np.float64]) -> HexMesh:
        """Mesh of free degrees of freedom (n, 3); straight across the wall.

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom, mm, world (LPS).
        """
        return self._mesh.with_dofs(np.asarray(self.dof_map.straight @ q))

    def terms(self, weight: NDArray[np.float64], regularization: float = 1.0) -> list[Term]:
        """Terms of the energy.

        Parameters
        ----------
        weight : (e,) float64
            Of the quality of each element.
        regularization : float
            Weight of all but the data.

        Returns
        -------
        list of Term
        """
        faces, target, s = self._faces, self._target, self._settings
        topology = self._mesh.topology
        data = np.full(topology.n_elements, 1 / (s.distance * target.voxel) ** 2)
        data[right_apex(topology)] *= s.right_apex
        data[topology.index[:, 2] == 0] *= s.apex
        of_face = faces.faces[:, 0]
        per_element = regularization * weight / topology.n_elements
        even = s.even * per_element
        even[topology.collapsed[:, 0]] *= s.pole
        # The cuts have no lines of their own: theirs are those of the walls that they end.
        per_face = np.where(self._cut, 0, regularization) / np.sum(~self._cut)
        left = ~np.isin(of_face, topology.parts.get("right ventricle", []))
        return [
            MeshToPatient(faces, target, np.where(self._cut, s.cut, 1) * data[of_face]),
            PatientToMesh(faces, target, data[of_face]),
            EvenJacobians(self.dof_map, topology, even),
            RightAngles(self.dof_map, s.angles * per_element),
            SurfaceLines(
                faces,
                self._unoptimized,
                s.fair * per_face,
                s.smooth * per_face,
                s.place * left * per_face,
                MOVEMENT * target.length,
            ),
        ]
