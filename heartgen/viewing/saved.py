"""The 3-D view of a mesh that was written, over the mask it was made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from heartgen.anatomy import Anatomy
from heartgen.viewing.polydata import mask_surface, to_mask, to_surface
from heartgen.viewing.scene import (
    EDGE_RADIUS,
    ERROR_LIMIT,
    LIGHT,
    MASK,
    MASK_OPACITY,
    SURFACE_LOOK,
    TUBE_SIDES,
    VIEW_ANGLE,
    camera_around,
    color_scale,
)

SUBDIVISION = 2
"""Halvings of a curved cell's edge for the picture: 4 flat pieces."""

TRIANGLES = 15_000
"""Of the mask's surface, at most: a page shows several."""


def plot_saved(mesh: Path, anatomy: Anatomy) -> Any:
    """Make the scene of `heartgen.viewing.plot` of a mesh that was written, colored by the error.

    Parameters
    ----------
    mesh : Path
        A VTU file as heartgen writes it.
    anatomy : Anatomy
        Of the mask.

    Returns
    -------
    pyvista.Plotter
        Off screen.
    """
    grid: Any = pv.read(mesh)
    surface: Any = grid.extract_surface(
        nonlinear_subdivision=SUBDIVISION, algorithm="dataset_surface"
    )
    points = np.asarray(surface.points, dtype=float)
    lean = pv.PolyData(points.astype(np.float32), faces=surface.faces)
    lean.point_data["error"] = to_mask(points, anatomy.myocardium).astype(np.float32)
    with pv.vtk_verbosity("off"):  # that there is no screen is no news
        plotter: Any = pv.Plotter(off_screen=True)
    plotter.set_background("white")
    scale = color_scale("error")
    plotter.add_mesh(
        lean,
        scalars="error",
        cmap=scale.colors,
        clim=scale.limits,
        show_scalar_bar=False,
        name="mesh",
        **SURFACE_LOOK,
    )
    lines: Any = grid.extract_all_edges()
    radius = EDGE_RADIUS * float(np.ptp(points, axis=0).max())
    tubes = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    tubes.clear_data()
    plotter.add_mesh(tubes, color=LIGHT, name="edges")
    _add_mask(plotter, anatomy, lean)
    frame = anatomy.frame[:3, :3]
    eye, center = camera_around(anatomy.to_heart(points))
    place = anatomy.to_world(np.stack([center, eye]))
    plotter.camera.focal_point, plotter.camera.position = place
    plotter.camera.up = frame[:, 2]
    plotter.camera.view_angle = VIEW_ANGLE
    return plotter


def _add_mask(plotter: Any, anatomy: Anatomy, surface: pv.PolyData) -> None:
    """The surface of the mask, the more visible the farther it is from that of the mesh."""
    shown = mask_surface(anatomy.myocardium, TRIANGLES)
    away = to_surface(np.asarray(shown.points), surface.compute_normals(split_vertices=False))
    rgba = np.empty((shown.n_points, 4), dtype=np.uint8)
    rgba[:, :3] = pv.Color(MASK).int_rgb
    rgba[:, 3] = np.round(255 * MASK_OPACITY * np.clip(away / ERROR_LIMIT, 0, 1))
    shown.point_data["color"] = rgba
    actor = plotter.add_mesh(shown, scalars="color", rgb=True, smooth_shading=True, name="mask")
    actor.ForceTranslucentOn()
