"""CHeart: nodes (.X), elements (.T) and the faces of the boundary with their patch (.B).

mm, world (LPS); everything is counted from 1. Nodes of a cell are in the order of CHeart: vertices
first, then the others, each with xi1 running fastest.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.formats.resampling.data import Data
from heartgen.formats.resampling.kinds import CellKind
from heartgen.formats.resampling.resample import Resampled
from heartgen.formats.text import rows
from heartgen.formats.written import Written, write_texts

KINDS = ("hex8", "hex27", "tet4", "tet10")

FACES = {
    3: (0, 1, 2),
    6: (0, 1, 2, 3, 5, 4),
    4: (0, 1, 3, 2),
    9: (0, 1, 3, 2, 4, 7, 8, 5, 6),
}
"""CHeart's order of the nodes of a face, by their number, in terms of ours."""


def write_cheart(cells: Resampled, path: Path, data: Data) -> Written:
    """Write a resampled mesh as .X, .T and .B; patches count the named surfaces from 1.

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
        If CHeart does not have the cells, or there are several kinds of them.
    """
    kinds = [block.kind.name for block in cells.cells]
    if len(kinds) > 1 or kinds[0] not in KINDS:
        raise MeshError(
            f"CHeart has no meshes of {' and '.join(kinds)}: choose tet4 or tet10, or hex8 or "
            "hex27 for a mesh without collapsed elements"
        )
    block = cells.cells[0]
    nodes = block.nodes[:, _order(block.kind)] + 1
    texts = {
        ".X": [f"{len(cells.points)} 3", *rows(cells.points)],
        ".T": [f"{len(nodes)} {len(cells.points)}", *rows(nodes)],
        ".B": _boundary(cells),
    }
    written = write_texts(
        {path.with_suffix(ending): "\n".join(lines) + "\n" for ending, lines in texts.items()}
    )
    patches = ", ".join(f"{n} {name}" for n, name in enumerate(cells.surfaces, start=1))
    return replace(written, notes=(f"patches of {written.files[-1].name}: {patches}",))


def _boundary(cells: Resampled) -> list[str]:
    """Element, nodes and patch of each face of the named surfaces."""
    block = cells.cells[0]
    out = []
    for patch, faces in enumerate(cells.surfaces.values(), start=1):
        for cell, face in faces.tolist():
            local = np.array(block.kind.faces[face])
            nodes = block.nodes[cell, local[list(FACES[len(local)])]] + 1
            out.append(" ".join(map(str, [cell + 1, *nodes.tolist(), patch])))
    return [str(len(out)), *out]


def _order(kind: CellKind) -> NDArray[np.intp]:
    """Our node at each place in CHeart's order."""
    of_vertices = np.arange(len(kind.nodes)) >= kind.vertices
    return np.lexsort((*kind.nodes.T, of_vertices))
