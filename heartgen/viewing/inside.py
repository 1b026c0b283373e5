"""The inside of a mesh in flat pieces, to be cut open."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.mesh import HexMesh
from heartgen.viewing.polydata import SUBDIVISION

Array = NDArray[np.float64]

PIECES = (SUBDIVISION, SUBDIVISION, 2)
"""Flat pieces of an element along xi1, xi2 and xi3."""


def inner_grid(mesh: HexMesh) -> pv.UnstructuredGrid:
    """The inside of a mesh in flat pieces, with the ``element`` of each.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    n, xi = PIECES, inner_points()
    points = mesh.evaluate(xi)
    place = np.arange(len(xi)).reshape([k + 1 for k in n])
    corners = [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ]
    cells = np.stack(
        [place[a : a + n[0], b : b + n[1], c : c + n[2]].ravel() for a, b, c in corners], -1
    )
    shift = np.arange(mesh.n_elements)[:, None, None] * len(xi)
    cells = (cells[None] + shift).reshape(-1, 8)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points.reshape(-1, 3))
    grid.cell_data["element"] = np.repeat(np.arange(mesh.n_elements), np.prod(n))
    return grid


def inner_points() -> Array:
    """Local coordinates (q, 3) of the corners of the pieces of an element."""
    t = [np.linspace(0, 1, k + 1) for k in PIECES]
    return np.stack(np.meshgrid(*t, indexing="ij"), -1).reshape(-1, 3)
