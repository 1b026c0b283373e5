"""VTU: the mesh as cubic Lagrange hexahedra for VTK, ParaView and finite element codes, exactly.

A tricubic element is as well given by its places on a 4 x 4 x 4 lattice. mm, world (LPS).
"""

from __future__ import annotations

import base64
from collections.abc import Iterable
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.files import Written, write_text
from heartgen.formats.lattice import shared_points
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio

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


def write_vtu(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as an unstructured VTK file.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Data of the points, or of the cells for those that are constant in each element. Elements
        do not share the points where one of them jumps. Data of the cells are always
        ``structure``, the place of an element in the mesh (radial, circumferential,
        longitudinal), and ``jacobian_ratio``, unless a field of that name is given.

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
    data: dict[str, NDArray[np.generic]] = {
        "structure": mesh.topology.index,
        "jacobian_ratio": jacobian_ratio(mesh),
    }
    data |= {field.name: field.values for field in fields if field.per_element}
    number, first = shared_points(mesh.topology, fields)
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
    of_points, of_cells = ET.SubElement(piece, "PointData"), ET.SubElement(piece, "CellData")
    for field in fields:
        if not field.per_element:
            _append(of_points, field.name, field.values.reshape(-1, field.components)[first])
    for name, values in data.items():
        _append(of_cells, name, values)
    ET.indent(root)
    return write_text(ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n", path)


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
