"""Pictures of fields on the surface: coordinates, segments and thickness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.errors import InputError
from heartgen.fields import HeartAxes, heart_axes, make_fields
from heartgen.fields.segments import NO_SEGMENT, SEGMENTS, segments_of_elements
from heartgen.mesh import HexMesh
from heartgen.mesh.surface_faces import evaluate_faces
from heartgen.renamed import keep_former_names, takes_former_keywords
from heartgen.viewing.camera import frame_of, look_at
from heartgen.viewing.polydata import (
    SUBDIVISION,
    mesh_surface,
    on_surface,
)
from heartgen.viewing.scene import CODED_LOOK, DARK, MESH, add_edges, add_scalar_surface
from heartgen.viewing.windows import Window

Array = NDArray[np.float64]

SEGMENT_COLORS = ("#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7")
"""Palette of Okabe and Ito (2008): six around each level, and the apex."""

TURN = (0, 2, 0)
"""Colors by which each level is turned, from the base, so that neighbors differ."""

AROUND = 6
"""Segments around the wall, at the basal and mid levels."""

RAISED = 0.02
"""Height of a number over the surface, over the size of the mesh."""


@dataclass(frozen=True)
class FieldStyle:
    """How a field is shown.

    Attributes
    ----------
    field : str
        Its name.
    of : str
        Name under which `heartgen.fields.make_fields` makes it.
    title : str
        Of the color scale, with the unit.
    colors : str
        A map of matplotlib that the color-blind can read.
    limits : (float, float) or None
        Ends of the scale; those of the field if None.
    """

    field: str
    of: str
    title: str
    colors: str
    limits: tuple[float, float] | None


FIELD_STYLES = {
    "transmural": FieldStyle("transmural", "coordinates", "depth in the wall", "cividis", (0, 1)),
    "longitudinal": FieldStyle("longitudinal", "coordinates", "apex to base", "viridis", (0, 1)),
    "circumferential": FieldStyle(
        "circumferential", "coordinates", "angle from the septum (rad)", "twilight", (-np.pi, np.pi)
    ),
    "thickness": FieldStyle(
        "wall thickness", "thickness", "thickness of the wall (mm)", "viridis", None
    ),
}
"""Scalar fields by the word that asks for them."""


@takes_former_keywords
def plot_field(
    mesh: HexMesh,
    color: str,
    *,
    septal_direction: Sequence[float] | None = None,
    screenshot: str | Path | None = None,
    window_size: tuple[int, int] = (900, 900),
) -> pv.Plotter:
    """Show a field on the surface of a mesh, the apex down.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    color : str
        One of `FIELD_STYLES`, or ``"aha"``.
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, see `heartgen.fields.heart_axes`.
    screenshot : path, optional
        Write a picture there (PNG); otherwise the scene is made, to be shown or changed further.
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
        If a picture is asked for where there is no graphics library.
    """
    if color != "aha" and color not in FIELD_STYLES:
        raise InputError(
            f"coloring {color!r} is not known: choose {', '.join(FIELD_STYLES)} or aha"
        )
    window = Window(True, screenshot, window_size)
    plotter = window.empty()
    axes = heart_axes(mesh, septal_direction)
    if color == "aha":
        add_segments(plotter, mesh, axes)
    else:
        add_scalars(plotter, mesh, FIELD_STYLES[color], septal_direction)
    add_edges(plotter, mesh)
    look_at(plotter, mesh, frame_of(axes))
    return window.shown(plotter)


def segment_color(segment: int) -> str:
    """Color of an AHA segment: neighbors differ, around and from level to level.

    Parameters
    ----------
    segment : int
        1 to 17, or 0 for none.
    """
    if segment == NO_SEGMENT:
        return MESH
    level, place = divmod(segment - 1, AROUND)
    return SEGMENT_COLORS[(place + TURN[level]) % AROUND if segment < max(SEGMENTS) else -1]


def add_scalars(
    plotter: Any,
    mesh: HexMesh,
    look: FieldStyle,
    septal_direction: Sequence[float] | None = None,
    key: bool = True,
) -> None:
    """The surface colored by a scalar field, with the key.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    mesh : HexMesh
        mm, world (LPS).
    look : FieldStyle
        Which field, and how it is shown.
    septal_direction : (3,) float, optional
        Towards the septum, world (LPS), where no right ventricle tells it.
    key : bool
        Show what the colors mean.
    """
    made = {
        field.name: field
        for field in make_fields(mesh, [look.of], septal_direction=septal_direction)
    }
    surface = mesh_surface(mesh)
    values = on_surface(made[look.field], mesh.topology)[:, 0]
    surface.point_data[look.field] = values.astype(np.float32)
    add_scalar_surface(plotter, surface, look.field, look, key)


def add_segments(plotter: Any, mesh: HexMesh, axes: HeartAxes) -> None:
    """The surface colored by the segments of the elements, with their numbers.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    mesh : HexMesh
        mm, world (LPS).
    axes : HeartAxes
        Of the left ventricle.
    """
    surface, faces = mesh_surface(mesh), mesh.topology.external
    segment = segments_of_elements(mesh, axes)[faces[:, 0]]
    colors = np.array([pv.Color(segment_color(int(s))).int_rgb for s in segment])
    surface.cell_data["color"] = np.repeat(colors, SUBDIVISION**2, axis=0).astype(np.uint8)
    plotter.add_mesh(surface, scalars="color", rgb=True, **CODED_LOOK)
    numbers = _numbers(mesh, segments_of_elements(mesh, axes))
    plotter.add_point_labels(
        np.array(list(numbers.values())),
        list(map(str, numbers)),
        font_size=22,
        text_color=DARK,
        shape="rounded_rect",
        shape_color="white",
        shape_opacity=0.7,
        show_points=False,
        always_visible=False,
    )


def _numbers(mesh: HexMesh, segment: NDArray[np.intp]) -> dict[int, Array]:
    """Where over the outside of the wall the number of each segment stands, mm, world (LPS)."""
    return {number: place for number, (place, _) in segment_places(mesh, segment).items()}


def segment_places(mesh: HexMesh, segment: NDArray[np.intp]) -> dict[int, tuple[Array, Array]]:
    """Where over the outside of the wall the number of each segment stands, and the normal there.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    segment : (e,) int
        Of each element.

    Returns
    -------
    dict of int to ((3,) float64, (3,) float64)
        mm, world (LPS), and of unit length.
    """
    topology = mesh.topology
    septum = topology.patches.get("rv_septum", topology.surfaces["epi"][:0])
    faces = np.concatenate([topology.surfaces["epi"], septum])
    middle, area = (a[:, 0] for a in evaluate_faces(mesh, faces, np.full((1, 2), 0.5)))
    height = RAISED * np.linalg.norm(np.ptp(middle, axis=0))
    normal = area / np.linalg.norm(area, axis=1, keepdims=True)
    raised = middle + height * normal
    out = {}
    for number in np.setdiff1d(segment[faces[:, 0]], NO_SEGMENT):
        own = np.flatnonzero(segment[faces[:, 0]] == number)
        best = own[np.argmin(np.linalg.norm(raised[own] - raised[own].mean(0), axis=1))]
        out[int(number)] = raised[best], normal[best]
    return out


keep_former_names(__name__)
