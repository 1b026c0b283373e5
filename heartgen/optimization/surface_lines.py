"""The lines of the mesh on its surfaces: as straight as an expert would draw them.

Let x be the surface, u its displacement from the unoptimized mesh, n the normal, t_1 and t_2 the
directions of the lines along xi1 (circumferential) and xi2 (longitudinal), b_i = n x t_i the
direction across a line, s_i the root mean square length of a face along xi_i, and v_t the part of v
in the tangent plane. Per face, as means over it:

    E_fair   = |b_2 . x_22|^2 / s_2^2 + |b_1 . u_11|^2 / s_1^2 + |(u_12)_t|^2 / (s_1 s_2)
    E_smooth = ( |n . u_11|^2 / s_1^2 + |n . u_22|^2 / s_2^2 + |n . u_12|^2 / (s_1 s_2) )
    E_place  = (|u_t| / m)^2 + (|u_t| / m)^6 / 3

``b . x_22 / |x_2|^2`` is the geodesic curvature of a longitudinal line, which is zero for the
meridians of an ellipsoid. Parallels have one of their own: a circumferential line keeps that of the
unoptimized mesh. A mesh could else trade the course of its lines for even Jacobians, and no figure
of error or quality would tell. Movement *along* a line is free: rows may be spaced as the elements
like. It is the total displacement that counts, for bends of single steps would add up. E_smooth
lets the surface between data follow the unoptimized one and not the elements; E_place keeps
material points where the anatomy has them: most may move a little, and few far, as at the corners
of the right ventricle.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.dof_map import FaceDofMap
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surface_faces import FACE_COEFFICIENTS, tabulate_face
from heartgen.optimization.assembly import face_blocks
from heartgen.optimization.settings import LINE_GAUSS
from heartgen.optimization.terms import Model

Array = NDArray[np.float64]

FIRST, SECOND, MIXED = ((1, 0), (0, 1)), ((2, 0), (0, 2)), (1, 1)


@dataclass(frozen=True, eq=False)
class SurfaceLines:
    """Course of the surfaces' lines.

    Attributes
    ----------
    faces : FaceDofMap
        Of the mesh.
    unoptimized : (f, 16, 3) float64
        Bernstein coefficients of the faces of the unoptimized mesh, mm, world (LPS).
    fair, smooth, place : (f,) float64
        Weights of each face.
    movement : float
        m, mm.
    """

    faces: FaceDofMap
    unoptimized: Array
    fair: Array
    smooth: Array
    place: Array
    movement: float

    def near(self, q: Array) -> Model:
        """Return the term near a mesh (see `Term`).

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom of the mesh, mm, world (LPS).
        """
        absolute, relative, tangential = self._forms(self.faces.at(q))
        x0 = self.unoptimized.reshape(len(self.unoptimized), -1, 1)

        def residual(q: Array) -> tuple[Array, Array]:
            x = self.faces.at(q).reshape(x0.shape)
            return x, x - x0

        def value(q: Array) -> float:
            bending = sum(
                float(np.sum(v * np.matmul(form, v)))
                for v, form in zip(residual(q), (absolute, relative), strict=True)
            )
            moved = tangential.moved(self.faces.at(q) - self.unoptimized)
            return bending + float(np.sum(tangential.weights * (moved + moved**3 / 3)))

        x, u = residual(q)
        relative_or_tangential = relative + tangential.form
        gradient = np.matmul(absolute, x) + np.matmul(relative_or_tangential, u)
        return Model(
            value, face_blocks(self.faces, absolute + relative_or_tangential, gradient[..., 0])
        )

    def _forms(self, control: Array) -> tuple[Array, Array, _TangentialPenalty]:
        """Quadratic forms (f, 48, 48) of the coefficients and of displacements, and E_place."""
        uv, w = gauss_square(LINE_GAUSS)
        along = [np.matmul(tabulate_face(uv, d), control) for d in FIRST]
        size = [np.einsum("fpx,fpx,p->f", t, t, w)[:, None, None, None] for t in along]
        normal = _unit(np.cross(*along))
        across = [_outer(_unit(np.cross(normal, t))) for t in along]
        onto = _outer(normal)
        tangent = np.eye(3) - onto
        fair, smooth = (v[:, None, None, None] * w[:, None, None] for v in (self.fair, self.smooth))
        absolute = _form(tabulate_face(uv, SECOND[1]), fair / size[1] * across[1])
        relative = (
            _form(tabulate_face(uv, SECOND[0]), (fair * across[0] + smooth * onto) / size[0])
            + _form(tabulate_face(uv, SECOND[1]), smooth / size[1] * onto)
            + _form(
                tabulate_face(uv, MIXED),
                (fair * tangent + smooth * onto) / np.sqrt(size[0] * size[1]),
            )
        )
        metric = tangent / self.movement**2
        tangential = _TangentialPenalty(
            tabulate_face(uv), metric, self.place[:, None] * w, control - self.unoptimized
        )
        return absolute, relative, tangential


@dataclass(frozen=True, eq=False)
class _TangentialPenalty:
    """E_place near a mesh, whose tangent planes are fixed.

    Attributes
    ----------
    functions : (p, 16) float64
        Of the faces' coefficients at the points.
    metric : (f, p, 3, 3) float64
        ``|u_t|^2 / m^2`` of displacements u, 1/mm^2.
    weights : (f, p) float64
    u : (f, 16, 3) float64
        Displacement of the mesh, mm.
    """

    functions: Array
    metric: Array
    weights: Array
    u: Array

    def moved(self, u: Array) -> Array:
        """``|u_t|^2 / m^2`` (f, p) of a displacement (f, 16, 3)."""
        at = np.matmul(self.functions, u)
        return np.asarray(np.einsum("fpx,fpxy,fpy->fp", at, self.metric, at))

    @cached_property
    def form(self) -> Array:
        """Quadratic form (f, 48, 48) with the slope of E_place at the mesh."""
        slope = self.weights * (1 + self.moved(self.u) ** 2)
        return _form(self.functions, slope[..., None, None] * self.metric)


def _form(functions: Array, weights: Array) -> Array:
    """Quadratic forms (f, 48, 48) of ``sum_p v' W_p v`` with ``v = functions_p . coefficients``."""
    f, m = len(weights), FACE_COEFFICIENTS
    pairs = (functions[:, :, None] * functions[:, None, :]).reshape(len(functions), -1)
    out = np.matmul(pairs.T, weights.reshape(f, len(functions), 9)).reshape(f, m, m, 3, 3)
    return np.asarray(out.transpose(0, 1, 3, 2, 4).reshape(f, 3 * m, 3 * m))


def _outer(v: Array) -> Array:
    """Projectors (..., 3, 3) onto directions (..., 3)."""
    return np.asarray(v[..., :, None] * v[..., None, :])


def _unit(v: Array) -> Array:
    """Vectors (..., 3) of length 1; zero stays zero."""
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.asarray(v / np.maximum(length, np.finfo(float).tiny))
