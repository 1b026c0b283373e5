"""Pictures of fields: coordinates, segments and thickness on the surface, fibres as glyphs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.errors import InputError
from heartgen.fields import FibreRule, HeartAxes, fibre_frames, heart_axes, make_fields
from heartgen.fields.fibres import helix_angle
from heartgen.fields.lines import lines
from heartgen.fields.segments import NO_SEGMENT, SEGMENTS, segments_of_elements
from heartgen.fields.wall import wall_of
from heartgen.mesh import HexMesh, MeshField
from heartgen.mesh.surfaces import evaluate_faces
from heartgen.viewing.scene import (
    DARK,
    MESH,
    SCALAR_BAR,
    SURFACE_LOOK,
    TUBE_SIDES,
    add_edges,
    look_at,
    require_graphics,
)
from heartgen.viewing.surfaces import (
    INWARD,
    SUBDIVISION,
    mesh_surface,
    on_surface,
    poly_data,
)

Array = NDArray[np.float64]

SEGMENT_COLOURS = ("#e69f00", "#56b4e9", "#009e73", "#f0e442", "#0072b2", "#d55e00", "#cc79a7")
"""Palette of Okabe and Ito (2008): six around each level, and the apex."""

TURN = (0, 2, 0)
"""Colours by which each level is turned, from the base, so that neighbours differ."""

AROUND = 6
"""Segments around the wall, at the basal and mid levels."""

RAISED = 0.02
"""Height of a number over the surface, over the size of the mesh."""

GLYPHS = 4
"""Fibres per element edge."""

LENGTH, RADIUS = 0.05, 0.0035
"""Of a fibre, over the size of the mesh."""

DEPTHS = {"endocardium": 0.0, "mid-wall": 0.5, "epicardium": 1.0}
"""Depths across the wall at which fibres are drawn."""


@dataclass(frozen=True)
class Look:
    """How a field is shown.

    Attributes
    ----------
    field : str
        Its name.
    of : str
        Name under which `heartgen.fields.make_fields` makes it.
    title : str
    colours : str
        A map of matplotlib that the colour-blind can read.
    limits : (float, float) or None
        Ends of the scale; those of the field if None.
    """

    field: str
    of: str
    title: str
    colours: str
    limits: tuple[float, float] | None


LOOKS = {
    "transmural": Look("transmural", "coordinates", "depth in the wall", "cividis", (0, 1)),
    "longitudinal": Look("longitudinal", "coordinates", "apex to base", "viridis", (0, 1)),
    "circumferential": Look(
        "circumferential", "coordinates", "angle from the septum (rad)", "twilight", (-np.pi, np.pi)
    ),
    "thickness": Look("wall thickness", "thickness", "thickness of the wall (mm)", "viridis", None),
}
"""Scalar fields by the word that asks for them."""


def plot_field(
    mesh: HexMesh,
    color: str,
    *,
    septum: Sequence[float] | None = None,
    screenshot: str | Path | None = None,
    window_size: tuple[int, int] = (900, 900),
) -> pv.Plotter:
    """Show a field on the surface of a mesh, the apex down.

    Parameters
    ----------
    mesh : HexMesh
    color : str
        One of `LOOKS`, or ``"aha"``.
    septum : (3,) float, optional
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
        If there is no such colouring.
    HeartgenError
        If a picture is asked for where there is no graphics library.
    """
    if color != "aha" and color not in LOOKS:
        raise InputError(f"colouring {color!r} is not known: choose {', '.join(LOOKS)} or aha")
    plotter: Any = empty_scene(window_size)
    axes = heart_axes(mesh, septum)
    if color == "aha":
        add_segments(plotter, mesh, axes)
    else:
        add_scalars(plotter, mesh, LOOKS[color], septum)
    add_edges(plotter, mesh)
    look_at(plotter, mesh, frame_of(axes))
    return finished(plotter, screenshot)


def plot_fibres(
    mesh: HexMesh,
    rule: FibreRule | None = None,
    *,
    screenshot: str | Path | None = None,
    window_size: tuple[int, int] = (1500, 560),
) -> pv.Plotter:
    """Show the fibres on endocardium, mid-wall and epicardium, side by side.

    Parameters
    ----------
    mesh : HexMesh
    rule : FibreRule, optional
    screenshot : path, optional
        Write a picture there (PNG); otherwise the scene is made, to be shown or changed further.
    window_size : (int, int)
        Pixels.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    HeartgenError
        If a picture is asked for where there is no graphics library.
    """
    rule = rule or FibreRule()
    plotter: Any = empty_scene(window_size, shape=(1, len(DEPTHS)), border=False)
    helix = MeshField("helix", helix_angle(wall_of(mesh), rule)[..., None])
    fibre = MeshField("fibre", fibre_frames(mesh, rule)[..., 0])
    limit = float(np.abs(helix.values).max())
    bar: Any = {"title": "helix angle (degrees)\n", "color": DARK, **SCALAR_BAR, "fmt": "%.0f"}
    for column, (name, depth) in enumerate(DEPTHS.items()):
        plotter.subplot(0, column)
        plotter.add_text(name, position=(0.05, 0.92), font_size=11, color=DARK, viewport=True)
        plotter.add_mesh(_sheet(mesh, depth), color=MESH, **SURFACE_LOOK)
        plotter.add_mesh(
            _glyphs(mesh, depth, fibre, helix),
            scalars="helix",
            cmap="viridis",
            clim=(-limit, limit),
            scalar_bar_args=bar,
            show_scalar_bar=column == 1,
            **SURFACE_LOOK,
        )
        look_at(plotter, mesh, frame_of(heart_axes(mesh)))
    return finished(plotter, screenshot)


def segment_colour(segment: int) -> str:
    """Colour of an AHA segment: neighbours differ, around and from level to level."""
    if segment == NO_SEGMENT:
        return MESH
    level, place = divmod(segment - 1, AROUND)
    return SEGMENT_COLOURS[(place + TURN[level]) % AROUND if segment < max(SEGMENTS) else -1]


def empty_scene(window_size: tuple[int, int], **options: Any) -> pv.Plotter:
    """An empty white scene that opens no window."""
    with pv.vtk_verbosity("off"):  # that there is no screen is no news
        plotter: Any = pv.Plotter(off_screen=True, window_size=list(window_size), **options)
    plotter.set_background("white", all_renderers=True)
    return cast("pv.Plotter", plotter)


def finished(plotter: pv.Plotter, screenshot: str | Path | None) -> pv.Plotter:
    """The scene, and its picture if one was asked for."""
    if screenshot is not None:
        require_graphics(plotter)
        plotter.screenshot(filename=screenshot)
    return plotter


def frame_of(axes: HeartAxes) -> Array:
    """Heart to world (4, 4): x to the septum, y to the anterior wall, z to the base."""
    frame = np.eye(4)
    frame[:3, :3] = np.stack([axes.septal, axes.anterior, axes.longitudinal], -1)
    frame[:3, 3] = axes.base
    return frame


def add_scalars(
    plotter: Any,
    mesh: HexMesh,
    look: Look,
    septum: Sequence[float] | None = None,
    key: bool = True,
) -> None:
    """The surface coloured by a scalar field, with the key."""
    made = {field.name: field for field in make_fields(mesh, [look.of], septum=septum)}
    surface = mesh_surface(mesh)
    values = on_surface(made[look.field], mesh.topology)[:, 0]
    surface.point_data[look.field] = values.astype(np.float32)
    bar: Any = {"title": f"{look.title}\n", "color": DARK, **SCALAR_BAR}
    plotter.add_mesh(
        surface,
        scalars=look.field,
        cmap=look.colours,
        clim=look.limits,
        scalar_bar_args=bar,
        show_scalar_bar=key,
        **SURFACE_LOOK,
    )


def add_segments(plotter: Any, mesh: HexMesh, axes: HeartAxes) -> None:
    """The surface coloured by the segments of the elements, with their numbers."""
    surface, faces = mesh_surface(mesh), mesh.topology.external
    segment = segments_of_elements(mesh, axes)[faces[:, 0]]
    colours = np.array([pv.Color(segment_colour(int(s))).int_rgb for s in segment])
    surface.cell_data["colour"] = np.repeat(colours, SUBDIVISION**2, axis=0).astype(np.uint8)
    plotter.add_mesh(surface, scalars="colour", rgb=True, **SURFACE_LOOK)
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
    """Where over the epicardium the number of each segment stands, (3,), mm, world (LPS)."""
    faces = mesh.topology.surfaces["epi"]
    middle, area = (a[:, 0] for a in evaluate_faces(mesh, faces, np.full((1, 2), 0.5)))
    height = RAISED * np.linalg.norm(np.ptp(middle, axis=0))
    raised = middle + height * area / np.linalg.norm(area, axis=1, keepdims=True)
    out = {}
    for number in np.setdiff1d(segment[faces[:, 0]], NO_SEGMENT):
        own = raised[segment[faces[:, 0]] == number]
        out[int(number)] = own[np.argmin(np.linalg.norm(own - own.mean(0), axis=1))]
    return out


def _within(mesh: HexMesh, depth: float) -> tuple[NDArray[np.intp], Array]:
    """Elements (n,) that a sheet at a depth crosses, and xi3 (n,) where it does."""
    elements, places = [], []
    for line in lines(mesh.topology, 2):
        layer = min(int(depth * len(line)), len(line) - 1)
        elements.append(line[layer])
        places.append(depth * len(line) - layer)
    return np.array(elements), np.array(places)


def _on_sheet(mesh: HexMesh, depth: float, uv: Array, *fields: MeshField) -> list[Array]:
    """Places, tangents along xi1 and xi2, and values of fields at (n, q) points of a sheet."""
    elements, level = _within(mesh, depth)
    shape = (len(elements), len(uv))
    out = [np.empty((*shape, 3)) for _ in range(3)]
    out += [np.empty((*shape, field.components)) for field in fields]
    for xi3 in np.unique(level):
        xi = np.column_stack([uv, np.full(len(uv), xi3)])
        on = level == xi3
        values = [mesh.evaluate(xi), *np.moveaxis(mesh.gradient(xi)[..., :2], -1, 0)]
        values += [field.evaluate(xi) for field in fields]
        for each, value in zip(out, values, strict=True):
            each[on] = value[elements[on]]
    return out


def _sheet(mesh: HexMesh, depth: float) -> pv.PolyData:
    """Surface at a depth in the wall."""
    t = np.linspace(0, 1, SUBDIVISION + 1)
    v, u = np.meshgrid(t, t, indexing="ij")
    points = _on_sheet(mesh, depth, np.stack([u.ravel(), v.ravel()], -1))[0]
    inside = np.clip(np.stack([u.ravel(), v.ravel()], -1), INWARD, 1 - INWARD)
    _, one, two = _on_sheet(mesh, depth, inside)
    normals = np.cross(one, two)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    grid = np.arange(u.size).reshape(u.shape)
    quad = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], -1).reshape(-1, 4)
    quads = (quad + u.size * np.arange(len(points))[:, None, None]).reshape(-1, 4)
    return poly_data(points.reshape(-1, 3), quads, normals.reshape(-1, 3))


def _glyphs(mesh: HexMesh, depth: float, fibre: MeshField, helix: MeshField) -> pv.PolyData:
    """Short tubes along the fibres at a depth, on the outer side of its sheet."""
    t = (np.arange(GLYPHS) + 0.5) / GLYPHS
    v, u = np.meshgrid(t, t, indexing="ij")
    uv = np.stack([u.ravel(), v.ravel()], -1)
    values = [a.reshape(-1, a.shape[-1]) for a in _on_sheet(mesh, depth, uv, fibre, helix)]
    places, one, two, direction, angle = values
    size = float(np.ptp(places, axis=0).max())
    normal = np.cross(one, two)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    places = places + 2 * RADIUS * size * normal
    room = np.linalg.norm(one, axis=1) / GLYPHS  # fewer around the apex, where they would cross
    kept = (room > LENGTH * size / 4) | (np.arange(len(places)) % GLYPHS == 0)
    half = LENGTH * size / 2 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    ends = np.stack([places - half, places + half], 1)[kept].reshape(-1, 3)
    rows = np.column_stack([np.full(kept.sum(), 2), np.arange(2 * kept.sum()).reshape(-1, 2)])
    segments = pv.PolyData(ends, lines=rows.ravel())
    segments.cell_data["helix"] = angle[kept, 0]
    tubes: pv.PolyData = segments.tube(radius=RADIUS * size, n_sides=TUBE_SIDES)
    return tubes
