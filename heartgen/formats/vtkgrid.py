"""VTK's XML file of an unstructured grid: points, cells of any types, and data on both."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.written import Written, write_text

VERSION, OLD_VERSION = "2.2", "1.0"
"""Of the file format. From 2.1 on readers take the last two vertical edges of cubic hexahedra in
the order of `heartgen.formats.vtu`; in files that call themselves older they swap them. Files of
other cells are the same in all versions, and meshio reads those of the first alone."""

LAGRANGE_CURVE = 68
"""First of VTK's numbers of cells of any order; those of linear and quadratic ones are below."""

TYPES = {
    "b": ("UInt8", "u1"),
    "i": ("Int64", "<i8"),
    "u": ("Int64", "<i8"),
    "f": ("Float64", "<f8"),
}
"""VTK's name and numpy's of the type in which each kind of array is stored."""


def write_grid(
    path: str | Path,
    points: NDArray[np.float64],
    cells: Sequence[tuple[int, NDArray[np.intp]]],
    point_data: Mapping[str, NDArray[np.generic]],
    cell_data: Mapping[str, NDArray[np.generic]],
    cell_attributes: Mapping[str, str] | None = None,
) -> Written:
    """Write an unstructured grid.

    Parameters
    ----------
    path : path
        Its folder is created if absent.
    points : (p, 3) float64
        mm, world (LPS).
    cells : sequence of (int, (m, n) int)
        VTK's number of the cell type, and the points of cells of this type.
    point_data, cell_data : mapping of str to (n,) or (n, k) array
        Cells are in the order of the blocks.
    cell_attributes : mapping of str to str, optional
        Special roles of cell data: role and name.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    """
    sizes = np.concatenate([np.full(len(nodes), nodes.shape[1]) for _, nodes in cells])
    types = np.concatenate([np.full(len(nodes), number) for number, nodes in cells])
    version = VERSION if types.max() >= LAGRANGE_CURVE else OLD_VERSION
    attributes = {"type": "UnstructuredGrid", "version": version, "byte_order": "LittleEndian"}
    root = ET.Element("VTKFile", {**attributes, "header_type": "UInt64"})
    root.append(ET.Comment(" Coordinates in mm, world (LPS) "))
    grid = ET.SubElement(root, "UnstructuredGrid")
    counts = {"NumberOfPoints": str(len(points)), "NumberOfCells": str(len(sizes))}
    piece = ET.SubElement(grid, "Piece", counts)
    _append(ET.SubElement(piece, "Points"), "Points", points)
    parent = ET.SubElement(piece, "Cells")
    _append(parent, "connectivity", np.concatenate([nodes.ravel() for _, nodes in cells]))
    _append(parent, "offsets", np.cumsum(sizes))
    _append(parent, "types", types, kind="b")
    of_points = ET.SubElement(piece, "PointData")
    of_cells = ET.SubElement(piece, "CellData", dict(cell_attributes or {}))
    for parent, data in ((of_points, point_data), (of_cells, cell_data)):
        for name, values in data.items():
            _append(parent, name, values)
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
