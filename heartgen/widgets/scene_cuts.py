"""A heart cut open: planes through it, what lies behind them, and the wall where it is cut."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.viewing.inside import inner_points
from heartgen.widgets.colors import Painted
from heartgen.widgets.scene_parts import opaque

Array = NDArray[np.float64]

CUTS = {
    "off": "No cut",
    "x": "Long axis, 1",
    "y": "Long axis, 2",
    "z": "Short axis",
    "free": "Free plane",
}

CUT_NORMALS = {"x": (1, 0, 0), "y": (0, -1, 0), "z": (0, 0, 1)}
"""Of the cuts: towards where the camera stands at first; what lies behind is kept."""


def cut_plane(surface: pv.PolyData, normal: Array, position: float) -> tuple[Array, Array]:
    """Origin and normal of a cut through the heart.

    Parameters
    ----------
    surface : PolyData
        Of the mesh; mm, heart frame.
    normal : (3,) float64
        Unit vector towards what is cut away.
    position : float
        From 0, all is cut away, to 1.
    """
    points = np.asarray(surface.points, dtype=float)
    center, heights = (points.min(0) + points.max(0)) / 2, points @ normal
    low, high = heights.min(), heights.max()
    height = low + position * (high - low)
    return center + (height - center @ normal) * normal, normal


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
        As of `heartgen.viewing.inside.inner_grid`; mm, heart frame.
    plane : (array, array)
        Origin and normal.
    painted : Painted
        Colors.
    """
    origin, normal = plane
    grid = inside.copy(deep=False)
    if painted.field is not None:
        grid.point_data["value"] = painted.field.evaluate(inner_points())[..., 0].ravel()
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
    cap.point_data["element"] = np.repeat(elements, sizes).astype(np.float32)
    return cap
