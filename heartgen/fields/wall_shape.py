"""Local shape of the wall: its thickness and its curvature."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.coordinate_lines import lines
from heartgen.fields.frames import around_shares, at_pole, averaged
from heartgen.fields.wall import INNER
from heartgen.mesh.bernstein import ORDER, lattice, tabulate
from heartgen.mesh.closest import closest_points
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surface_faces import face_coefficients

Array = NDArray[np.float64]

BESIDE_POLE = 1e-3
"""xi2 at which curvatures of the pole are taken, where the directions still exist."""


def wall_thickness(mesh: HexMesh) -> Array:
    """Thickness of the wall.

    It is the distance from the endocardium to the closest point of the wall's other surface, the
    same at all depths: for the left ventricle and the septum that is the epicardium or the right
    endocardium, for the right ventricle's free wall the epicardium.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    (e, 64) float64, mm
        At the Lagrange nodes of each element. It jumps where the walls of the two ventricles meet.
    """
    points = mesh.lagrange_points()
    runs = lines(mesh.topology, 2)
    first = np.array([run[0] for run in runs])
    places = points[first[:, None], face_coefficients()[INNER]]
    thickness = np.linalg.norm(opposite(mesh, first, places) - places, axis=-1)
    out = np.empty((mesh.n_elements, ORDER, ORDER**2))
    for run, values in zip(runs, thickness, strict=True):
        out[run] = values
    return out.reshape(mesh.n_elements, -1)


def opposite(mesh: HexMesh, elements: NDArray[np.intp], places: Array) -> Array:
    """Closest points (n, q, 3) of the wall's other surface to places on endocardial faces.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    elements : (n,) int
        Those of the faces.
    places : (n, q, 3) float64
        mm, world (LPS).
    """
    topology = mesh.topology
    free = np.isin(elements, topology.parts.get("right ventricle", []))
    epi = topology.surfaces["epi"]
    septum = topology.patches.get("rv_septum", np.zeros((0, 2), dtype=np.intp))
    out = np.empty_like(places)
    for which, faces in ((free, epi), (~free, np.concatenate([epi, septum]))):
        if which.any():
            found = closest_points(mesh, faces, places[which].reshape(-1, 3))
            out[which] = found.points.reshape(places[which].shape)
    return out


def curvatures(mesh: HexMesh) -> Array:
    """Normal curvatures of the sheets of equal transmural coordinate.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    (e, 64, 2) float64, 1/mm
        Circumferential and longitudinal; positive where the sheet bends around the cavity. The mean
        of the elements that meet at a point.
    """
    xi = lattice()
    out = _curvatures(mesh, xi)
    pole = at_pole(mesh)
    beside = xi.copy()
    beside[:, 1] = np.maximum(beside[:, 1], BESIDE_POLE)
    out[pole] = _curvatures(mesh, beside)[pole]
    return averaged(out, mesh)


def _curvatures(mesh: HexMesh, xi: Array) -> Array:
    """Curvatures (e, q, 2) at local coordinates (q, 3); meaningless where det J = 0."""
    one, two, one_one, one_two, two_two = (
        np.matmul(tabulate(xi, (a, b, 0)), mesh.control)
        for a, b in ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    )
    normal = np.cross(one, two)
    area = np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), np.finfo(float).tiny)
    normal /= area
    l, m, n = (np.einsum("eqx,eqx->eq", -normal, d) for d in (one_one, one_two, two_two))
    e, f, g = (np.einsum("eqx,eqx->eq", *pair) for pair in ((one, one), (one, two), (two, two)))
    a, b = np.moveaxis(around_shares(mesh.topology, xi), -1, 0)
    length = np.maximum(a * a * e + 2 * a * b * f + b * b * g, np.finfo(float).tiny)
    around = (a * a * l + 2 * a * b * m + b * b * n) / length
    determinant = np.maximum(e * g - f * f, np.finfo(float).tiny)
    trace = (e * n - 2 * f * m + g * l) / determinant  # of the shape operator
    return np.stack([around, trace - around], -1)
