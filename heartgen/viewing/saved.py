"""The 3-D view of a mesh that was written, over the mask it was made of."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv

from heartgen.anatomy import Anatomy
from heartgen.viewing.camera import aim, camera_around
from heartgen.viewing.contours import EDGE_RADIUS, TUBE_SIDES
from heartgen.viewing.polydata import mask_surface, to_mask, to_surface
from heartgen.viewing.scene import CODED_LOOK, LIGHT, add_mask, color_scale
from heartgen.viewing.windows import Window

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
    plotter: Any = Window(off_screen=True).empty()
    scale = color_scale("error")
    plotter.add_mesh(
        lean,
        scalars="error",
        cmap=scale.colors,
        clim=scale.limits,
        show_scalar_bar=False,
        name="mesh",
        **CODED_LOOK,
    )
    lines: Any = grid.extract_all_edges()
    radius = EDGE_RADIUS * float(np.ptp(points, axis=0).max())
    tubes = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    tubes.clear_data()
    plotter.add_mesh(tubes, color=LIGHT, name="edges")
    mask = mask_surface(anatomy.myocardium, TRIANGLES)
    away = to_surface(np.asarray(mask.points), lean.compute_normals(split_vertices=False))
    add_mask(plotter, mask, away)
    eye, center = camera_around(anatomy.to_heart(points))
    eye, center = anatomy.to_world(np.stack([eye, center]))
    aim(plotter, eye, center, anatomy.frame[:3, 2])
    return plotter
