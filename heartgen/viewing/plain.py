"""A mesh by itself: as a grid of PyVista, and in 3-D without a mask."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyvista as pv

from heartgen.errors import HeartgenError, InputError, MeshError
from heartgen.fields import heart_axes
from heartgen.formats.vtu import LAGRANGE_HEXAHEDRON, lagrange_grid
from heartgen.mesh import HexMesh, MeshField
from heartgen.viewing.fields import frame_of
from heartgen.viewing.scene import (
    REGION_COLORS,
    add_edges,
    add_surface,
    look_at,
    require_graphics,
    require_window,
)

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
    off_screen: bool = False,
    screenshot: str | Path | None = None,
    window_size: tuple[int, int] = (900, 900),
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
    off_screen : bool
        Open no window: the scene is made, to be exported or changed further.
    screenshot : path, optional
        Write a picture there (PNG) instead of opening a window.
    window_size : (int, int)
        Pixels.

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
    with pv.vtk_verbosity("off"):  # that there is no screen is no news
        plotter: Any = pv.Plotter(
            off_screen=off_screen or screenshot is not None, window_size=list(window_size)
        )
    if screenshot is not None:
        require_graphics(plotter)
    elif not (off_screen or plotter.notebook):
        require_window(plotter)
    plotter.set_background("white")
    add_surface(plotter, mesh, cast("Any", color))
    if edges:
        add_edges(plotter, mesh)
    try:
        look_at(plotter, mesh, frame_of(heart_axes(mesh)))
    except HeartgenError:  # no heart: it is seen as it lies
        plotter.reset_camera()
    if screenshot is not None:
        plotter.screenshot(filename=screenshot)
    elif not off_screen:
        plotter.show()
    return cast("pv.Plotter", plotter)
