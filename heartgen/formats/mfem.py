"""MFEM: the mesh with curved nodes of order 3 (H1), and fields as grid functions, exactly.

MFEM keeps values at Gauss-Lobatto points, which it numbers by vertices, edges, faces and insides in
the order in which elements meet them. At the pole each element keeps its own vertices: merged,
they would make a face with many neighbors, which MFEM refuses. mm, world (LPS).
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.directions import restored
from heartgen.formats.regions import Tags, tags
from heartgen.formats.written import Written, write_texts
from heartgen.mesh.bernstein import ORDER
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.lagrange_nodes import shared_points
from heartgen.mesh.lattice_order import places

VERTICES = places("000 300 330 030 003 303 333 033")
EDGES = np.array(
    [[0, 1], [1, 2], [3, 2], [0, 3], [4, 5], [5, 6], [7, 6], [4, 7], [0, 4], [1, 5], [2, 6], [3, 7]]
)
FACES = np.array(
    [[3, 2, 1, 0], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7]]
)
"""Vertices of the edges and faces of MFEM's hexahedron."""

OUR_FACES = np.array([4, 2, 1, 3, 0, 5])
"""Which of MFEM's faces ours are: xi1=0, xi1=1, xi2=0, xi2=1, xi3=0, xi3=1."""

CUBE, SQUARE = 5, 3
"""MFEM's numbers of the shapes."""

LOBATTO = np.array([0, (1 - 5**-0.5) / 2, (1 + 5**-0.5) / 2, 1])
"""Gauss-Lobatto points of order 3 on [0, 1]."""


def write_mfem(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as an MFEM file, and each field as a grid function beside it.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    path : path
        Its folder is created if absent. Fields are in files named after it and them, ``.gf``.
    fields : iterable of MeshField
        Discontinuous grid functions of order 3, or 0 for those constant in each element.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If a file cannot be written.
    MeshError
        If a field does not fit the mesh.
    """
    fields, path = fitting(fields, mesh.n_elements), Path(path)
    number, _ = shared_points(mesh.topology)
    vertices = _in_order_of_appearance(number[:, VERTICES])
    element, local = _degrees_of_freedom(number, vertices)
    points = mesh.evaluate(_lobatto_lattice())[element, local]
    named = tags(mesh.topology)
    lines = [
        "MFEM mesh v1.0",
        "",
        "# Coordinates in mm, world (LPS)",
        *(f"# Attribute {tag}: {name}" for tag, name in enumerate(named.regions, 1)),
        *(f"# Boundary attribute {tag}: {name}" for tag, name in enumerate(named.surfaces, 1)),
        *("", "dimension", "3", ""),
        *_elements(vertices, named),
        *("", "vertices", str(vertices.max() + 1), "", "nodes"),
        *_grid_function("H1_3D_P3", points),
    ]
    texts = {path: lines}
    sampled = {
        field.name: field.values if field.per_element else field.evaluate(_lobatto_lattice())
        for field in fields
    }
    values_of = restored(fields, sampled)
    for field, name in zip(fields, _plain([field.name for field in fields]), strict=True):
        space = "L2_3D_P0" if field.per_element else "L2_T1_3D_P3"
        values = values_of[field.name]
        lines = list(_grid_function(space, values.reshape(-1, field.components)))
        texts[path.with_name(f"{path.stem}-{name}.gf")] = lines
    return write_texts({file: "\n".join(lines) + "\n" for file, lines in texts.items()})


def _degrees_of_freedom(
    number: NDArray[np.intp], vertices: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Element and lattice point of each of MFEM's degrees of freedom.

    Parameters
    ----------
    number : (e, 64) int
        Shared numbers of the lattice points.
    vertices : (e, 8) int
        MFEM's numbers of the vertices: edges run from the lower to the higher one.
    """
    everyone = np.arange(len(number))
    inside = places("111 211 121 221 112 212 122 222")
    element, local = [], []

    def take(owners: NDArray[np.intp], points: NDArray[np.intp]) -> None:
        """Points (n, m) of these n elements, each entity once."""
        entity = np.sort(number[owners[:, None], points], axis=1)
        _, first = np.unique(entity, axis=0, return_index=True)
        first.sort()
        element.append(np.repeat(owners[first], points.shape[1]))
        local.append(points[first].ravel())

    take(np.repeat(everyone, len(VERTICES)), np.tile(VERTICES, len(number))[:, None])
    forward = _between(VERTICES[EDGES])  # (12, 2), from the first vertex on
    rises = vertices[:, EDGES[:, 0]] < vertices[:, EDGES[:, 1]]
    edges = np.where(rises[..., None], forward, forward[:, ::-1])
    take(np.repeat(everyone, len(EDGES)), edges.reshape(-1, 2))
    a, b, d, c = (VERTICES[FACES[:, k]] for k in (0, 1, 3, 2))
    low, high = _between(np.stack([a, b], -1)), _between(np.stack([d, c], -1))
    across = np.stack([_between(np.stack([low[:, k], high[:, k]], -1)) for k in (0, 1)], -1)
    take(np.repeat(everyone, len(FACES)), np.tile(across.reshape(-1, 4), (len(number), 1)))
    take(everyone, np.tile(inside, (len(number), 1)))
    return np.concatenate(element), np.concatenate(local)


def _between(ends: NDArray[np.intp]) -> NDArray[np.intp]:
    """The two lattice points between others, (n, 2) from (n, 2)."""
    step = (ends[:, 1] - ends[:, 0]) // (ORDER - 1)
    return np.stack([ends[:, 0] + step, ends[:, 0] + 2 * step], -1)


def _in_order_of_appearance(labels: NDArray[np.intp]) -> NDArray[np.intp]:
    """Number labels from 0 in the order in which they first appear; the same shape."""
    _, first, number = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[number.ravel()].reshape(labels.shape)


def _elements(vertices: NDArray[np.intp], named: Tags) -> Iterator[str]:
    """Elements with their regions, and boundary elements with their surfaces."""
    yield from ("elements", str(len(vertices)))
    for tag, corners in zip(named.region, vertices, strict=True):
        yield f"{tag} {CUBE} {_numbers(corners)}"
    yield from ("", "boundary", str(len(named.faces)))
    for tag, (element, face) in zip(named.surface, named.faces, strict=True):
        yield f"{tag} {SQUARE} {_numbers(vertices[element, FACES[OUR_FACES[face]]])}"


def _grid_function(space: str, values: NDArray[np.float64]) -> Iterator[str]:
    """A finite element function, (n, components)."""
    yield from ("FiniteElementSpace", f"FiniteElementCollection: {space}")
    yield from (f"VDim: {values.shape[1]}", "Ordering: 1", "")
    yield from (" ".join(f"{value:.17g}" for value in row) for row in values)


def _lobatto_lattice() -> NDArray[np.float64]:
    """Local coordinates (64, 3) of the Gauss-Lobatto lattice, xi1 fastest."""
    k, j, i = np.meshgrid(LOBATTO, LOBATTO, LOBATTO, indexing="ij")
    return np.stack([i.ravel(), j.ravel(), k.ravel()], -1)


def _plain(names: list[str]) -> list[str]:
    """Names as parts of file names, all different."""
    plain = [re.sub(r"[^\w.-]+", "_", name) for name in names]
    return [f"{p}-{n}" if plain.count(p) > 1 else p for n, p in enumerate(plain, 1)]


def _numbers(numbers: NDArray[np.intp]) -> str:
    return " ".join(map(str, numbers))
