"""Distances between the surfaces of mesh and patient, in both directions and label by label.

    E_out = sum over samples of the mesh's faces  w d(x)^2
    E_in  = sum over points p of the patient      w (n . (x(p) - p))^2

d is the signed distance of the patient's surface, x(p) the closest point of the mesh, n the mesh's
normal there. The weights w have sum 1 over all samples, but for what is said to weigh more.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.closest import closest_on_patches, closest_points
from heartgen.mesh.dof_map import FaceDofMap
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surface_faces import FACE_COEFFICIENTS, tabulate_face
from heartgen.optimization.assembly import Blocks, face_blocks
from heartgen.optimization.settings import FACE_GAUSS, FACING, OUTLIER
from heartgen.optimization.target import TRUNCATION_SURFACES, FitTarget
from heartgen.optimization.terms import Model

Array = NDArray[np.float64]

CANDIDATES = 1
"""Places on the mesh from which the closest point is searched: the error is that of the nearest
sample's face at worst, and the next step matches anew."""


@dataclass(frozen=True, eq=False)
class MeshToPatient:
    """Signed distances of the patient's surfaces at samples of the mesh's faces.

    Attributes
    ----------
    faces : FaceDofMap
        Of the mesh.
    target : FitTarget
        The patient's surfaces.
    weight : (f,) float64
        Of the samples of each face, 1/mm^2.
    """

    faces: FaceDofMap
    target: FitTarget
    weight: Array

    def near(self, q: Array) -> Model:
        """Return the term near a mesh (see `Term`).

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom of the mesh, mm, world (LPS).
        """
        functions, normal, value, weight = self._samples(q)
        return Model(self._value, _blocks(self.faces, *_flat(functions, normal, value, weight)))

    def _value(self, q: Array) -> float:
        """The term, measured anew."""
        _, _, value, weight = self._samples(q)
        return float(np.sum(weight * value**2))

    def _samples(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Functions (s, 16), slopes (f, s, 3), distances (f, s), mm, and weights (f, s)."""
        uv, w = gauss_square(FACE_GAUSS)
        functions, control = tabulate_face(uv), self.faces.at(q)
        points = np.matmul(functions, control)
        tangents = [np.matmul(tabulate_face(uv, d), control) for d in ((1, 0), (0, 1))]
        area = np.linalg.norm(np.cross(*tangents), axis=-1) * w
        value, slope = np.empty(area.shape), np.empty(points.shape)
        for name, rows in self.faces.rows.items():
            at = self.target.images[name].sample(points[rows].reshape(-1, 3))
            value[rows], slope[rows] = (
                at[0].reshape(area[rows].shape),
                at[1].reshape(points[rows].shape),
            )
        weight = area / area.sum() * self._shown(points, area) * self.weight[:, None]
        return functions, slope, value, weight

    def _shown(self, points: Array, area: Array) -> Array:
        """How far the patient's images are data at samples (f, s, 3); its mean by area is 1."""
        shown = self.target.confidence(points.reshape(-1, 3)).reshape(area.shape)
        cut = np.zeros(len(shown), dtype=bool)
        for name in TRUNCATION_SURFACES:
            cut[self.faces.rows.get(name, slice(0))] = True
        shown[cut] = 1.0  # a cut is where it is, wherever the slices are
        shown[~cut] *= area[~cut].sum() / (area[~cut] * shown[~cut]).sum()
        return shown


@dataclass(frozen=True, eq=False)
class PatientToMesh:
    """Distances from points of the patient to the tangent planes at their closest points.

    Attributes
    ----------
    faces : FaceDofMap
        Of the mesh.
    target : FitTarget
        Points on the patient's surfaces.
    weight : (f,) float64
        Of the points that are closest to each face, 1/mm^2.
    """

    faces: FaceDofMap
    target: FitTarget
    weight: Array

    def near(self, q: Array) -> Model:
        """Return the term near a mesh (see `Term`).

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom of the mesh, mm, world (LPS).
        """
        control = self.faces.at(q)
        parts = [self._matched(control, name) for name in self.target.points]
        face, functions, normal, value, weight = (
            np.concatenate(p) for p in zip(*parts, strict=True)
        )
        total = sum(points.weights.sum() for points in self.target.points.values())
        weight = weight / total * self.weight[face]

        def later(q: Array) -> float:
            moved = np.matmul(functions[:, None, :], (self.faces.at(q) - control)[face])[:, 0]
            return float(weight @ (value + np.sum(moved * normal, axis=1)) ** 2)

        return Model(later, _blocks(self.faces, face, functions, normal, value, weight))

    def _matched(
        self, control: Array, name: str
    ) -> tuple[NDArray[np.intp], Array, Array, Array, Array]:
        """Faces (p,), functions (p, 16), normals (p, 3), distances (p,) and weights (p,)."""
        points, rows = self.target.points[name], self.faces.rows[name]
        near = closest_on_patches(control[rows], points.points, CANDIDATES)
        face = near.face + rows.start
        tangents = [
            np.einsum("pa,pax->px", tabulate_face(near.uv, d), control[face])
            for d in ((1, 0), (0, 1))
        ]
        normal = np.cross(*tangents) * self.faces.signs[face, None]
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.finfo(float).tiny)
        # The patient's normals leave the pool or the heart; the mesh's leave the wall.
        outwards = 1.0 if name == "epi" else -1.0
        facing = outwards * np.einsum("px,px->p", normal, points.normals) > FACING
        reliable = facing / (1 + (near.distance / (OUTLIER * self.target.voxel)) ** 2)
        value = np.einsum("px,px->p", near.points - points.points, normal)
        return face, tabulate_face(near.uv), normal, value, reliable * points.weights


def misfit(mesh: HexMesh, target: FitTarget) -> float:
    """Mean distance of points of the patient to the mesh's surfaces, mm.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    target : FitTarget
        Points on the patient's surfaces, mm, world (LPS).

    Returns
    -------
    float
    """
    faces = [mesh.topology.surfaces[name] for name in target.points]
    near = [
        closest_points(mesh, rows, target.points, CANDIDATES).distance
        for rows, target in zip(faces, target.points.values(), strict=True)
    ]
    weights = np.concatenate([target.weights for target in target.points.values()])
    return float(np.average(np.concatenate(near), weights=weights))


def _flat(
    functions: Array, normal: Array, value: Array, weight: Array
) -> tuple[NDArray[np.intp], Array, Array, Array, Array]:
    """The same samples of every face, as a list with the faces (p,)."""
    f, s = value.shape
    return (
        np.repeat(np.arange(f), s),
        np.tile(functions, (f, 1)),
        normal.reshape(-1, 3),
        value.ravel(),
        weight.ravel(),
    )


def _blocks(
    faces: FaceDofMap,
    face: NDArray[np.intp],
    functions: Array,
    normal: Array,
    value: Array,
    weight: Array,
) -> Blocks:
    """Gauss-Newton blocks of the weighted squares of distances."""
    n, size = len(faces.faces), 3 * FACE_COEFFICIENTS
    matrix, gradient = np.zeros((n, size, size)), np.zeros((n, size))
    _accumulate(face, functions, normal, value, weight, matrix, gradient)
    return face_blocks(faces, matrix, gradient)


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
