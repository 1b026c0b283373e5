"""A heart cut open: planes through it, what lies behind them, and the wall where it is cut."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.mesh import HexMesh
from heartgen.viewing.polydata import SUBDIVISION
from heartgen.widgets.colors import Painted
from heartgen.widgets.scene_parts import opaque

Array = NDArray[np.float64]

PIECES = (SUBDIVISION, SUBDIVISION, 2)
"""Flat pieces of an element, where it is cut open, along xi1, xi2 and xi3."""

CUTS = {"off": "No cut", "x": "Long axis, 1", "y": "Long axis, 2", "z": "Short axis"}

CUT_NORMALS = {"x": (1, 0, 0), "y": (0, -1, 0), "z": (0, 0, 1)}
"""Of the cuts: towards where the camera stands at first; what lies behind is kept."""


def cut_plane(surface: pv.PolyData, normal: Array, position: float) -> tuple[Array, Array]:
    """Origin and normal of a cut through the heart.

    Parameters
    ----------
    surface : PolyData
        Of the mesh; mm, heart frame.
    normal : (3,) float64
        Along one of the axes.
    position : float
        From 0 to 1 through the heart.
    """
    axis = int(np.argmax(np.abs(normal)))
    low, high = np.array(surface.bounds).reshape(3, 2).T
    origin = (low + high) / 2
    origin[axis] = low[axis] + position * (high[axis] - low[axis])
    return origin, normal


def cut(data: pv.PolyData, plane: tuple[Array, Array]) -> pv.PolyData:
    """What lies behind a plane.

    Parameters
    ----------
    data : PolyData
        To be cut; mm, heart frame.
    plane : (array, array)
        Origin and normal.
    """
    if data.n_points == 0:
        return data
    origin, normal = plane
    return data.clip(normal=normal, origin=origin)


def cut_surface(
    inside: pv.UnstructuredGrid, plane: tuple[Array, Array], painted: Painted
) -> pv.PolyData:
    """The wall where it is cut.

    Parameters
    ----------
    inside : UnstructuredGrid
        As of `inner_grid`; mm, heart frame.
    plane : (array, array)
        Origin and normal.
    painted : Painted
        Colors.
    """
    origin, normal = plane
    grid = inside.copy(deep=False)
    if painted.field is not None:
        grid.point_data["value"] = painted.field.evaluate(_inside())[..., 0].ravel()
    cap = grid.slice(normal=normal, origin=origin)
    if cap.n_cells == 0:
        return pv.PolyData()
    elements = np.asarray(cap.cell_data["element"], dtype=int)
    values = cap.point_data["value"] if painted.field is not None else None
    cap = pv.PolyData(cap.points, faces=cap.faces)
    corners = cap.cast_to_unstructured_grid()
    sizes = np.diff(corners.cell_offsets)
    flat = cap.points[corners.cell_connectivity]  # no points in common: each face has one color
    faces = np.insert(np.arange(len(flat)), np.r_[0, np.cumsum(sizes)[:-1]], sizes)
    cap = pv.PolyData(flat, faces=faces)
    cap.point_data["Normals"] = np.tile(normal, (len(flat), 1)).astype(np.float32)
    if values is None:
        rgb = np.repeat(painted.inside(elements), sizes, axis=0)
    else:
        rgb = painted.inside(np.asarray(values)[corners.cell_connectivity])
    cap.point_data["rgba"] = opaque(rgb)
    return cap


def inner_grid(mesh: HexMesh) -> pv.UnstructuredGrid:
    """The inside of a mesh in flat pieces, with the ``element`` of each.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    n, xi = PIECES, _inside()
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


def _inside() -> Array:
    """Local coordinates (q, 3) of the corners of the pieces of an element."""
    t = [np.linspace(0, 1, k + 1) for k in PIECES]
    return np.stack(np.meshgrid(*t, indexing="ij"), -1).reshape(-1, 3)
