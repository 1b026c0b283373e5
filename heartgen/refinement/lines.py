"""The lines of the mesh: fair as those of the unrefined mesh are, and where those are.

With u the displacement of the surfaces from the unrefined mesh, n their normal, and the tangential
part ``t(v) = v - n (n . v)``:

    E_fair = sum_f w_f  mean_f( |t(u_11)|^2 / s_1^2 + |t(u_22)|^2 / s_2^2 + |t(u_12)|^2 / (s_1 s_2) )
    E_move = sum_f w_f  mean_f( |t(u)|^2 )

s_1 and s_2 are the root mean square lengths of a face along xi1 and xi2. A mesh can trade the
course of its lines for even Jacobians, and no figure of error or quality would tell; E_fair lets
lines move, but not bend. It is the *total* displacement that counts: bends of single steps add up.
Movement along the normal is left to the data, but for a little bending of its own, by which the
surface between data follows the unrefined one and not the elements.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.freedom import FaceFreedom
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surfaces import FACE_COEFFICIENTS, tabulate_face
from heartgen.refinement.assembly import face_blocks
from heartgen.refinement.terms import Model

Array = NDArray[np.float64]

GAUSS = 4
"""Points per face and direction: as many as the second derivatives of a cubic have on two faces."""

SECOND = ((2, 0), (0, 2), (1, 1))


@dataclass(frozen=True)
class FairLines:
    """Bending and movement of the surfaces' lines.

    Attributes
    ----------
    faces : FaceFreedom
    unrefined : (f, 16, 3) float64
        Bernstein coefficients of the faces that the displacement is counted from, mm.
    tangential, normal, movement : (f,) float64
        Weights of each face: of bending in the tangent plane and along the normal, and of movement
        in the tangent plane, 1/mm^2.
    """

    faces: FaceFreedom
    unrefined: Array
    tangential: Array
    normal: Array
    movement: Array
    along: float = 0.0
    cross: float = 1.0
    keep: tuple = (1.0, 1.0, 1.0)

    def near(self, q: Array) -> Model:
        """Return the term near a mesh (see `Term`)."""
        forms = self._form(self.faces.at(q))
        c0 = self.unrefined.reshape(len(self.unrefined), -1, 1)
        form = sum(f for f, _ in forms)
        pull = np.matmul(sum(k * f for f, k in forms), c0)
        const = sum(k * k * float(np.sum(c0 * np.matmul(f, c0))) for f, k in forms)
        c = self.faces.at(q).reshape(c0.shape)
        gradient = (np.matmul(form, c) - pull)[..., 0]

        def value(q: Array) -> float:
            c = self.faces.at(q).reshape(c0.shape)
            return float(np.sum(c * (np.matmul(form, c) - 2 * pull))) + const

        return Model(value, face_blocks(self.faces, form, gradient))

    def _form(self, control: Array) -> Array:
        """The term as a quadratic form (f, 48, 48) of the displacement's coefficients."""
        uv, w = gauss_square(GAUSS)
        along = [np.matmul(tabulate_face(uv, d), control) for d in ((1, 0), (0, 1))]
        normal = np.cross(*along)
        normal /= np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.finfo(float).tiny)
        nn = normal[..., :, None] * normal[..., None, :]
        size = [np.einsum("fpx,fpx,p->f", a, a, w) for a in along]
        scales = (size[0], size[1], np.sqrt(size[0] * size[1]))
        tt = np.eye(3) - nn
        lateral = [np.cross(normal, a) for a in along]
        lateral = [b / np.maximum(np.linalg.norm(b, axis=-1, keepdims=True), np.finfo(float).tiny) for b in lateral]
        bb = [(1 - self.along) * b[..., :, None] * b[..., None, :] + self.along * tt for b in lateral]
        of = (*bb, self.cross * tt)
        form = [(_forms(tabulate_face(uv), w[:, None, None] * self.movement[:, None, None, None] * tt), 1.0)]
        for derivative, scale, projector, keep in zip(SECOND, scales, of, self.keep, strict=True):
            for bending, k in ((self.tangential[:, None, None, None] * projector, keep), (self.normal[:, None, None, None] * nn, 1.0)):
                per_point = bending * w[:, None, None] / scale[:, None, None, None]
                form.append((_forms(tabulate_face(uv, derivative), per_point), k))
        return form


def _forms(functions: Array, weights: Array) -> Array:
    """Quadratic forms (f, 48, 48) of ``sum_p v' W_p v`` with ``v = functions_p . coefficients``."""
    f, m = len(weights), FACE_COEFFICIENTS
    pairs = (functions[:, :, None] * functions[:, None, :]).reshape(len(functions), -1)
    out = np.matmul(pairs.T, weights.reshape(f, len(functions), 9)).reshape(f, m, m, 3, 3)
    return np.asarray(out.transpose(0, 1, 3, 2, 4).reshape(f, 3 * m, 3 * m))
