"""Material points of the left ventricle are anatomy: apex, insertion lines, borders of segments.

Nodes may slide along the wall, but not drift: movement from the unrefined mesh beyond a leeway is
penalised, and more from step to step where it is too far.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.freedom import FaceFreedom
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surfaces import tabulate_face
from heartgen.refinement.distances import FACE_SAMPLES, Distances, to_patient, unit
from heartgen.refinement.patient import Patient

LEEWAY, LARGEST_LEEWAY = 1 / 38, 2.4
"""Movement that is free, over the length of the ventricle, and mm at most..."""

DRIFT = 1 / 90
"""...and the excess that weighs as much as one unit of the quality terms."""

FARTHEST, FARTHEST_OF_ALL = 1 / 30, 2.85
"""Movement, over the length of the ventricle, and mm at most, beyond which a face is held: from
step to step its movement weighs more."""

MOST_HELD = 100.0
"""Largest factor by which it weighs more."""

YIELDING = 8.0
"""Firmness from which elements are held less: those that still fold then do so at their anchor."""


@dataclass(frozen=True)
class Anchor:
    """Where material points were, and how they are held to it.

    Attributes
    ----------
    mesh : HexMesh
        The mesh whose material points are to be kept, mm, world (LPS).
    faces : FaceFreedom
    leeway : float
        Movement that is free, mm.
    farthest : (f,) float64
        Movement of each face beyond which it is held more and more, mm.
    stiffening : (f,) float64
        Power of the excess by which it is.
    held : (f,) float64
        Weight of each face's movement; 0 on the right ventricle's.
    """

    mesh: HexMesh
    faces: FaceFreedom
    leeway: float
    farthest: NDArray[np.float64]
    stiffening: NDArray[np.float64]
    held: NDArray[np.float64]

    def drift(self, mesh: HexMesh) -> Distances:
        """Movement of a mesh beyond the leeway, weighted by face."""
        return drift(mesh, self.mesh, self.faces, self.leeway).trusted(self.held)

    def tightened(self, mesh: HexMesh) -> Anchor:
        """Return the same, holding those faces of a mesh more that moved too far."""
        moved = drift(mesh, self.mesh, self.faces, self.leeway).largest(len(self.held))
        excess = np.maximum(moved / (self.farthest - self.leeway), 1)
        return replace(self, held=np.minimum(self.held * excess**self.stiffening, MOST_HELD))


def anchored(
    mesh: HexMesh,
    faces: FaceFreedom,
    patient: Patient,
    stiffening: float,
    cut: float,
    firmness: NDArray[np.float64],
) -> Anchor:
    """Anchor at a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : FaceFreedom
    patient : Patient
    stiffening : float
        Power of the excess over the farthest movement by which movement weighs more.
    cut : float
        Weight of distances at the base and at an apical hole, relative to those elsewhere.
    firmness : (e,) float64
        Greatest firmness around each element.

    Returns
    -------
    Anchor
    """
    leeway = min(LEEWAY * patient.length, LARGEST_LEEWAY)
    of_face = faces.faces[:, 0]
    free = np.isin(of_face, mesh.topology.parts.get("right ventricle", []))
    # A face that lies farther from the patient must move as far.
    away = to_patient(mesh, faces, patient, cut).largest(len(of_face))
    return Anchor(
        mesh,
        faces,
        leeway,
        np.maximum(away, min(FARTHEST * patient.length, FARTHEST_OF_ALL)),
        stiffening * np.minimum(1, YIELDING / firmness[of_face]),
        np.where(free, 0.0, 1.0),
    )


def drift(mesh: HexMesh, anchor: HexMesh, faces: FaceFreedom, leeway: float) -> Distances:
    """Movement from the anchor beyond a leeway, mm, at samples of the faces and of their edges."""
    t = np.linspace(0, 1, FACE_SAMPLES)
    uv = np.stack(np.meshgrid(t, t), -1).reshape(-1, 2)
    basis = tabulate_face(uv)
    control = faces.control(mesh)
    moved = np.matmul(basis, control - faces.control(anchor))
    tangents = [np.matmul(tabulate_face(uv, d), control) for d in ((1, 0), (0, 1))]
    area = np.linalg.norm(np.cross(*tangents), axis=-1)
    beyond = np.linalg.norm(moved, axis=-1) - leeway
    return Distances(
        np.repeat(np.arange(len(control)), len(uv)),
        np.tile(basis, (len(control), 1)),
        unit(moved).reshape(-1, 3),
        np.maximum(beyond, 0).ravel(),
        np.where(beyond > 0, area / area.sum(), 0).ravel(),
    )
