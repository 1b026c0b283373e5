"""Gmsh MSH 2.2: the mesh as hexahedra of order 3 for Gmsh, MFEM, meshio, exactly.

Regions and surfaces are physical groups. Fields are data of the elements' own points, so that they
may jump where elements meet; so are those that are constant in each element, for meshio refuses
data of elements (``$ElementData``) where there are faces beside them. mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.regions import tags
from heartgen.formats.written import Written, write_text
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.lagrange_nodes import shared_points
from heartgen.mesh.lattice_order import places
from heartgen.mesh.surface_faces import face_coefficients, face_signs

HEXAHEDRON, QUADRANGLE = 92, 36
"""Gmsh's numbers of the element types of order 3."""

HEXAHEDRON_ORDER = """
000 300 330 030 003 303 333 033
100 200 010 020 001 002 310 320 301 302 230 130 331 332 031 032 103 203 013 023 313 323 233 133
110 120 220 210 101 201 202 102 011 012 022 021 311 321 322 312 231 131 132 232 113 213 223 123
111 211 221 121 112 212 222 122
"""
"""Lattice place (i, j, k) of each of Gmsh's points: corners, edges, faces, inside."""

QUADRANGLE_ORDER = "00 30 33 03 10 20 31 32 23 13 02 01 11 21 22 12"

SIZES = (1, 3, 9)
"""Components that data in Gmsh may have."""


def write_msh(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as a Gmsh file.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Fields of 1, 3 or 9 components are views of that name; others one view per component.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    MeshError
        If a field does not fit the mesh.
    """
    fields = fitting(fields, mesh.n_elements)
    number, first = shared_points(mesh.topology)
    named, order = tags(mesh.topology), places(HEXAHEDRON_ORDER)
    quads = number[named.faces[:, :1], _quads()[named.faces[:, 1]]]
    names = [(2, tag, name) for tag, name in enumerate(named.surfaces, 1)]
    names += [(3, tag, name) for tag, name in enumerate(named.regions, 1)]
    elements = [
        f"{e} {HEXAHEDRON} 2 {tag} {tag} {_numbers(points)}"
        for e, (tag, points) in enumerate(zip(named.region, number[:, order], strict=True), 1)
    ]
    elements += [
        f"{e} {QUADRANGLE} 2 {tag} {tag} {_numbers(points)}"
        for e, (tag, points) in enumerate(zip(named.surface, quads, strict=True), len(elements) + 1)
    ]
    points = mesh.lagrange_points().reshape(-1, 3)[first]
    nodes = [f"{n} {_reals(place)}" for n, place in enumerate(points, 1)]
    lines = [
        *("$MeshFormat", "2.2 0 8", "$EndMeshFormat"),
        *("$Comments", "Coordinates in mm, world (LPS)", "$EndComments"),
        *_section("PhysicalNames", [f'{d} {tag} "{name}"' for d, tag, name in names]),
        *_section("Nodes", nodes),
        *_section("Elements", elements),
        *(line for field in fields for line in _views(field, order)),
    ]
    return write_text("\n".join(lines) + "\n", path)


def _quads() -> NDArray[np.intp]:
    """Coefficients (6, 16) of each face in Gmsh's order, counter-clockwise seen from outside."""
    u_first = places(QUADRANGLE_ORDER)
    v_first = places(" ".join(place[::-1] for place in QUADRANGLE_ORDER.split()))
    order = np.where(face_signs()[:, None] > 0, u_first, v_first)
    return np.take_along_axis(face_coefficients(), order, axis=1)


def _section(name: str, rows: list[str]) -> Iterator[str]:
    yield from (f"${name}", str(len(rows)), *rows, f"$End{name}")


def _views(field: MeshField, order: NDArray[np.intp]) -> Iterator[str]:
    """Data of the elements; a field of an odd size is written component by component."""
    shape = (len(field.values), len(order), field.components)
    values = np.broadcast_to(field.values[:, None], shape) if field.per_element else field.values
    if field.components in SIZES:
        yield from _view(field.name, values, order)
        return
    for k in range(field.components):
        yield from _view(f"{field.name} {k + 1}", values[..., k, None], order)


def _view(name: str, values: NDArray[np.float64], order: NDArray[np.intp]) -> Iterator[str]:
    """One named set of data, (e, 64, k)."""
    quoted = name.replace('"', "'")
    yield from ("$ElementNodeData", "1", f'"{quoted}"', "1", "0")
    yield from ("3", "0", str(values.shape[-1]), str(len(values)))
    for e, row in enumerate(values, 1):
        yield f"{e} {len(order)} {_reals(row[order].ravel())}"
    yield "$EndElementNodeData"


def _numbers(points: NDArray[np.intp]) -> str:
    """Numbers as Gmsh counts them, from 1."""
    return " ".join(map(str, points + 1))


def _reals(values: NDArray[np.float64]) -> str:
    return " ".join(f"{value:.17g}" for value in values)
