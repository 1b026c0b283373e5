"""Abaqus input (.inp), which CalculiX and most preprocessors read too: nodes, elements, sets.

mm, world (LPS). Surfaces are there twice: as node sets, and as element surfaces for pressure loads.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.formats.resampling.data import Data
from heartgen.formats.resampling.resample import Resampled
from heartgen.formats.text import packed, rows
from heartgen.formats.written import Written, write_text

TYPES = {
    "hex8": "C3D8",
    "hex20": "C3D20",
    "wedge6": "C3D6",
    "wedge15": "C3D15",
    "tet4": "C3D4",
    "tet10": "C3D10",
}
"""Abaqus's names of the cells; their nodes are in our order."""

FACE_LABELS = {8: (6, 4, 3, 5, 1, 2), 6: (1, 2, 3, 4, 5), 4: (1, 2, 3, 4)}
"""Abaqus's number of each of our faces, by the number of vertices of the cell."""

PER_LINE = 16
"""Most numbers in a line."""

WALL = "MYOCARDIUM"
"""Set of all elements."""

AXES = ", 1., 0., 0., 0., 1., 0."
"""Orientation of elements that are given none: that of the world."""


def write_abaqus(cells: Resampled, path: Path, data: Data) -> Written:
    """Write a resampled mesh as Abaqus input, with fibers and sheets as an orientation.

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
        If Abaqus does not have the cells.
    """
    kinds = [block.kind.name for block in cells.cells]
    if any(kind not in TYPES for kind in kinds):
        raise MeshError(
            f"Abaqus input has no place for {' and '.join(kinds)}: choose hex8, hex20, tet4 or "
            "tet10"
        )
    lines = [
        "*HEADING",
        "Coordinates in mm, world (LPS)",
        "*NODE, NSET=NODES",
        *_numbered(cells.points),
        *_elements(cells),
        *_sets(cells),
        *_orientation(data.axes()),
    ]
    return write_text("\n".join(lines) + "\n", path)


def _elements(cells: Resampled) -> Iterator[str]:
    """All elements, block by block."""
    start = 1
    for block in cells.cells:
        yield f"*ELEMENT, TYPE={TYPES[block.kind.name]}, ELSET={WALL}"
        table = np.column_stack([start + np.arange(len(block.nodes)), block.nodes + 1])
        for row in table:
            yield from packed(row, PER_LINE)
        start += len(block.nodes)


def _sets(cells: Resampled) -> Iterator[str]:
    """Regions as element sets; surfaces as node sets and as surfaces of elements."""
    for name, members in cells.parts.items():
        yield from _set(f"*ELSET, ELSET={_label(name)}", members)
    vertices = np.concatenate(
        [np.full(len(block.nodes), block.kind.vertices) for block in cells.cells]
    )
    for name, faces in cells.surfaces.items():
        nodes = np.unique(np.concatenate([n.ravel() for n in cells.facets(name)]))
        yield from _set(f"*NSET, NSET={_label(name)}", nodes)
        labels = [FACE_LABELS[vertices[cell]][face] for cell, face in faces.tolist()]
        sides = sorted(set(labels))
        for side in sides:
            of = faces[np.array(labels) == side, 0]
            yield from _set(f"*ELSET, ELSET=_{_label(name)}_S{side}", np.unique(of))
        yield f"*SURFACE, NAME={_label(name)}_FACES, TYPE=ELEMENT"
        yield from (f"_{_label(name)}_S{side}, S{side}" for side in sides)


def _orientation(axes: tuple[NDArray[np.float64], NDArray[np.float64]] | None) -> Iterator[str]:
    """Local axes of the elements: along the fiber, and in the plane of fiber and sheet."""
    if axes is None:
        return
    yield from (
        "*DISTRIBUTION TABLE, NAME=FIBER_TABLE",
        "COORD3D, COORD3D",
        "*DISTRIBUTION, NAME=FIBER_AXES, LOCATION=ELEMENT, TABLE=FIBER_TABLE",
        AXES,
        *_numbered(np.column_stack(axes)),
        "*ORIENTATION, NAME=FIBERS, SYSTEM=RECTANGULAR",
        "FIBER_AXES",
        "1, 0.",
    )


def _set(head: str, members: NDArray[np.intp]) -> Iterator[str]:
    yield head
    yield from packed(members + 1, PER_LINE)


def _numbered(table: NDArray[np.float64]) -> Iterator[str]:
    """Rows with their numbers, from 1."""
    for number, row in enumerate(rows(table, ", "), start=1):
        yield f"{number}, {row}"


def _label(name: str) -> str:
    """A name as Abaqus has them."""
    return name.upper().replace(" ", "_")
