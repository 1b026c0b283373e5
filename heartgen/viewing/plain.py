"""A mesh by itself: as a grid of PyVista, and in 3-D without a mask."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Unpack, cast

import numpy as np
import pyvista as pv

from heartgen.errors import HeartgenError, InputError, MeshError
from heartgen.fields import heart_axes
from heartgen.formats.vtu import LAGRANGE_HEXAHEDRON, lagrange_grid
from heartgen.mesh import HexMesh, MeshField
from heartgen.viewing.camera import frame_of, look_at
from heartgen.viewing.scene import REGION_COLORS, add_edges, add_surface
from heartgen.viewing.windows import Window, WindowOptions

COLORS = ("quality", "region")
"""Colorings that need neither a mask nor fields."""


def to_pyvista(mesh: HexMesh, fields: Iterable[MeshField] = ()) -> pv.UnstructuredGrid:
    """Grid of cubic Lagrange hexahedra, with the data that a VTU file has.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    fields : iterable of MeshField
        Fields on the mesh.

    Returns
    -------
    pyvista.UnstructuredGrid
        mm, world (LPS).
    """
    grid = lagrange_grid(mesh, fields)
    cells = np.insert(grid.cells, 0, grid.cells.shape[1], axis=1)
    kinds = np.full(len(cells), LAGRANGE_HEXAHEDRON, dtype=np.uint8)
    made: Any = pv.UnstructuredGrid(cells.ravel(), kinds, grid.points)
    made.point_data.update(grid.point_data)
    made.cell_data.update(grid.cell_data)
    return cast("pv.UnstructuredGrid", made)


def plot_mesh(
    mesh: HexMesh,
    color: str | None = "region",
    *,
    edges: bool = True,
    **window: Unpack[WindowOptions],
) -> pv.Plotter:
    """Show a mesh, the apex down if that can be told.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    color : {"region", "quality"} or None
        Surface, if all are those of a heart; Jacobian ratio of each element; or one color for all.
    edges : bool
        Show the edges of the elements.
    **window : WindowOptions
        ``off_screen``, ``screenshot`` and ``window_size``: see
        `heartgen.viewing.windows.WindowOptions`.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    InputError
        If there is no such coloring.
    MeshError
        If the mesh has no named surfaces.
    HeartgenError
        If a picture is asked for where there is no graphics library, or a window without a screen.
    """
    if color not in (*COLORS, None):
        raise InputError(
            f"coloring {color!r} of a mesh alone is not known: choose {', '.join(COLORS)} or None; "
            "fields are shown by heartgen.viewing.plot_field"
        )
    if not any(len(faces) for faces in mesh.surfaces.values()):
        raise MeshError("a mesh without named surfaces cannot be shown: to_pyvista gives its cells")
    if not set(mesh.surfaces) <= set(REGION_COLORS):
        color = None if color == "region" else color
    target = Window(**window)
    plotter: Any = target.empty()
    add_surface(plotter, mesh, cast("Any", color))
    if edges:
        add_edges(plotter, mesh)
    try:
        look_at(plotter, mesh, frame_of(heart_axes(mesh)))
    except HeartgenError:  # no heart: it is seen as it lies
        plotter.reset_camera()
    return target.shown(plotter)
