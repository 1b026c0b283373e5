"""Resampled meshes for VTK and everything that reads its files, and as XDMF."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.resampling.data import Data
from heartgen.formats.resampling.jacobians import scaled_jacobian
from heartgen.formats.resampling.resample import Resampled
from heartgen.formats.text import rows
from heartgen.formats.vtkgrid import write_grid
from heartgen.formats.written import Written, write_text

VTK = {
    "hex8": 12,
    "hex20": 25,
    "hex27": 29,
    "wedge6": 13,
    "wedge15": 26,
    "wedge18": 32,
    "tet4": 10,
    "tet10": 24,
}
"""VTK's numbers of the cell types; their nodes are in our order."""

XDMF = {
    "hex8": 9,
    "hex20": 48,
    "hex27": 50,
    "wedge6": 8,
    "wedge15": 40,
    "wedge18": 41,
    "tet4": 6,
    "tet10": 38,
}
"""XDMF's numbers of the cell types; the order of their nodes is that of VTK."""

XDMF_TYPES = {1: "Scalar", 3: "Vector", 6: "Tensor6", 9: "Tensor"}
"""What XDMF calls data, by the number of components."""


def write_cells_vtu(cells: Resampled, path: Path, data: Data) -> Written:
    """Write a resampled mesh as an unstructured VTK file.

    Data of the points are fields with one value at each, and, for every named surface, 1 on its
    points; data of the cells are the other fields, the element of the mesh (``element``), the
    region (``part``) and the quality (``scaled_jacobian``). mm, world (LPS).

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    data : Data
        Fields sampled on the cells.
    """
    blocks = [(VTK[block.kind.name], block.nodes) for block in cells.cells]
    return write_grid(path, cells.points, blocks, _of_points(cells, data), _of_cells(cells, data))


def write_xdmf(cells: Resampled, path: Path, data: Data) -> Written:
    """Write a resampled mesh as one XDMF file without HDF5 beside it; data as in `write_cells_vtu`.

    Data with a number of components that XDMF has no name for are written component by component.
    mm, world (LPS).

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    data : Data
        Fields sampled on the cells.
    """
    root = ET.Element("Xdmf", {"Version": "3.0"})
    grid = ET.SubElement(ET.SubElement(root, "Domain"), "Grid", {"Name": path.stem})
    ET.SubElement(grid, "Time", {"Value": "0"})  # PyVista opens no file without a time
    count = {"NumberOfElements": str(cells.n_cells)}
    if len(cells.cells) == 1:
        kind, nodes = cells.cells[0].kind.name, cells.cells[0].nodes
        topology = ET.SubElement(grid, "Topology", {"TopologyType": XDMF_NAMES[kind], **count})
        _item(topology, nodes)
    else:
        mixed = [
            np.column_stack([np.full(len(block.nodes), XDMF[block.kind.name]), block.nodes]).ravel()
            for block in cells.cells
        ]
        topology = ET.SubElement(grid, "Topology", {"TopologyType": "Mixed", **count})
        _item(topology, np.concatenate(mixed))
    _item(ET.SubElement(grid, "Geometry", {"GeometryType": "XYZ"}), cells.points)
    for center, found in (("Node", _of_points(cells, data)), ("Cell", _of_cells(cells, data))):
        for name, values in _nameable(found):
            kind = XDMF_TYPES[1 if values.ndim == 1 else values.shape[1]]
            about = {"Name": name, "AttributeType": kind, "Center": center}
            _item(ET.SubElement(grid, "Attribute", about), values)
    text = ET.tostring(root, encoding="unicode", xml_declaration=True)
    return write_text(text + "\n", path)


XDMF_NAMES = {
    "hex8": "Hexahedron",
    "hex20": "Hexahedron_20",
    "hex27": "Hexahedron_27",
    "wedge6": "Wedge",
    "wedge15": "Wedge_15",
    "wedge18": "Wedge_18",
    "tet4": "Tetrahedron",
    "tet10": "Tetrahedron_10",
}
"""XDMF's names of the cell types."""


def _nameable(
    data: dict[str, NDArray[np.generic]],
) -> Iterator[tuple[str, NDArray[np.generic]]]:
    """Data with numbers of components that XDMF has a name for."""
    for name, values in data.items():
        if values.ndim == 1 or values.shape[1] in XDMF_TYPES:
            yield name, values
        else:
            yield from ((f"{name} {k + 1}", part) for k, part in enumerate(values.T))


def _item(parent: ET.Element, values: NDArray[np.generic]) -> None:
    """Add an array as text."""
    of_floats = values.dtype.kind == "f"
    about = {
        "DataType": "Float" if of_floats else "Int",
        "Precision": "8",
        "Dimensions": " ".join(map(str, values.shape)),
        "Format": "XML",
    }
    table = values[:, None] if values.ndim == 1 else values
    ET.SubElement(parent, "DataItem", about).text = "\n" + "\n".join(rows(table)) + "\n"


def _of_points(cells: Resampled, data: Data) -> dict[str, NDArray[np.generic]]:
    """Data of the points."""
    out: dict[str, NDArray[np.generic]] = {}
    for name in cells.surfaces:
        on = np.zeros(len(cells.points), dtype=np.int64)
        for nodes in cells.facets(name):
            on[nodes] = 1
        out[name] = on
    return out | {name: _flat(values) for name, values in data.points.items()}


def _of_cells(cells: Resampled, data: Data) -> dict[str, NDArray[np.generic]]:
    """Data of the cells."""
    quality = [scaled_jacobian(block.kind, cells.points[block.nodes]) for block in cells.cells]
    out: dict[str, NDArray[np.generic]] = {
        "element": np.concatenate([block.element for block in cells.cells]),
        "part": cells.part_numbers(),
        "scaled_jacobian": np.concatenate(quality),
    }
    return out | {name: _flat(data.cells[name]) for name in data.cells if name in data.jumping}


def _flat(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (n, k), or (n,) if there is one component."""
    return values[:, 0] if values.shape[1] == 1 else values
