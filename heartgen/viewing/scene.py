"""The 3-D view: the mesh with its elements, under the translucent surface of the mask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, Unpack

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.errors import InputError
from heartgen.mesh import HexMesh
from heartgen.renamed import keep_former_names
from heartgen.viewing.camera import look_at
from heartgen.viewing.card import SURFACE_NAMES
from heartgen.viewing.contours import EDGE_RADIUS, TUBE_SIDES, contour_tubes
from heartgen.viewing.polydata import (
    MAX_TRIANGLES,
    mask_surface,
    mesh_edges,
    mesh_surface,
    to_mask,
    to_mesh,
)
from heartgen.viewing.windows import Window, WindowOptions

if TYPE_CHECKING:
    from heartgen.images.levelset import LevelSet
    from heartgen.result import Personalization

Array = NDArray[np.float64]
Color = Literal["error", "quality", "region"]

ERROR_LIMIT = 1.0
"""Distance at the end of the color scale of several meshes side by side, mm (paper, figure 5)."""

NICE_LIMITS = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)
"""Ends of the color scale of one mesh, mm."""

ROOM = 2.0
"""End of that scale over the 95th percentile of the error, at least."""

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


CODED_LOOK: Any = {
    "smooth_shading": True,
    "ambient": 0.85,
    "diffuse": 0.15,
    "specular": 0.0,
}
"""Of a surface whose colors stand for values: hardly shaded, for shade would be another value."""


class Colors(Protocol):
    """Title, map and limits of the colors of a scalar; without limits, they are its own."""

    @property
    def title(self) -> str:
        """With the unit."""

    @property
    def colors(self) -> str:
        """A map of matplotlib."""

    @property
    def limits(self) -> tuple[float, float] | None:
        """Values at the ends."""


@dataclass(frozen=True)
class Scale:
    """A color scale.

    Attributes
    ----------
    title : str
        With the unit.
    colors : str
        A perceptually uniform map of matplotlib; of differences, one with white in the middle.
    limits : (float, float)
        Values at its ends.
    """

    title: str
    colors: Literal["viridis", "cividis", "RdBu_r"]
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


def nice_limit(p95: float) -> float:
    """End of a scale that suits a 95th percentile of the error, mm.

    Parameters
    ----------
    p95 : float
        The percentile, mm.
    """
    return next((limit for limit in NICE_LIMITS if limit >= ROOM * p95), NICE_LIMITS[-1])


def plot(
    result: Personalization,
    *,
    color: Color | None = "error",
    mask: bool = True,
    edges: bool = True,
    error_limit: float | None = None,
    **window: Unpack[WindowOptions],
) -> pv.Plotter:
    """Show the mesh over the mask's surface, or the contours of a stack, the apex down.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and its report.
    color : {"error", "quality", "region"} or None
        Distance to the mask's surface, Jacobian ratio of each element, surface of the mesh, or one
        color for all.
    mask : bool
        Show the mask's surface, translucent; of a stack, the contours in its slices.
    edges : bool
        Show the edges of the elements.
    error_limit : float, optional
        Distance at the end of the color scale, mm; one that suits the result if omitted.
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
    HeartgenError
        If a picture is asked for where there is no graphics library, or a window without a screen.
    """
    if color not in ("error", "quality", "region", None):
        raise InputError(f"coloring {color!r} is not known: choose error, quality or region")
    target = Window(**window)
    error_limit = error_limit or nice_limit(result.report.accuracy.p95)
    plotter = target.empty()
    add_surface(plotter, result.mesh, color, result.anatomy.myocardium, error_limit)
    if edges:
        add_edges(plotter, result.mesh, LIGHT if color == "error" else DARK)
    if mask and result.anatomy.slices is not None:
        plotter.add_mesh(contour_tubes(result.anatomy), color=MASK, name="mask")
    elif mask:
        surface = mask_surface(result.anatomy.myocardium, MAX_TRIANGLES)
        add_mask(plotter, surface, to_mesh(surface.points, result.mesh), error_limit)
    look_at(plotter, result.mesh, result.anatomy.frame)
    return target.shown(plotter)


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
    if color is None:
        plotter.add_mesh(surface, color=MESH, name="mesh", **SURFACE_LOOK)
    elif color == "region":
        names = list(mesh.topology.surfaces)
        colors = np.array([pv.Color(REGION_COLORS[name]).int_rgb for name in names])
        surface.cell_data["color"] = colors[surface["region"]].astype(np.uint8)
        plotter.add_mesh(surface, scalars="color", rgb=True, name="mesh", **CODED_LOOK)
        if key:
            labels = [[SURFACE_NAMES[name], REGION_COLORS[name]] for name in names]
            plotter.add_legend(labels=labels, face="rectangle", **LEGEND)
    else:
        if color == "error":
            assert myocardium is not None
            error = to_mask(surface.points, myocardium)
            surface.point_data["error"] = error.astype(np.float32)
        add_scalar_surface(plotter, surface, color, color_scale(color, error_limit), key)


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


def add_mask(
    plotter: Any, surface: pv.PolyData, distance: Array, error_limit: float = ERROR_LIMIT
) -> None:
    """Add the surface of a mask, the more visible the farther it is from the mesh.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    surface : pyvista.PolyData
        Of the mask; it gets colors.
    distance : (n,) float64
        Of its points from the mesh, mm.
    error_limit : float
        Distance at which it is most visible, mm.
    """
    rgba = np.empty((surface.n_points, 4), dtype=np.uint8)
    rgba[:, :3] = pv.Color(MASK).int_rgb
    rgba[:, 3] = np.round(255 * MASK_OPACITY * np.clip(distance / error_limit, 0, 1))
    surface.point_data["color"] = rgba
    actor = plotter.add_mesh(surface, scalars="color", rgb=True, smooth_shading=True, name="mask")
    actor.ForceTranslucentOn()


def add_scalar_surface(
    plotter: Any, surface: pv.PolyData, name: str, scale: Colors, key: bool = True
) -> None:
    """Add a surface in the colors of a scalar, with their key below.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    surface : pyvista.PolyData
        Of a mesh, with the scalar.
    name : str
        Of the scalar.
    scale : Colors
        Such as a `Scale`.
    key : bool
        Show what the colors mean.
    """
    bar: Any = {"title": f"{scale.title}\n", "color": DARK, **SCALAR_BAR}
    plotter.add_mesh(
        surface,
        scalars=name,
        cmap=scale.colors,
        clim=scale.limits,
        scalar_bar_args=bar,
        show_scalar_bar=key,
        name="mesh",
        **CODED_LOOK,
    )


keep_former_names(__name__)
