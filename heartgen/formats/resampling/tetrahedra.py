"""Hexahedra and wedges cut into tetrahedra that meet in whole faces.

Every quadrilateral is cut along the diagonal through its vertex of lowest rank, which both cells
at it agree upon, and every cell is the union of the pyramids from its own vertex of lowest rank to
the triangles that do not touch it (the idea of Dompierre et al. 1999, "How to subdivide pyramids,
prisms and hexahedra into tetrahedra"). Ranks are chosen so that no tetrahedron is turned inside
out, wherever ranks alone can do that.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.resampling.kinds import TET10, CellKind

Block = tuple[CellKind, NDArray[np.intp], NDArray[np.intp]]
"""Kind, element (m,) and places (m, n, 3) of cells on the grids of their elements."""


Locate = Callable[[NDArray[np.intp], NDArray[np.intp]], NDArray[np.float64]]
"""Positions (m, n, 3), mm, of the places (m, n, 3) on the grids of elements (m,)."""

FLAT = 1e-3
"""Jacobian determinant of a tetrahedron, over the cube of its mean edge at one vertex, below which
another cut is looked for."""

ROUNDS = 10
"""Most times that the cells are gone through for a better cut."""


def split(
    blocks: Sequence[tuple[Block, NDArray[np.intp]]],
    kind: CellKind,
    collapsed: NDArray[np.bool_],
    locate: Locate,
) -> Block:
    """Cut linear cells into tetrahedra.

    Parameters
    ----------
    blocks : sequence of (Block, (m, n) int)
        Hexahedra or wedges, and the numbers of their vertices.
    kind : CellKind
        ``tet4`` or ``tet10``; for the latter, the places of the blocks are even.
    collapsed : (e,) bool
        Elements that collapse along xi1 where xi2 = 0.
    locate : callable
        Gives positions.

    Returns
    -------
    Block
        The tetrahedra.
    """
    rank = _ranks(blocks, locate)
    parts = [_tetrahedra(block, rank[vertices]) for block, vertices in blocks]
    _, element, place = (np.concatenate(part) for part in zip(*parts, strict=True))
    if kind is TET10:
        at_pole = collapsed[element][:, None] & (place[..., 1] == 0)
        place = _with_middles(place, at_pole)
    return kind, element, place


def _tetrahedra(
    block: Block, ranks: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]:
    """Cell (t,), element (t,) and places (t, 4, 3) of tetrahedra, by ranks of vertices (m, v)."""
    cells, element, place = block
    cell, corners = _cut(cells, ranks)
    return cell, element[cell], np.take_along_axis(place[cell], corners[..., None], axis=1)


def _quality(
    block: Block, ranks: NDArray[np.intp], locate: Locate
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Cell (t,) of each tetrahedron, and its determinant over the cube of an edge (t,)."""
    cell, element, place = _tetrahedra(block, ranks)
    points = locate(element, place)
    edges = points[:, 1:] - points[:, :1]
    length = np.linalg.norm(edges, axis=-1).mean(1)
    return cell, np.asarray(np.linalg.det(edges) / length**3)


def _cut(cells: CellKind, ranks: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Cell (t,) and corners (t, 4) of tetrahedra, from the ranks of the cells' vertices (m, v)."""
    lowest = ranks.argmin(1)
    found, corners = [], []
    for top in range(cells.vertices):
        of = np.flatnonzero(lowest == top)
        for face in cells.faces:
            if top not in face:
                for triangle in _triangles(np.array(face), ranks[of]):
                    # The face is counter-clockwise from outside: the top sees it clockwise.
                    corners.append(np.column_stack([triangle[:, ::-1], np.full(len(of), top)]))
                    found.append(of)
    return np.concatenate(found), np.concatenate(corners)


def _ranks(blocks: Sequence[tuple[Block, NDArray[np.intp]]], locate: Locate) -> NDArray[np.intp]:
    """Rank of every point: its number, unless it has to come first.

    Where the right ventricle's line of insertion turns, two quadrilaterals, one on each side of the
    cavity, share three vertices. Cut between the outer two, both would have the same triangle, and
    the cavity would end before its corner. So the vertex at the turn comes before all others.
    """
    rank = np.arange(1 + max(int(vertices.max()) for _, vertices in blocks))
    turns = _turns(blocks)
    rank[turns] -= len(rank) ** 2
    for _ in range(ROUNDS):
        changed = False
        for block, vertices in blocks:
            cell, quality = _quality(block, rank[vertices], locate)
            for bad in np.unique(cell[quality < FLAT]):
                changed |= _promote(np.setdiff1d(vertices[bad], turns), blocks, rank, locate)
        if not changed:
            break
    return rank


def _promote(
    candidates: NDArray[np.intp],
    blocks: Sequence[tuple[Block, NDArray[np.intp]]],
    rank: NDArray[np.intp],
    locate: Locate,
) -> bool:
    """Put that vertex first for which the worst tetrahedron around it becomes best, if any."""
    gain, chosen = 0.0, None
    first = int(rank[rank > -len(rank) * (len(rank) - 1)].min()) - 1
    for vertex in candidates:
        worst = np.full(2, np.inf)
        for (kind, element, place), vertices in blocks:
            around = (vertices == vertex).any(1)
            if around.any():
                part = kind, element[around], place[around]
                now = rank[vertices[around]]
                for n, ranks in enumerate((now, np.where(vertices[around] == vertex, first, now))):
                    worst[n] = min(worst[n], _quality(part, ranks, locate)[1].min())
        if worst[1] - worst[0] > gain:
            gain, chosen = float(worst[1] - worst[0]), vertex
    if chosen is not None:
        rank[chosen] = first
    return chosen is not None


def _turns(blocks: Sequence[tuple[Block, NDArray[np.intp]]]) -> NDArray[np.intp]:
    """Vertices in the middle of three that several quadrilaterals share."""
    quads = np.concatenate(
        [
            vertices[:, face]
            for (cells, _, _), vertices in blocks
            for face in cells.faces
            if len(face) == 4
        ]
    )
    _, first = np.unique(np.sort(quads, axis=1), axis=0, return_index=True)
    threes = np.concatenate([np.roll(quads[first], n, axis=1)[:, :3] for n in range(4)])
    _, which, count = np.unique(
        np.sort(threes, axis=1), axis=0, return_inverse=True, return_counts=True
    )
    return np.unique(threes[count[which] > 1, 1])


def _triangles(face: NDArray[np.intp], vertices: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Local vertices (m, 3) of the triangles of a face (n,) of cells with vertices (m, v)."""
    first = vertices[:, face].argmin(1)
    ring = face[(first[:, None] + np.arange(len(face))) % len(face)]
    return [ring[:, [0, n, n + 1]] for n in range(1, len(face) - 1)]


def _with_middles(place: NDArray[np.intp], at_pole: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Places (t, 10, 3) with those halfway between vertices, from the vertices' (t, 4, 3)."""
    out = [place]
    for a, b in (np.flatnonzero(middle) for middle in _edges()):
        ends = place[:, [a, b]].copy()
        # The pole has no xi1 of its own: the edge to it runs along that of its other end.
        for end in (0, 1):
            alone = at_pole[:, (a, b)[end]] & ~at_pole[:, (b, a)[end]]
            ends[alone, end, 0] = ends[alone, 1 - end, 0]
        out.append(ends.sum(1, keepdims=True) // 2)
    return np.concatenate(out, axis=1)


def _edges() -> NDArray[np.bool_]:
    """(6, 4): which vertices are the ends of the edge that each further node is on."""
    middles = TET10.nodes[4:]
    return np.column_stack([2 - middles.sum(1), middles]) > 0  # barycentric coordinates
