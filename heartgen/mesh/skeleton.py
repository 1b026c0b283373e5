"""Faces and lines of a mesh, each one entity that the elements around it share."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import tabulate
from heartgen.mesh.connectivity import merge_coincident
from heartgen.mesh.topology import Topology

COLLAPSED = -1
"""In place of the number of a face without area, or of a line without length."""

TANGENTS = ((1, 2), (2, 0), (0, 1))
"""First and second tangent of the faces across xi1, xi2, xi3 in EX files (read off zinc)."""

LINES = np.array([[0, 2], [1, 3], [0, 1], [2, 3]])
"""Corners at the ends of the lines of a face: first tangent = 0, 1, second tangent = 0, 1."""


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Faces and lines, numbered from 0 in order of appearance.

    Attributes
    ----------
    faces : (e, 6) int
        Faces of each element: xi1=0, xi1=1, xi2=0, xi2=1, xi3=0, xi3=1; or `COLLAPSED`.
    lines : (f, 4) int
        Lines of each face: first tangent = 0, 1, second tangent = 0, 1; or `COLLAPSED`.
    corners : (f, 4) int
        Nodes of each face, first tangent fastest.
    """

    faces: NDArray[np.intp]
    lines: NDArray[np.intp]
    corners: NDArray[np.intp]

    @property
    def n_lines(self) -> int:
        """Number of lines."""
        return int(self.lines.max()) + 1


def skeleton(topology: Topology) -> Skeleton:
    """Faces and lines of a mesh.

    Parameters
    ----------
    topology : Topology
        Of the mesh.

    Returns
    -------
    Skeleton
    """
    unit = _unit_faces()
    corners = topology.nodes[:, face_corners()].reshape(-1, 4)
    distinct = 1 + np.count_nonzero(np.diff(np.sort(corners, axis=1), axis=1), axis=1)
    solid = distinct > 2
    centers = np.matmul(tabulate(unit.mean(1)), topology.generic).reshape(-1, 3)
    faces, first = _number(centers, solid)
    corners = corners[first]

    halfway = unit[:, LINES].mean(2).reshape(-1, 3)
    middles = np.matmul(tabulate(halfway), topology.generic).reshape(-1, 4, 3)[first]
    ends = corners[:, LINES]
    lines, _ = _number(middles.reshape(-1, 3), (ends[..., 0] != ends[..., 1]).ravel())
    return Skeleton(faces.reshape(-1, 6), lines.reshape(-1, 4), corners)


def face_corners() -> NDArray[np.intp]:
    """Which of an element's 8 corners a face has, (6, 4) int, first tangent fastest."""
    return np.asarray(_unit_faces() @ np.array([1, 2, 4]))


def _unit_faces() -> NDArray[np.intp]:
    """(6, 4, 3) local coordinates, 0 or 1, of the corners of each face, first tangent fastest."""
    out = np.empty((6, 4, 3), dtype=np.intp)
    for face in range(6):
        axis, end = divmod(face, 2)
        out[face, :, axis] = end
        out[face, :, TANGENTS[axis][0]] = [0, 1, 0, 1]
        out[face, :, TANGENTS[axis][1]] = [0, 0, 1, 1]
    return out


def _number(
    middles: NDArray[np.float64], exists: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Numbers of the entities with these middles, and the row where each appears first."""
    numbers = np.full(len(middles), COLLAPSED, dtype=np.intp)
    numbers[exists], first = merge_coincident(middles[exists])
    return numbers, np.flatnonzero(exists)[first]
