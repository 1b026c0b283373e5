"""VTU: the mesh as cubic Lagrange hexahedra for VTK, ParaView and finite element codes, exactly.

A tricubic element is as well given by its places on a 4 x 4 x 4 lattice. Elements share the lattice
points at which they meet; at the pole each element keeps its own, because merged there they would
give readers that build faces a face with many neighbours. mm, world (LPS).
"""

from __future__ import annotations

import base64
from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.formats.files import write_text
from heartgen.formats.sharing import coincident, probe
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.surfaces import face_coefficients

LAGRANGE_HEXAHEDRON = 72
"""VTK's number of the cell type."""

VERSION = "2.2"
"""Of the file format. From 2.1 on readers take the last two vertical edges in the order below;
in files that call themselves older they swap them."""

ORDER = """
000 300 330 030 003 303 333 033
100 200 310 320 130 230 010 020 103 203 313 323 133 233 013 023 001 002 301 302 331 332 031 032
011 021 012 022 311 321 312 322 101 201 102 202 131 231 132 232 110 210 120 220 113 213 123 223
111 211 121 221 112 212 122 222
"""
"""Lattice place (i, j, k) of each of VTK's points: corners, edges, faces, inside."""

TYPES = {
    "b": ("UInt8", "u1"),
    "i": ("Int64", "<i8"),
    "u": ("Int64", "<i8"),
    "f": ("Float64", "<f8"),
}
"""VTK's name and numpy's of the type in which each kind of array is stored."""


def write_vtu(
    mesh: HexMesh, path: str | Path, cell_data: Mapping[str, NDArray[np.generic]] | None = None
) -> None:
    """Write a mesh as an unstructured VTK file.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Its folder is created if absent.
    cell_data : mapping of str to (e,) or (e, n) array, optional
        More data of the elements. Always there are ``structure``, the place of an element in the
        mesh (radial, circumferential, longitudinal), and ``jacobian_ratio``.

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    MeshError
        If the data does not fit the mesh.
    """
    data: dict[str, NDArray[np.generic]] = {
        "structure": mesh.topology.index,
        "jacobian_ratio": jacobian_ratio(mesh),
    }
    for name, values in (cell_data or {}).items():
        data[name] = _checked(name, np.asarray(values), mesh.n_elements)
    number, first = _shared_points(mesh.topology)
    points = mesh.lagrange_points().reshape(-1, 3)[first]
    order = np.array([[int(digit) for digit in place] for place in ORDER.split()]) @ [1, 4, 16]
    connectivity = number[:, order]
    size = connectivity.shape[1]

    attributes = {"type": "UnstructuredGrid", "version": VERSION, "byte_order": "LittleEndian"}
    root = ET.Element("VTKFile", {**attributes, "header_type": "UInt64"})
    root.append(ET.Comment(" Coordinates in mm, world (LPS) "))
    grid = ET.SubElement(root, "UnstructuredGrid")
    counts = {"NumberOfPoints": str(len(points)), "NumberOfCells": str(mesh.n_elements)}
    piece = ET.SubElement(grid, "Piece", counts)
    _append(ET.SubElement(piece, "Points"), "Points", points)
    cells = ET.SubElement(piece, "Cells")
    _append(cells, "connectivity", connectivity.ravel())
    _append(cells, "offsets", size * np.arange(1, mesh.n_elements + 1))
    _append(cells, "types", np.full(mesh.n_elements, LAGRANGE_HEXAHEDRON), kind="b")
    of_cells = ET.SubElement(piece, "CellData")
    for name, values in data.items():
        _append(of_cells, name, values)
    ET.indent(root)
    write_text(ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n", path)


def _shared_points(topology: Topology) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Number of each lattice point (e, 64), and where among all of them each appears first."""
    shape, xi = probe(topology), lattice()
    key = np.zeros((topology.n_elements, len(xi), 6))
    key[..., :3] = shape.evaluate(xi)
    slopes = shape.gradient(xi)
    for element, face in topology.collapsed:
        # The points of a collapsed face are told apart by the direction in which they leave it.
        on = face_coefficients()[face]
        key[element, on, 3:] = slopes[element, on, :, face // 2]
    number, first = coincident(key.reshape(-1, 6))
    return number.reshape(len(key), -1), first


def _checked(name: str, values: NDArray[np.generic], n_elements: int) -> NDArray[np.generic]:
    """Refuse data that is not numbers per element."""
    if values.dtype.kind not in TYPES or values.ndim not in (1, 2) or len(values) != n_elements:
        raise MeshError(
            f"cell data {name!r}: {values.dtype} of shape {values.shape} does not fit the mesh: "
            f"give numbers of shape ({n_elements},) or ({n_elements}, n), one row an element"
        )
    return values


def _append(
    parent: ET.Element, name: str, values: NDArray[np.generic], kind: str | None = None
) -> None:
    """Add an array (n,) or (n, components) as base64 of its size in bytes and its bytes."""
    vtk_type, dtype = TYPES[kind or values.dtype.kind]
    content = values.astype(dtype).tobytes()
    size = np.array(len(content), dtype="<u8").tobytes()
    attributes = {"type": vtk_type, "Name": name, "format": "binary"}
    if values.ndim == 2:
        attributes["NumberOfComponents"] = str(values.shape[1])
    ET.SubElement(parent, "DataArray", attributes).text = base64.b64encode(size + content).decode()
