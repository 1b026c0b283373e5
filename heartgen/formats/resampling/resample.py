"""A mesh as linear or quadratic cells: hexahedra, wedges where elements collapse, tetrahedra."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import InputError, MeshError
from heartgen.formats.resampling.kinds import CHOICES, HEX8, TET4, TET10, WEDGE6, WEDGES, CellKind
from heartgen.formats.resampling.straightening import straightened
from heartgen.formats.resampling.tetrahedra import Block, split
from heartgen.mesh.hexmesh import HexMesh

POLE = 2
"""Face xi2 = 0, the one that may collapse; it does so along xi1."""

USUAL_PIECES = {
    "hex8": (2, 4, 4),
    "hex20": (1, 2, 2),
    "hex27": (1, 2, 2),
    "tet4": (2, 4, 4),
    "tet10": (1, 4, 4),
}
"""Pieces of an element (radial, circumferential, longitudinal): as many as bring linear cells to
within 0.2 mm of a usual human heart on average, and quadratic ones to within 0.05 mm."""

FACES = 6
"""Faces of an element."""


@dataclass(frozen=True)
class Resampling:
    """How a mesh is to be resampled.

    Attributes
    ----------
    kind : {"hex8", "hex20", "hex27", "tet4", "tet10"}
        Of the cells. Elements that have collapsed along an edge give wedges instead of hexahedra,
        which share whole faces with the others.
    pieces : (int, int, int), optional
        Hexahedra per element (radial, circumferential, longitudinal), each of which makes six
        tetrahedra if those are wanted; `USUAL_PIECES` if omitted.

    Examples
    --------
    >>> from heartgen.formats import Resampling
    >>> Resampling("hex20", (1, 2, 2))
    Resampling(kind='hex20', pieces=(1, 2, 2))
    >>> Resampling("tet4").pieces  # the usual ones
    (2, 4, 4)
    """

    kind: str = "hex8"
    pieces: tuple[int, int, int] = (0, 0, 0)

    def __post_init__(self) -> None:
        if self.kind not in CHOICES:
            raise InputError(f"cells {self.kind!r} are not known: choose {', '.join(CHOICES)}")
        if self.pieces == (0, 0, 0):
            object.__setattr__(self, "pieces", USUAL_PIECES[self.kind])
        if len(self.pieces) != 3 or not all(n == int(n) and n >= 1 for n in self.pieces):
            raise InputError(
                f"pieces {self.pieces} are not three whole numbers from 1: give radial, "
                "circumferential and longitudinal"
            )


@dataclass(frozen=True, eq=False)
class Cells:
    """Cells of one kind.

    Attributes
    ----------
    kind : CellKind
        Of all of them.
    nodes : (m, n) int
        Points of each cell.
    element : (m,) int
        Element of the mesh that it is a piece of.
    xi : (m, n, 3) float64
        Local coordinates of its nodes in that element.
    """

    kind: CellKind
    nodes: NDArray[np.intp]
    element: NDArray[np.intp]
    xi: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Resampled:
    """A mesh of linear or quadratic cells.

    Points that elements share are one point, the pole's as well.

    Attributes
    ----------
    points : (p, 3) float64
        mm, world (LPS).
    cells : tuple of Cells
        A block for each kind; cells are numbered through all blocks.
    surfaces : mapping of str to (f, 2) int
        Named surfaces as (cell, face).
    parts : mapping of str to (m,) int
        Named regions: their cells.
    """

    points: NDArray[np.float64]
    cells: tuple[Cells, ...]
    surfaces: Mapping[str, NDArray[np.intp]]
    parts: Mapping[str, NDArray[np.intp]]

    @property
    def n_cells(self) -> int:
        """Number of cells."""
        return sum(len(block.nodes) for block in self.cells)

    def part_numbers(self) -> NDArray[np.intp]:
        """Number of the region of each cell, counted from 1 in the order of `parts`, (m,)."""
        out = np.ones(self.n_cells, dtype=np.intp)
        for number, members in enumerate(self.parts.values(), start=1):
            out[members] = number
        return out

    def facets(self, name: str) -> list[NDArray[np.intp]]:
        """Points of the faces of a surface, (f, n), in groups of equally many nodes.

        Vertices come first, counter-clockwise seen from outside, then edges, then the center.

        Parameters
        ----------
        name : str
            Of the surface.
        """
        groups: dict[int, list[NDArray[np.intp]]] = {}
        start = 0
        for block in self.cells:
            within = self.surfaces[name] - [start, 0]
            within = within[(within[:, 0] >= 0) & (within[:, 0] < len(block.nodes))]
            for number, face in enumerate(block.kind.faces):
                cells = within[within[:, 1] == number, 0]
                if len(cells):
                    groups.setdefault(len(face), []).append(block.nodes[cells][:, list(face)])
            start += len(block.nodes)
        return [np.concatenate(group) for _, group in sorted(groups.items())]


def resample(mesh: HexMesh, wanted: Resampling) -> Resampled:
    """Resample a mesh to linear or quadratic cells.

    All nodes lie on the mesh, but for some of quadratic cells that would fold: those between
    vertices then move towards the straight cell as far as needed.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    wanted : Resampling
        Which cells, and how many.

    Returns
    -------
    Resampled

    Raises
    ------
    MeshError
        If elements would not meet in whole faces, or collapse in a way that is not known.
    """
    kind, (radial, around, along) = CHOICES[wanted.kind], wanted.pieces
    count = np.array([around, along, radial])
    topology = mesh.topology
    grid = _CellGrid(mesh, count * kind.order)
    if kind in (TET4, TET10):
        whole = [grid.cells(HEX8, count), grid.cells(WEDGE6, count)]
        numbered = [(block, grid.numbers(block)) for block in whole if len(block[1])]
        blocks = [split(numbered, kind, grid.collapsed, grid.locate)]
    else:
        blocks = [grid.cells(kind, count), grid.cells(WEDGES[kind.name], count)]
    blocks = [block for block in blocks if len(block[1])]
    numbers = [grid.numbers(block) for block in blocks]
    used, compact = np.unique(np.concatenate([n.ravel() for n in numbers]), return_inverse=True)
    sizes = np.cumsum([n.size for n in numbers])[:-1]
    cells = tuple(
        Cells(of, nodes.reshape(place.shape[:2]), element, place / grid.size)
        for (of, element, place), nodes in zip(blocks, np.split(compact, sizes), strict=True)
    )
    out = Resampled(
        points=grid.points[used],
        cells=cells,
        surfaces=_named_faces(cells, topology.surfaces, topology.n_elements),
        parts=_named_cells(cells, topology.parts),
    )
    _check_faces(out, wanted)
    return _unfolded(out) if kind.order == 2 else out


def _unfolded(mesh: Resampled) -> Resampled:
    """The same mesh with cells that fold made straighter."""
    on_surface = np.zeros(len(mesh.points), dtype=bool)
    for name in mesh.surfaces:
        for nodes in mesh.facets(name):
            on_surface[nodes] = True
    blocks = [(block.kind, block.nodes) for block in mesh.cells]
    return replace(mesh, points=straightened(mesh.points, blocks, on_surface))


class _CellGrid:
    """An even grid of points in every element, numbered so that shared points are one."""

    def __init__(self, mesh: HexMesh, size: NDArray[np.intp]) -> None:
        self.size, topology = size, mesh.topology
        steps = [np.linspace(0, 1, n + 1) for n in size]
        k, j, i = np.meshgrid(*steps[::-1], indexing="ij")
        xi = np.stack([i.ravel(), j.ravel(), k.ravel()], -1)
        self.number, first = topology.numbered(xi)
        self.points = mesh.evaluate(xi).reshape(-1, 3)[first]
        self.collapsed = np.zeros(topology.n_elements, dtype=bool)
        self.collapsed[topology.collapsed[:, 0]] = True
        rows = self.number.reshape(-1, *(size[::-1] + 1))[self.collapsed, :, 0]
        if np.any(topology.collapsed[:, 1] != POLE) or np.any(rows != rows[..., :1]):
            raise MeshError(
                "elements collapse in another way than along xi1 where xi2 = 0: such a mesh can "
                "be written in an exact format only"
            )

    def numbers(self, block: Block) -> NDArray[np.intp]:
        """Numbers (m, n) of the points of cells."""
        _, element, place = block
        return self._number_at(element, place)

    def locate(self, element: NDArray[np.intp], place: NDArray[np.intp]) -> NDArray[np.float64]:
        """Positions (m, n, 3), mm, of places (m, n, 3) on the grids of elements (m,)."""
        return np.asarray(self.points[self._number_at(element, place)])

    def _number_at(self, element: NDArray[np.intp], place: NDArray[np.intp]) -> NDArray[np.intp]:
        along = np.cumprod([1, *self.size[:2] + 1])
        return np.asarray(self.number[element[:, None], place @ along])

    def cells(self, kind: CellKind, count: NDArray[np.intp]) -> Block:
        """All hexahedra that have not collapsed, or the wedges of those that have."""
        wedge = kind in (WEDGE6, *WEDGES.values())
        k, j, i = np.meshgrid(*[np.arange(n) for n in count[::-1]], indexing="ij")
        corner = np.stack([i.ravel(), j.ravel(), k.ravel()], -1) * (self.size // count)
        at_pole = self.collapsed[:, None] & (corner[:, 1] == 0)
        element, cell = np.nonzero(at_pole if wedge else ~at_pole)
        within = (_wedge_in_hex(kind.nodes) if wedge else kind.nodes) * (self.size // count) // 2
        return kind, element, corner[cell][:, None, :] + within


def _wedge_in_hex(nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where a wedge has its nodes (n, 3) in the hexahedron that has collapsed, in halves."""
    x, y, z = nodes.T
    return np.stack([np.where(x + y > 0, 2 * x // np.maximum(x + y, 1), 0), x + y, z], -1)


def _cell_faces(cells: tuple[Cells, ...]) -> list[tuple[int, Cells, int, list[int]]]:
    """First cell, block, number and vertices of each face of each block."""
    out, start = [], 0
    for block in cells:
        for number, face in enumerate(block.kind.faces):
            vertices = [n for n in face if n < block.kind.vertices]
            out.append((start, block, number, vertices))
        start += len(block.nodes)
    return out


def _named_faces(
    cells: tuple[Cells, ...], surfaces: Mapping[str, NDArray[np.intp]], n_elements: int
) -> dict[str, NDArray[np.intp]]:
    """Faces (cell, face) of the cells on each named surface of the mesh."""
    out = {}
    for name, faces in surfaces.items():
        named = np.zeros((n_elements, FACES), dtype=bool)
        named[tuple(faces.T)] = True
        found = []
        for start, block, number, vertices in _cell_faces(cells):
            for face in np.unique(faces[:, 1]):
                axis, end = divmod(int(face), 2)
                on = (block.xi[:, vertices, axis] == end).all(1) & named[block.element, face]
                at = start + np.flatnonzero(on)
                found.append(np.stack([at, np.full(len(at), number)], -1))
        out[name] = np.concatenate(found)
    return out


def _named_cells(
    cells: tuple[Cells, ...], parts: Mapping[str, NDArray[np.intp]]
) -> dict[str, NDArray[np.intp]]:
    """Cells of each named region of the mesh."""
    element = np.concatenate([block.element for block in cells])
    return {name: np.flatnonzero(np.isin(element, members)) for name, members in parts.items()}


def _check_faces(mesh: Resampled, wanted: Resampling) -> None:
    """Refuse cells that leave gaps: every face has two cells, or one if it is on a surface."""
    corners = []
    for _, block, _, vertices in _cell_faces(mesh.cells):
        face = np.sort(block.nodes[:, vertices], axis=1)
        corners.append(np.pad(face, ((0, 0), (0, 4 - len(vertices))), constant_values=-1))
    _, cells = np.unique(np.concatenate(corners), axis=0, return_counts=True)
    outside = sum(len(faces) for faces in mesh.surfaces.values())
    if cells.max() > 2 or np.count_nonzero(cells == 1) != outside:
        raise MeshError(
            f"with {'x'.join(map(str, wanted.pieces))} pieces of an element cells do not meet in "
            "whole faces: choose as many pieces in every direction"
        )
