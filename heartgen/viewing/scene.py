"""The 3-D view: the mesh with its elements, under the translucent surface of the mask."""

from __future__ import annotations

from ctypes.util import find_library
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, cast

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.errors import HeartgenError, InputError
from heartgen.mesh import HexMesh
from heartgen.viewing.card import SURFACE_NAMES
from heartgen.viewing.polydata import (
    MAX_TRIANGLES,
    mask_surface,
    mesh_edges,
    mesh_surface,
    to_mask,
    to_mesh,
)

if TYPE_CHECKING:
    from heartgen.images.levelset import LevelSet
    from heartgen.result import Personalization

Array = NDArray[np.float64]
Color = Literal["error", "quality", "region"]

ERROR_LIMIT = 1.0
"""Distance at the end of the color scale, mm (paper, figure 5)."""

REGION_COLORS = {
    "lv_endo": "#d55e00",
    "rv_endo": "#e69f00",
    "epi": "#56b4e9",
    "base": "#009e73",
    "apical_rim": "#cc79a7",
}
"""Of the surfaces (palette of Okabe and Ito, 2008: safe for the color-blind)."""

MESH, MASK, DARK, LIGHT = "#d8dce2", "#e4572e", "#26303b", "#eef1f4"

MASK_OPACITY = 0.6
"""Opacity of the mask's surface at the error limit from the mesh; it fades to none where both
agree, for there the two would show in patches as voxels decide."""

EDGE_RADIUS = 0.0025
"""Radius of the tubes that show element edges, over the size of the mesh."""

TUBE_SIDES = 6

SCALAR_BAR: Any = {
    "fmt": "%.1f",
    "n_labels": 6,
    "position_x": 0.25,
    "position_y": 0.03,
    "width": 0.5,
    "height": 0.08,
    "title_font_size": 20,
    "label_font_size": 16,
}
"""Below the mesh; places and sizes are shares of the window, letters are in points."""

LEGEND: Any = {"bcolor": None, "loc": "lower left", "size": (0.28, 0.12)}
"""Size as a share of the window."""

AMBIENT, SPECULAR, SPECULAR_POWER = 0.35, 0.15, 15.0
"""Light of the surfaces: bright enough in browsers, a soft highlight to show the shape."""

SURFACE_LOOK: Any = {
    "smooth_shading": True,
    "ambient": AMBIENT,
    "specular": SPECULAR,
    "specular_power": SPECULAR_POWER,
}
"""Of the surface of a mesh, for PyVista."""

ELEVATION = 30.0
"""Degrees above the plane across the long axis from which one looks, to see into the cavity."""

AZIMUTH = -60.0
"""Degrees around the long axis, from the wider axis of the pool, at which one stands."""

UPRIGHT = 90.0
"""Elevation straight from above, degrees."""

VIEW_ANGLE = 30.0
"""Degrees the camera sees; browsers know only this one, the default of VTK."""

FILL = 1.05
"""Height of the view over that of the ball around the mesh."""


@dataclass(frozen=True)
class Scale:
    """A color scale.

    Attributes
    ----------
    title : str
        With the unit.
    colors : str
        A perceptually uniform map of matplotlib.
    limits : (float, float)
        Values at its ends.
    """

    title: str
    colors: Literal["viridis", "cividis"]
    limits: tuple[float, float]


def color_scale(color: str, error_limit: float = ERROR_LIMIT) -> Scale:
    """Scale of a quantity: ``"error"`` in mm up to a limit, or ``"quality"``.

    Parameters
    ----------
    color : str
        Which quantity.
    error_limit : float
        Distance at the end of the scale, mm.
    """
    if color == "error":
        return Scale("distance to the mask (mm)", "viridis", (0.0, error_limit))
    return Scale("Jacobian ratio of the element", "cividis", (0.0, 1.0))


LAST_RESORT = "vtkOSOpenGLRenderWindow"
WITHOUT_SCREEN = ("vtkEGLRenderWindow", LAST_RESORT)
"""Classes of VTK's windows that are none."""


def plot(
    result: Personalization,
    *,
    color: Color | None = "error",
    mask: bool = True,
    edges: bool = True,
    error_limit: float = ERROR_LIMIT,
    off_screen: bool = False,
    screenshot: str | Path | None = None,
    window_size: tuple[int, int] = (900, 900),
) -> pv.Plotter:
    """Show the mesh over the mask's surface, the apex down.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and its report.
    color : {"error", "quality", "region"} or None
        Distance to the mask's surface, Jacobian ratio of each element, surface of the mesh, or one
        color for all.
    mask : bool
        Show the mask's surface, translucent.
    edges : bool
        Show the edges of the elements.
    error_limit : float
        Distance at the end of the color scale, mm.
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
    HeartgenError
        If a picture is asked for where there is no graphics library, or a window without a screen.
    """
    if color not in ("error", "quality", "region", None):
        raise InputError(f"coloring {color!r} is not known: choose error, quality or region")
    with pv.vtk_verbosity("off"):  # that there is no screen is no news
        plotter: Any = pv.Plotter(
            off_screen=off_screen or screenshot is not None, window_size=list(window_size)
        )
    if screenshot is not None:
        require_graphics(plotter)
    elif not (off_screen or plotter.notebook):
        require_window(plotter)
    plotter.set_background("white")
    add_surface(plotter, result.mesh, color, result.anatomy.myocardium, error_limit)
    if edges:
        add_edges(plotter, result.mesh, LIGHT if color == "error" else DARK)
    if mask:
        _add_mask(plotter, result, error_limit)
    _place_camera(plotter, result)
    if screenshot is not None:
        plotter.screenshot(filename=screenshot)
    elif not off_screen:
        plotter.show()
    return cast("pv.Plotter", plotter)


def can_render(plotter: Any) -> bool:
    """Whether there is a graphics library to draw with.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of the scene.
    """
    last_resort = plotter.render_window.GetClassName() == LAST_RESORT
    return not last_resort or find_library("OSMesa") is not None


def require_graphics(plotter: Any) -> None:
    """Refuse to draw where VTK would crash: it falls back on OSMesa even where there is none.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of the scene.
    """
    if not can_render(plotter):
        raise HeartgenError(
            "pictures of the mesh need a graphics library, and this machine has none: install "
            "libegl1 and libgl1-mesa-dri, or make a page with view_html and open it in a browser"
        )


def require_window(plotter: Any) -> None:
    """Refuse to open a window where there is no screen: VTK would show nothing.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of the scene.
    """
    if plotter.render_window.GetClassName() in WITHOUT_SCREEN:
        raise HeartgenError(
            "there is no screen to open a window on: write a picture with "
            'plot(screenshot="mesh.png"), or show it in a notebook'
        )


def add_surface(
    plotter: Any,
    mesh: HexMesh,
    color: Color | None,
    myocardium: LevelSet | None = None,
    error_limit: float = ERROR_LIMIT,
    key: bool = True,
) -> None:
    """Add the surface of a mesh in its colors, with their key.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    mesh : HexMesh
        mm, world (LPS).
    color : {"error", "quality", "region"} or None
        As of `plot`.
    myocardium : LevelSet, optional
        Zero on the surface of the mask; needed for the error.
    error_limit : float
        Distance at the end of the color scale, mm.
    key : bool
        Show what the colors mean.
    """
    surface = mesh_surface(mesh)
    look: Any = {**SURFACE_LOOK, "name": "mesh"}
    if color is None:
        plotter.add_mesh(surface, color=MESH, **look)
    elif color == "region":
        names = list(mesh.topology.surfaces)
        colors = np.array([pv.Color(REGION_COLORS[name]).int_rgb for name in names])
        surface.cell_data["color"] = colors[surface["region"]].astype(np.uint8)
        plotter.add_mesh(surface, scalars="color", rgb=True, **look)
        if key:
            labels = [[SURFACE_NAMES[name], REGION_COLORS[name]] for name in names]
            plotter.add_legend(labels=labels, face="rectangle", **LEGEND)
    else:
        if color == "error":
            assert myocardium is not None
            error = to_mask(surface.points, myocardium)
            surface.point_data["error"] = error.astype(np.float32)
        scale = color_scale(color, error_limit)
        bar: Any = {"title": f"{scale.title}\n", "color": DARK, **SCALAR_BAR}
        plotter.add_mesh(
            surface,
            scalars=color,
            cmap=scale.colors,
            clim=scale.limits,
            scalar_bar_args=bar,
            show_scalar_bar=key,
            **look,
        )


def add_edges(plotter: Any, mesh: HexMesh, color: str = DARK) -> None:
    """Add the edges of the elements on the surface of a mesh, as tubes.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    mesh : HexMesh
        mm, world (LPS).
    color : str
        Of the tubes.
    """
    lines = mesh_edges(mesh)
    radius = EDGE_RADIUS * float(np.ptp(lines.points, axis=0).max())
    tubes = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    plotter.add_mesh(tubes, color=color, smooth_shading=True, name="edges")


def _add_mask(plotter: pv.Plotter, result: Personalization, error_limit: float) -> None:
    """The surface of the mask, the more visible the farther it is from the mesh."""
    surface = mask_surface(result.anatomy.myocardium, MAX_TRIANGLES)
    share = np.clip(to_mesh(surface.points, result.mesh) / error_limit, 0, 1)
    rgba = np.empty((surface.n_points, 4), dtype=np.uint8)
    rgba[:, :3] = pv.Color(MASK).int_rgb
    rgba[:, 3] = np.round(255 * MASK_OPACITY * share)
    surface.point_data["color"] = rgba
    actor = plotter.add_mesh(surface, scalars="color", rgb=True, smooth_shading=True, name="mask")
    actor.ForceTranslucentOn()


def camera_around(
    points: Array, azimuth: float = AZIMUTH, elevation: float = ELEVATION
) -> tuple[Array, Array]:
    """Place the camera so that points are in view.

    Parameters
    ----------
    points : (n, 3) float64
        mm, heart frame.
    azimuth, elevation : float
        Degrees around the long axis and above the plane across it from which one looks.

    Returns
    -------
    eye, center : (3,) float64
        Where the camera is, and what it looks at.
    """
    center = (points.min(0) + points.max(0)) / 2
    radius = float(np.linalg.norm(points - center, axis=1).max())
    around, above = np.radians([azimuth, elevation])
    towards = np.array(
        [np.cos(around) * np.cos(above), np.sin(around) * np.cos(above), np.sin(above)]
    )
    return center + FILL * radius / np.sin(np.radians(VIEW_ANGLE / 2)) * towards, center


def _place_camera(plotter: pv.Plotter, result: Personalization) -> None:
    """Look at the mesh from the side and a little from above, the base up."""
    look_at(plotter, result.mesh, result.anatomy.frame)


def look_at(
    plotter: Any,
    mesh: HexMesh,
    frame: Array,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
) -> None:
    """Place the camera of a plotter so that a mesh stands upright.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Whose camera is placed.
    mesh : HexMesh
        mm, world (LPS).
    frame : (4, 4) float64
        Heart to world: z from apex to base, x to the right ventricle or along the wider axis. mm.
    azimuth, elevation : float
        As of `camera_around`; straight from above or below, y is up.
    """
    rotation, origin = frame[:3, :3], frame[:3, 3]
    points = (mesh.lagrange_points().reshape(-1, 3) - origin) @ rotation
    eye, center = camera_around(points, azimuth, elevation)
    place = np.stack([center, eye]) @ rotation.T + origin
    plotter.camera.focal_point = place[0]
    plotter.camera.position = place[1]
    plotter.camera.up = rotation[:, 1 if abs(elevation) == UPRIGHT else 2]
    plotter.camera.view_angle = VIEW_ANGLE
    plotter.reset_camera_clipping_range()
