"""Distances between mesh and patient in both directions, label by label."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numba as nb
import numpy as np
from numpy.typing import NDArray

from heartgen.images.isosurface import Isosurface
from heartgen.mesh.closest import closest_points
from heartgen.mesh.freedom import FaceFreedom
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surfaces import FACE_COEFFICIENTS, tabulate_face
from heartgen.refinement.assembly import Blocks
from heartgen.refinement.patient import CUTS, Patient

FACE_SAMPLES = 6
"""Samples per face and direction for the distance from mesh to patient."""

CANDIDATES = 1
"""Places on the mesh from which the closest point is searched: the error is that of the nearest
sample's face at worst, and the next step matches anew."""

FACING = 0.3
"""Least cosine between the normals of patient and mesh at points that belong together."""

OUTLIER = 3.0
"""Distance, in units of the scale of a voxel, at which a point of the patient counts half."""


@dataclass(frozen=True)
class Distances:
    """Linearised distances: rows of ``normal . x`` at points of faces.

    Attributes
    ----------
    face : (p,) int
        Row of the face in `FaceFreedom`.
    functions : (p, 16) float64
        Bernstein functions at the point.
    normal : (p, 3) float64
    value : (p,) float64
        Distance, mm.
    weight : (p,) float64
    """

    face: NDArray[np.intp]
    functions: NDArray[np.float64]
    normal: NDArray[np.float64]
    value: NDArray[np.float64]
    weight: NDArray[np.float64]

    @property
    def mean_square(self) -> float:
        """Weighted mean squared distance, mm^2 (the weights have sum 1, or more at the base)."""
        return float(self.weight @ self.value**2)

    def largest(self, n: int) -> NDArray[np.float64]:
        """Largest distance (n,) on each of n faces, mm."""
        out = np.zeros(n)
        np.maximum.at(out, self.face, np.abs(self.value))
        return out

    def trusted(self, trust: NDArray[np.float64]) -> Distances:
        """Return the same with the weights multiplied by a factor (f,) for each face."""
        return replace(self, weight=self.weight * trust[self.face])


def to_patient(mesh: HexMesh, faces: FaceFreedom, patient: Patient, cut_weight: float) -> Distances:
    """Signed distances of the patient's surfaces at samples of the mesh's faces."""
    uv, w = gauss_square(FACE_SAMPLES)
    basis = tabulate_face(uv)
    control = faces.control(mesh)
    points = np.matmul(basis, control)
    tangents = [np.matmul(tabulate_face(uv, d), control) for d in ((1, 0), (0, 1))]
    area = np.linalg.norm(np.cross(*tangents), axis=-1) * w
    values, normals = np.empty(area.shape), np.empty(points.shape)
    weights = area / area.sum() * _shown(points, area, faces, patient)
    for name, rows in faces.rows.items():
        value, slope = patient.images[name].sample(points[rows].reshape(-1, 3))
        values[rows] = value.reshape(area[rows].shape)
        normals[rows] = slope.reshape(points[rows].shape)
        if name in CUTS:
            weights[rows] *= cut_weight
    return Distances(
        np.repeat(np.arange(len(control)), len(uv)),
        np.tile(basis, (len(control), 1)),
        normals.reshape(-1, 3),
        values.ravel(),
        weights.ravel(),
    )


def _shown(
    points: NDArray[np.float64],
    area: NDArray[np.float64],
    faces: FaceFreedom,
    patient: Patient,
) -> NDArray[np.float64]:
    """How far the patient's images are data at samples (f, s, 3); its mean by area is 1."""
    shown = patient.confidence(points.reshape(-1, 3)).reshape(area.shape)
    cut = np.zeros(len(shown), dtype=bool)
    for name in CUTS:
        cut[faces.rows.get(name, slice(0))] = True
    shown[cut] = 1.0  # a cut is where it is, wherever the slices are
    shown[~cut] *= area[~cut].sum() / (area[~cut] * shown[~cut]).sum()
    return shown


def from_patient(
    mesh: HexMesh, faces: FaceFreedom, surfaces: Mapping[str, Isosurface], voxel: float
) -> Distances:
    """Distances from points of the patient to the tangent planes at their closest points."""
    parts = []
    total = sum(p.weights.sum() for p in surfaces.values())
    for name, target in surfaces.items():
        rows = faces.rows[name]
        near = closest_points(mesh, faces.faces[rows], target.points, CANDIDATES)
        face = near.face + rows.start
        control = faces.control(mesh)[face]
        tangents = [
            np.einsum("pa,pax->px", tabulate_face(near.uv, d), control) for d in ((1, 0), (0, 1))
        ]
        normal = unit(np.cross(*tangents)) * faces.signs[face, None]
        # The patient's normals leave the pool or the heart; the mesh's leave the wall.
        outwards = 1.0 if name == "epi" else -1.0
        facing = outwards * np.einsum("px,px->p", normal, target.normals) > FACING
        reliable = facing / (1 + (near.distance / (OUTLIER * voxel)) ** 2)
        parts.append(
            Distances(
                face,
                tabulate_face(near.uv),
                normal,
                np.einsum("px,px->p", near.points - target.points, normal),
                reliable * target.weights / total,
            )
        )
    return Distances(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("face", "functions", "normal", "value", "weight")
        )
    )


def misfit(mesh: HexMesh, patient: Patient) -> float:
    """Mean distance of points of the patient to the mesh's surfaces, mm.

    Parameters
    ----------
    mesh : HexMesh
    patient : Patient

    Returns
    -------
    float
    """
    faces = [mesh.topology.surfaces[name] for name in patient.few]
    near = [
        closest_points(mesh, rows, target.points, CANDIDATES).distance
        for rows, target in zip(faces, patient.few.values(), strict=True)
    ]
    weights = np.concatenate([target.weights for target in patient.few.values()])
    return float(np.average(np.concatenate(near), weights=weights))


def unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Vectors (..., 3) of length 1; zero stays zero."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, np.finfo(float).tiny))


def distance_blocks(faces: FaceFreedom, parts: list[Distances], factor: float) -> Blocks:
    """Gauss-Newton blocks of ``factor`` times the weighted squares of the distances."""
    n, size = len(faces.faces), 3 * FACE_COEFFICIENTS
    matrix, gradient = np.zeros((n, size, size)), np.zeros((n, size))
    for d in parts:
        _accumulate(d.face, d.functions, d.normal, d.value, factor * d.weight, matrix, gradient)
    of_dofs = faces.extraction
    return Blocks(
        faces.dofs,
        np.matmul(np.matmul(of_dofs.transpose(0, 2, 1), matrix), of_dofs),
        np.matmul(of_dofs.transpose(0, 2, 1), gradient[..., None])[..., 0],
    )


def changes(faces: FaceFreedom, d: Distances, step: NDArray[np.float64]) -> NDArray[np.float64]:
    """Change (p,) of the distances under a step (n, 3) of the free degrees of freedom."""
    moves = np.concatenate([step, np.zeros((1, 3))])[faces.dofs].reshape(len(faces.dofs), -1, 1)
    control = np.matmul(faces.extraction, moves).reshape(len(moves), FACE_COEFFICIENTS, 3)
    moved = np.matmul(d.functions[:, None, :], control[d.face])[:, 0]
    return np.asarray(np.sum(moved * d.normal, axis=1))


@nb.njit(cache=True)
def _accumulate(face, functions, normal, value, weight, matrix, gradient):  # type: ignore[no-untyped-def]
    """Add ``w r r'`` and ``w r value`` with rows ``r = functions x normal``."""
    m = functions.shape[1]
    row = np.empty(3 * m)
    for p in range(len(face)):
        if weight[p] == 0.0:
            continue
        for a in range(m):
            for x in range(3):
                row[3 * a + x] = functions[p, a] * normal[p, x]
        block, right = matrix[face[p]], gradient[face[p]]
        for i in range(3 * m):
            scaled = weight[p] * row[i]
            if scaled == 0.0:
                continue
            right[i] += scaled * value[p]
            for j in range(3 * m):
                block[i, j] += scaled * row[j]
