"""Where surfaces end: their rims, and the volumes that they enclose once lids close these."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from heartgen.errors import MeshError
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.quadrature import EXACT, gauss, gauss_square
from heartgen.mesh.surface_faces import evaluate_faces, face_control, face_signs, tabulate_face

Array = NDArray[np.float64]

SIDES = ((0, 0, 1), (1, 1, 1), (0, 1, -1), (1, 0, -1))
"""Sides of a face, counter-clockwise in (u, v): the parameter that runs, the value of the other
one, and the direction of the run."""

RIM_GAUSS = 6
"""Points along an edge: integrals of products of its coordinates and one derivative are exact."""


@dataclass(frozen=True, eq=False)
class Rim:
    """A closed line on which a surface ends.

    Attributes
    ----------
    faces : (n, 2) int
        (element, face) of each edge.
    sides : (n,) int
        Side of that face, see `SIDES`.
    points : (n, q, 3) float64
        Gauss points of each edge, mm, world (LPS).
    steps : (n, q, 3) float64
        Their tangents times weights, mm: around the rim, the surface to the left if seen from
        where its outward normal points.
    """

    faces: NDArray[np.intp]
    sides: NDArray[np.intp]
    points: Array
    steps: Array

    @property
    def area(self) -> Array:
        """Vector area (3,), mm^2: normal of the rim's plane times the area within."""
        return np.asarray(np.cross(self.points, self.steps).sum((0, 1)) / 2)

    @property
    def center(self) -> Array:
        """Centroid (3,) of the area within, mm, world (LPS)."""
        middle = np.average(
            self.points.reshape(-1, 3),
            axis=0,
            weights=np.linalg.norm(self.steps, axis=-1).ravel(),
        )
        spokes = self.points - middle
        share = np.cross(spokes, self.steps) @ self.area / 2
        return np.asarray(middle + 2 / 3 * np.einsum("nq,nqx->x", share, spokes) / share.sum())


def rims(mesh: HexMesh, faces: NDArray[np.intp]) -> list[Rim]:
    """Rims of a surface, longest first.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    faces : (f, 2) int
        The surface, as (element, face).

    Returns
    -------
    list of Rim
    """
    face, side, ends = _open_edges(mesh.topology, faces)
    _, node = np.unique(ends, return_inverse=True)
    node = node.reshape(-1, 2)
    links = (np.ones(len(node)), (node[:, 0], node[:, 1]))
    count = int(node.max(initial=-1)) + 1
    _, loop = connected_components(sp.coo_array(links, shape=(count, count)), directed=False)
    of_edge = loop[node[:, 0]]
    found = [_rim(mesh, faces[face[of_edge == n]], side[of_edge == n]) for n in np.unique(of_edge)]
    return sorted(found, key=lambda rim: -float(np.linalg.norm(rim.steps, axis=-1).sum()))


def basal_rim(mesh: HexMesh, surface: str) -> Rim:
    """Rim of a named surface at the base.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    surface : str
        Its name.
    """
    basal = {int(element) for element, _ in mesh.topology.surfaces["base"]}
    for rim in rims(mesh, mesh.topology.surfaces[surface]):
        if basal.issuperset(rim.faces[:, 0].tolist()):
            return rim
    raise MeshError(f"surface {surface!r} does not end at the base: it has no basal rim")


def enclosed_cavity(mesh: HexMesh, surface: str) -> float:
    """Volume inside an endocardium, closed by flat lids over its rims.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    surface : str
        Name of the endocardium.

    Returns
    -------
    float
        mm^3; exact, by the divergence theorem.
    """
    faces = mesh.topology.surfaces[surface]
    origin = basal_rim(mesh, surface).center  # the lid over the base, seen from here, is flat
    uv, weights = gauss_square(EXACT)
    points, area = evaluate_faces(mesh, faces, uv)
    volume = -np.einsum("fqx,fqx,q->", points - origin, area, weights) / 3
    for rim in rims(mesh, faces):
        spokes = np.cross(rim.points - origin, rim.steps)
        volume += float(np.einsum("x,nqx->", rim.center - origin, spokes)) / 6
    return float(volume)


def _open_edges(
    topology: Topology, faces: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Edges that belong to one face only: row of the face, side, and nodes (n, 2) at its ends."""
    corners = _face_nodes(topology, faces)  # (f, v, u)
    sides = (corners[:, 0, :], corners[:, :, 1], corners[:, 1, :], corners[:, :, 0])
    ends = np.stack(sides, axis=1).reshape(-1, 2)
    face, side = np.divmod(np.arange(len(ends)), len(SIDES))
    _, key, count = np.unique(
        np.sort(ends, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    alone = (count[key.ravel()] == 1) & (ends[:, 0] != ends[:, 1])
    return face[alone], side[alone], ends[alone]


def _face_nodes(topology: Topology, faces: NDArray[np.intp]) -> NDArray[np.intp]:
    """Corner nodes of faces, (f, 2, 2): second parameter, first parameter."""
    cube = topology.nodes.reshape(-1, 2, 2, 2)  # k, j, i
    each = np.stack([np.take(cube, f % 2, axis=3 - f // 2) for f in range(6)], axis=1)
    return np.asarray(each[faces[:, 0], faces[:, 1]])


def _rim(mesh: HexMesh, faces: NDArray[np.intp], sides: NDArray[np.intp]) -> Rim:
    """Sample the edges of a rim."""
    t, weights = gauss(RIM_GAUSS)
    control, sign = face_control(mesh, faces), face_signs()[faces[:, 1]]
    points = np.empty((len(faces), len(t), 3))
    steps = np.empty_like(points)
    for number, (runs, other, direction) in enumerate(SIDES):
        uv = np.full((len(t), 2), float(other))
        uv[:, runs] = t
        on = sides == number
        points[on] = np.matmul(tabulate_face(uv), control[on])
        slope = np.matmul(tabulate_face(uv, (1 - runs, runs)), control[on])
        steps[on] = direction * sign[on, None, None] * weights[:, None] * slope
    return Rim(faces, sides, points, steps)
