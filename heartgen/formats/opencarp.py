"""openCARP: points in micrometers, tetrahedra with their region, fibers; surfaces beside them.

World (LPS). Only tetrahedra are written: for other cells openCARP has an order of nodes of its own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from heartgen.errors import MeshError
from heartgen.formats.resampling.data import Data
from heartgen.formats.resampling.resample import Resampled
from heartgen.formats.text import rows
from heartgen.formats.written import Written, write_texts

MICROMETERS = 1000.0
"""In a millimeter."""


def write_opencarp(cells: Resampled, path: Path, data: Data) -> Written:
    """Write a resampled mesh as .pts, .elem and, if there is a fiber field, .lon.

    For every named surface there are its triangles, .NAME.surf, and its points, .NAME.vtx. Tags of
    the elements count the regions from 1.

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        Any of the files to write; the others have the same name and their own endings.
    data : Data
        Fields sampled on the cells.

    Raises
    ------
    MeshError
        If the cells are not linear tetrahedra.
    """
    if [block.kind.name for block in cells.cells] != ["tet4"]:
        raise MeshError("meshes for openCARP are written as linear tetrahedra: choose tet4")
    elements = np.column_stack([cells.cells[0].nodes, cells.part_numbers()])
    texts = {
        ".pts": [str(len(cells.points)), *rows(MICROMETERS * cells.points)],
        ".elem": [str(len(elements)), *(f"Tt {row}" for row in rows(elements))],
    }
    directions = data.directions()
    if directions:
        texts[".lon"] = [str(len(directions)), *rows(np.column_stack(directions))]
    for name in cells.surfaces:
        (triangles,) = cells.facets(name)
        points = np.unique(triangles)
        texts[f".{name}.surf"] = [str(len(triangles)), *(f"Tr {row}" for row in rows(triangles))]
        texts[f".{name}.vtx"] = [str(len(points)), "extra", *rows(points[:, None])]
    return write_texts(
        {path.with_suffix(ending): "\n".join(lines) + "\n" for ending, lines in texts.items()}
    )
