"""FEBio (.feb, version 4.0): the mesh with its surfaces and fibers, to be included in a model.

mm, world (LPS). Elements are in a domain for each region and kind of cell; materials and loads are
the user's.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.formats.resampling.data import Data
from heartgen.formats.resampling.kinds import CellKind
from heartgen.formats.resampling.resample import Resampled
from heartgen.formats.text import rows
from heartgen.formats.written import Written, write_text

KINDS = {
    "hex8": "hex8",
    "hex20": "hex20",
    "hex27": "hex27",
    "wedge6": "penta6",
    "wedge15": "penta15",
    "tet4": "tet4",
    "tet10": "tet10",
}
"""FEBio's names of the cells."""

FACETS = {3: "tri3", 6: "tri6", 4: "quad4", 8: "quad8", 9: "quad9"}
"""FEBio's names of faces, by their number of nodes."""

HEX27 = (*range(20), 22, 21, 23, 20, 24, 25, 26)
"""FEBio's order of the nodes of a hex27: its faces are y-, x+, y+, x-, z-, z+."""

WALL = "myocardium"
"""Domain of a mesh without regions."""


def write_febio(cells: Resampled, path: Path, data: Data) -> Written:
    """Write a resampled mesh for FEBio.

    Fiber and sheet directions become the material axes; other fields become element data.

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    data : Data
        Fields sampled on the cells.

    Raises
    ------
    MeshError
        If FEBio does not have the cells.
    """
    kinds = [block.kind.name for block in cells.cells]
    if any(kind not in KINDS for kind in kinds):
        raise MeshError(
            f"FEBio has no cells {' and '.join(kinds)}: choose hex8, hex20, tet4 or tet10, or "
            "hex27 for a mesh without collapsed elements"
        )
    root = ET.Element("febio_spec", {"version": "4.0"})
    root.append(ET.Comment(" Coordinates in mm, world (LPS) "))
    ET.SubElement(root, "Module", {"type": "solid"})
    mesh = ET.SubElement(root, "Mesh")
    _table(ET.SubElement(mesh, "Nodes", {"name": "all"}), "node", cells.points)
    domains = _domains(mesh, cells)
    for name in cells.surfaces:
        surface, first = ET.SubElement(mesh, "Surface", {"name": name}), 1
        for nodes in cells.facets(name):
            first = _table(surface, FACETS[nodes.shape[1]], nodes + 1, first)
    _data(ET.SubElement(root, "MeshData"), data, domains)
    ET.indent(root)
    return write_text(ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n", path)


def _domains(mesh: ET.Element, cells: Resampled) -> dict[str, NDArray[np.intp]]:
    """Write the elements of each region and kind; names of these domains, and their cells."""
    region, start = cells.part_numbers(), 0
    out = {}
    for block in cells.cells:
        nodes = block.nodes[:, _order(block.kind)] + 1
        for number, part in enumerate(list(cells.parts) or [WALL], start=1):
            of = np.flatnonzero(region[start : start + len(nodes)] == number)
            if len(of):
                kind = KINDS[block.kind.name]
                name = part if len(cells.cells) == 1 else f"{part} {kind}"
                domain = ET.SubElement(mesh, "Elements", {"type": kind, "name": name})
                for cell, row in zip(of.tolist(), rows(nodes[of], ","), strict=True):
                    ET.SubElement(domain, "elem", {"id": str(start + cell + 1)}).text = row
                out[name] = start + of
        start += len(nodes)
    return out


def _data(parent: ET.Element, data: Data, domains: Mapping[str, NDArray[np.intp]]) -> None:
    """Write the material axes and all other fields of one or three components, by domain."""
    axes = data.axes()
    for domain, cells in domains.items():
        if axes is not None:
            about = {"type": "mat_axis", "elem_set": domain}
            table = ET.SubElement(parent, "ElementData", about)
            for number, pair in enumerate(zip(*(rows(a[cells], ",") for a in axes), strict=True)):
                element = ET.SubElement(table, "elem", {"lid": str(number + 1)})
                for tag, direction in zip("ad", pair, strict=True):
                    ET.SubElement(element, tag).text = direction
        for name, values in data.cells.items():
            kind = {1: "scalar", 3: "vec3"}.get(values.shape[1])
            if kind is not None:
                about = {"name": name, "elem_set": domain, "data_type": kind}
                table = ET.SubElement(parent, "ElementData", about)
                for number, row in enumerate(rows(values[cells], ","), start=1):
                    ET.SubElement(table, "elem", {"lid": str(number)}).text = row


def _table(parent: ET.Element, tag: str, values: NDArray[np.generic], first: int = 1) -> int:
    """Add rows with their numbers; the number after the last."""
    for number, row in enumerate(rows(values, ","), start=first):
        ET.SubElement(parent, tag, {"id": str(number)}).text = row
    return first + len(values)


def _order(kind: CellKind) -> list[int]:
    """Our node at each place in FEBio's order."""
    return list(HEX27) if kind.name == "hex27" else list(range(len(kind.nodes)))
