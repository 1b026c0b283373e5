"""Kinds of cells that finite element codes know: their nodes, faces and shape functions."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class CellKind:
    """A kind of cell.

    Attributes
    ----------
    name : str
        Such as ``hex8``.
    order : int
        Of the shape functions along an edge: 1 or 2.
    nodes : (n, 3) int
        Places of the nodes in the reference cell, in halves of its edge: vertices first, then
        edges, faces, inside, in the order of VTK, which meshio and Abaqus share. The reference
        cell is the unit cube, or the part of it where xi1 + xi2 is at most 1 (wedges), or
        xi1 + xi2 + xi3 is (tetrahedra).
    vertices : int
        How many of the nodes are vertices.
    faces : tuple of tuple of int
        Nodes of each face: vertices counter-clockwise seen from outside, then the edges between
        them, then the center.
    exponents : (n, 3) int
        Monomials that span the shape functions.
    """

    name: str
    order: int
    nodes: NDArray[np.intp] = field(repr=False)
    vertices: int
    faces: tuple[tuple[int, ...], ...] = field(repr=False)
    exponents: NDArray[np.intp] = field(repr=False)

    @cached_property
    def reference(self) -> NDArray[np.float64]:
        """Places of the nodes in the reference cell, (n, 3)."""
        return self.nodes / 2

    @cached_property
    def _coefficients(self) -> NDArray[np.float64]:
        """(n monomials, n nodes): shape functions in terms of the monomials."""
        return np.asarray(np.linalg.inv(_monomials(self.reference, self.exponents)))

    @cached_property
    def neighbors(self) -> NDArray[np.intp]:
        """Vertices to which the three edges from each vertex lead, right-handed, (v, 3)."""
        rings = [[n for n in face if n < self.vertices] for face in self.faces]
        out = []
        for vertex in range(self.vertices):
            ends = sorted({ring[ring.index(vertex) - 1] for ring in rings if vertex in ring})
            steps = self.nodes[ends] - self.nodes[vertex]
            out.append(ends if np.linalg.det(steps) > 0 else ends[::-1])
        return np.array(out)

    def shape(self, xi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Shape functions at reference places (q, 3): (q, n).

        Parameters
        ----------
        xi : (q, 3) float64
            Places in the reference cell.
        """
        return np.asarray(_monomials(xi, self.exponents) @ self._coefficients)

    def gradient(self, xi: NDArray[np.float64]) -> NDArray[np.float64]:
        """Derivatives of the shape functions at reference places (q, 3): (q, n, 3).

        Parameters
        ----------
        xi : (q, 3) float64
            Places in the reference cell.
        """
        out = np.empty((len(xi), len(self.nodes), 3))
        for d in range(3):
            lower = self.exponents.copy()
            lower[:, d] = np.maximum(lower[:, d] - 1, 0)
            out[..., d] = _monomials(xi, lower) * self.exponents[:, d] @ self._coefficients
        return out


def _monomials(xi: NDArray[np.float64], exponents: NDArray[np.intp]) -> NDArray[np.float64]:
    """(q, n): each monomial at each place."""
    return np.asarray(np.prod(xi[:, None, :] ** exponents, axis=-1))


def _places(digits: str) -> NDArray[np.intp]:
    return np.array([[int(digit) for digit in place] for place in digits.split()], dtype=np.intp)


_HEX = """
000 200 220 020 002 202 222 022 100 210 120 010 102 212 122 012 001 201 221 021
011 211 101 121 110 112 111
"""
_WEDGE = "000 200 020 002 202 022 100 110 010 102 112 012 001 201 021 101 111 011"
_TET = "000 200 020 002 100 110 010 001 101 011"

_HEX_FACES = ((0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7))
_WEDGE_FACES = ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5))
_TET_FACES = ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3))


def _with_middles(
    faces: tuple[tuple[int, ...], ...], nodes: NDArray[np.intp]
) -> tuple[tuple[int, ...], ...]:
    """Faces given by their vertices, with the nodes on their edges and at their center."""
    number = {tuple(place): n for n, place in enumerate(nodes.tolist())}

    def between(*vertices: int) -> int | None:
        return number.get(tuple((nodes[list(vertices)].sum(0) // len(vertices)).tolist()))

    out = []
    for face in faces:
        edges = [between(a, b) for a, b in zip(face, face[1:] + face[:1], strict=True)]
        center = between(*face) if len(face) == 4 else None
        out.append((*face, *(n for n in [*edges, center] if n is not None)))
    return tuple(out)


def _kind(
    name: str,
    order: int,
    digits: str,
    count: int,
    vertices: int,
    faces: tuple[tuple[int, ...], ...],
) -> CellKind:
    nodes = _places(digits)[:count]
    powers = _places(" ".join(f"{a}{b}{c}" for c in range(3) for b in range(3) for a in range(3)))
    in_plane = powers[:, 0] + powers[:, 1]
    squared = np.where(powers > 1, powers, 0).sum(1)  # "superlinear degree" of serendipity spaces
    spans = {
        "hex8": (powers <= 1).all(1),
        "hex20": squared <= 2,
        "hex27": squared >= 0,
        "wedge6": (in_plane <= 1) & (powers[:, 2] <= 1),
        "wedge15": (in_plane <= 2) & ((powers[:, 2] <= 1) | (in_plane <= 1)),
        "wedge18": in_plane <= 2,
        "tet4": powers.sum(1) <= 1,
        "tet10": powers.sum(1) <= 2,
    }
    return CellKind(name, order, nodes, vertices, _with_middles(faces, nodes), powers[spans[name]])


HEX8 = _kind("hex8", 1, _HEX, 8, 8, _HEX_FACES)
HEX20 = _kind("hex20", 2, _HEX, 20, 8, _HEX_FACES)
HEX27 = _kind("hex27", 2, _HEX, 27, 8, _HEX_FACES)
WEDGE6 = _kind("wedge6", 1, _WEDGE, 6, 6, _WEDGE_FACES)
WEDGE15 = _kind("wedge15", 2, _WEDGE, 15, 6, _WEDGE_FACES)
WEDGE18 = _kind("wedge18", 2, _WEDGE, 18, 6, _WEDGE_FACES)
TET4 = _kind("tet4", 1, _TET, 4, 4, _TET_FACES)
TET10 = _kind("tet10", 2, _TET, 10, 4, _TET_FACES)

CHOICES = {kind.name: kind for kind in (HEX8, HEX20, HEX27, TET4, TET10)}
"""Kinds a mesh can be resampled to, by name."""

WEDGES = {"hex8": WEDGE6, "hex20": WEDGE15, "hex27": WEDGE18}
"""What becomes of a hexahedron that has collapsed along an edge, conforming with the others."""
