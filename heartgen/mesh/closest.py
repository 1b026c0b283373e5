"""Closest points on the curved faces of a mesh, exact to rounding, not on a triangulation."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surface_faces import face_control, tabulate_face

STARTS = 10
"""Start samples per face and direction; finer than any bump of a bicubic patch."""

CANDIDATES = 6
"""Nearest start samples from which Newton's method is tried unless told otherwise."""

NEWTON_STEPS = 30
TOLERANCE = 1e-10
"""Change of the parameters at which Newton's method stops."""


@dataclass(frozen=True, eq=False)
class ClosestPoints:
    """Closest points on a set of faces.

    Attributes
    ----------
    distance : (n,) float64
        Distance to the closest point, mm.
    points : (n, 3) float64
        The closest points, mm, world (LPS).
    face : (n,) int
        Row of the face in the list searched.
    uv : (n, 2) float64
        Parameters on that face.
    """

    distance: NDArray[np.float64]
    points: NDArray[np.float64]
    face: NDArray[np.intp]
    uv: NDArray[np.float64]


def closest_points(
    mesh: HexMesh,
    faces: NDArray[np.intp],
    queries: NDArray[np.float64],
    candidates: int = CANDIDATES,
) -> ClosestPoints:
    """Closest point of the faces to each query point.

    Starts Newton's method, kept inside each face, from the nearest samples of the faces.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        (element, face).
    queries : (n, 3) float64
        mm, world (LPS).
    candidates : int
        Nearest samples of the faces from which Newton's method is tried.

    Returns
    -------
    ClosestPoints
    """
    return closest_on_patches(face_control(mesh, faces), queries, candidates)


def closest_on_patches(
    control: NDArray[np.float64], queries: NDArray[np.float64], candidates: int = CANDIDATES
) -> ClosestPoints:
    """Closest point of bicubic patches to each query point, as `closest_points`.

    Parameters
    ----------
    control : (f, 16, 3) float64
        Bernstein coefficients of the patches, mm.
    queries : (n, 3) float64
        mm, in the same frame.
    candidates : int
        Nearest samples of the patches from which Newton's method is tried.

    Returns
    -------
    ClosestPoints
    """
    t = (np.arange(STARTS) + 0.5) / STARTS
    v, u = np.meshgrid(t, t, indexing="ij")
    starts = np.stack([u.ravel(), v.ravel()], -1)
    samples = np.matmul(tabulate_face(starts), control)
    _, nearest = cKDTree(samples.reshape(-1, 3)).query(
        queries, k=candidates, workers=nb.get_num_threads()
    )
    face, start = np.divmod(nearest.reshape(len(queries), -1), len(starts))
    out_face = np.empty(len(queries), dtype=np.int64)
    out_uv = np.empty((len(queries), 2))
    out_points = np.empty((len(queries), 3))
    _search(
        control, np.ascontiguousarray(queries), face, starts[start], out_face, out_uv, out_points
    )
    distance = np.linalg.norm(queries - out_points, axis=1)
    return ClosestPoints(distance, out_points, out_face, out_uv)


@nb.njit(cache=True)
def _cubic(t, values, slopes, curves):  # type: ignore[no-untyped-def]
    """Cubic Bernstein values, first and second derivatives at t."""
    s = 1.0 - t
    values[0], values[1], values[2], values[3] = s * s * s, 3 * s * s * t, 3 * s * t * t, t * t * t
    slopes[0], slopes[3] = -3 * s * s, 3 * t * t
    slopes[1], slopes[2] = 3 * s * s - 6 * s * t, 6 * s * t - 3 * t * t
    curves[0], curves[1], curves[2], curves[3] = 6 * s, 6 * t - 12 * s, 6 * s - 12 * t, 6 * t


@nb.njit(cache=True, parallel=True)
def _search(control, queries, face, start, out_face, out_uv, out_points):  # type: ignore[no-untyped-def]
    """Best of the candidates of every query."""
    for n in nb.prange(len(queries)):
        best = np.inf
        work = np.empty((6, 4))
        state = np.empty((6, 3))
        for c in range(face.shape[1]):
            repeated = False
            for earlier in range(c):
                if face[n, earlier] == face[n, c] and earlier > 0:
                    repeated = True
            if repeated:
                continue
            patch = control[face[n, c]]
            u, v = _newton(patch, queries[n], start[n, c, 0], start[n, c, 1], work, state)
            _evaluate(patch, u, v, work, state)
            d = 0.0
            for x in range(3):
                d += (state[0, x] - queries[n, x]) ** 2
            if d < best:
                best = d
                out_face[n] = face[n, c]
                out_uv[n, 0], out_uv[n, 1] = u, v
                for x in range(3):
                    out_points[n, x] = state[0, x]


@nb.njit(cache=True)
def _evaluate(patch, u, v, work, state):  # type: ignore[no-untyped-def]
    """Position, S_u, S_v, S_uu, S_uv, S_vv of a bicubic patch into the rows of `state`."""
    _cubic(u, work[0], work[1], work[2])
    _cubic(v, work[3], work[4], work[5])
    state[:] = 0.0
    for j in range(4):
        value, slope, curve = work[3, j], work[4, j], work[5, j]
        for x in range(3):
            along = along_slope = along_curve = 0.0
            for i in range(4):
                p = patch[4 * j + i, x]
                along += work[0, i] * p
                along_slope += work[1, i] * p
                along_curve += work[2, i] * p
            state[0, x] += value * along
            state[1, x] += value * along_slope
            state[2, x] += slope * along
            state[3, x] += value * along_curve
            state[4, x] += slope * along_slope
            state[5, x] += curve * along


@nb.njit(cache=True)
def _newton(patch, q, u, v, work, state):  # type: ignore[no-untyped-def]
    """Minimize the squared distance over the unit square by projected, damped Newton steps."""
    _evaluate(patch, u, v, work, state)
    value = 0.0
    for x in range(3):
        value += (state[0, x] - q[x]) ** 2
    for _ in range(NEWTON_STEPS):
        gu = gv = huu = huv = hvv = guu = guv = gvv = 0.0
        for x in range(3):
            r = state[0, x] - q[x]
            gu += r * state[1, x]
            gv += r * state[2, x]
            guu += state[1, x] * state[1, x]
            guv += state[1, x] * state[2, x]
            gvv += state[2, x] * state[2, x]
            huu += r * state[3, x]
            huv += r * state[4, x]
            hvv += r * state[5, x]
        huu, huv, hvv = huu + guu, huv + guv, hvv + gvv
        if huu <= 0.0 or huu * hvv - huv * huv <= 1e-9 * guu * gvv:
            huu, huv, hvv = guu, guv, gvv  # not convex here: Gauss-Newton is
        fixed_u = (u <= 0.0 and gu > 0.0) or (u >= 1.0 and gu < 0.0)
        fixed_v = (v <= 0.0 and gv > 0.0) or (v >= 1.0 and gv < 0.0)
        du = dv = 0.0
        det = huu * hvv - huv * huv
        if fixed_u and not fixed_v:
            dv = -gv / max(hvv, 1e-30)
        elif fixed_v and not fixed_u:
            du = -gu / max(huu, 1e-30)
        elif not fixed_u and not fixed_v:
            if det > 1e-12 * guu * gvv and det > 0.0:
                du = -(hvv * gu - huv * gv) / det
                dv = -(huu * gv - huv * gu) / det
            else:
                du = -gu / max(guu, 1e-30)
                dv = -gv / max(gvv, 1e-30)
        moved = 0.0
        step = 1.0
        for _ in range(20):
            nu = min(max(u + step * du, 0.0), 1.0)
            nv = min(max(v + step * dv, 0.0), 1.0)
            _evaluate(patch, nu, nv, work, state)
            new = 0.0
            for x in range(3):
                new += (state[0, x] - q[x]) ** 2
            if new <= value:
                moved = abs(nu - u) + abs(nv - v)
                u, v, value = nu, nv, new
                break
            step *= 0.5
        else:
            _evaluate(patch, u, v, work, state)
        if moved < TOLERANCE:
            break
    return u, v
