"""Polar coordinates in the square patch of elements at an apex, where none of xi runs around."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen.fields.coordinate_lines import lines
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.connectivity import SAME
from heartgen.mesh.hexmesh import Topology

Array = NDArray[np.float64]

ASIDE = 1e-3
"""Share of the way to the middle of its element by which the center of the patch is left, where
there is no direction around."""

PERIMETER = 8.0
"""Length of the border of the square from -1 to 1."""


@dataclass(frozen=True, eq=False)
class PatchCoordinates:
    """A square of elements; coordinates a, b run from -1 to 1 along its xi1 and xi2.

    Attributes
    ----------
    elements : (p,) int
        Of all layers.
    place : (p, 2) int
        Of each element along xi1 and xi2.
    side : int
        Elements along a side.
    start : float
        Column coordinate of the ring where it meets the patch at a = 1, b = 0.
    around : int
        Columns of the ring.
    """

    elements: NDArray[np.intp]
    place: NDArray[np.intp]
    side: int
    start: float
    around: int

    def square(self, xi: Array) -> Array:
        """Coordinates a, b, (p, q, 2), of local coordinates (q, 3); the center is left aside.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates in the unit cube.
        """
        inside = 2 * (self.place[:, None] + xi[:, :2]) / self.side - 1
        middle = (2 * self.place[:, None] + 1) / self.side - 1
        center = np.abs(inside).max(-1, keepdims=True) < np.finfo(float).eps
        aside = np.where(np.abs(middle) > 0, middle, 1 / self.side)
        return np.asarray(np.where(center, inside + ASIDE * (aside - inside), inside))

    def radius(self, xi: Array) -> Array:
        """Distance from the center, (p, q): 0 there to 1 on the border, on smooth rings.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates in the unit cube.
        """
        a, b = np.moveaxis(self.square(xi), -1, 0)
        return np.asarray(np.sqrt(np.maximum(a * a + b * b - a * a * b * b, 0)))

    def column(self, xi: Array) -> Array:
        """Column coordinate (p, q) of the ring where the ray from the center meets the border.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates in the unit cube.
        """
        return np.mod(
            self.start - perimeter(self.square(xi)) * self.around / PERIMETER, self.around
        )

    def directions(self, xi: Array) -> Array:
        """Direction around along smooth rings, (p, q, 2): shares of the tangents of xi1 and xi2.

        Parameters
        ----------
        xi : (q, 3) float64
            Local coordinates in the unit cube.
        """
        a, b = np.moveaxis(self.square(xi), -1, 0)
        corner = (np.abs(a) == 1) & (np.abs(b) == 1)
        along_1, along_2 = b * np.where(corner, 1, 1 - a * a), a * np.where(corner, 1, 1 - b * b)
        return np.stack([along_1, -along_2], -1)


def patch_of(topology: Topology) -> PatchCoordinates | None:
    """Find the square patch of a mesh: its rows along xi1 do not close on themselves.

    Parameters
    ----------
    topology : Topology
        Of the mesh.

    Returns
    -------
    PatchCoordinates or None
    """
    rows = lines(topology, 0)
    if not rows:
        return None
    elements = np.concatenate(rows)
    inside = np.zeros(topology.n_elements, dtype=bool)
    inside[elements] = True
    place = np.zeros((topology.n_elements, 2), dtype=np.intp)
    for axis in (0, 1):
        for line in lines(topology, axis, inside):
            place[line, axis] = np.arange(len(line))
    patch = PatchCoordinates(elements, place[elements], len(rows[0]), 0.0, topology.shape[1])
    return PatchCoordinates(**{**vars(patch), "start": _start(topology, patch)})


def perimeter(square: Array) -> Array:
    """Way along the border of the square to where a ray through (..., 2) meets it, from (1, 0).

    Parameters
    ----------
    square : (..., 2) float64
        Coordinates a, b in the square from -1 to 1.
    """
    a, b = np.moveaxis(square / np.abs(square).max(-1, keepdims=True), -1, 0)
    right, top, left = a >= np.abs(b), b >= np.abs(a), -a >= np.abs(b)
    return np.asarray(np.where(right, b, np.where(top, 2 - a, np.where(left, 4 - b, 6 + a))))


def _start(topology: Topology, patch: PatchCoordinates) -> float:
    """Column coordinate of the ring at a = 1, b = 0."""
    xi = lattice()
    places = np.matmul(tabulate(xi), topology.generic)
    ring = np.setdiff1d(np.arange(topology.n_elements), patch.elements)
    ring = ring[topology.index[ring, 2] == topology.index[ring, 2].min()]
    edge = xi[:, 1] == 0
    column = (topology.index[ring, 1, None] + xi[edge, 0]).ravel()
    tree = cKDTree(places[ring][:, edge].reshape(-1, 3))
    gap, nearest = tree.query(places[patch.elements].reshape(-1, 3))
    way = perimeter(patch.square(xi)).ravel() * patch.around / PERIMETER
    met = int(np.argmax(gap < SAME))
    return float(np.mod(column[np.asarray(nearest)[met]] + way[met], patch.around))
