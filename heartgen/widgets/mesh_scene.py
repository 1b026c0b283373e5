"""What the 3-D view shows, as poly data with a color at every point: no window, no server.

Everything is in the frame of the heart, the apex down, so that the camera means the same for every
heart and stays where the user left it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.errors import HeartgenError
from heartgen.fields import heart_axes
from heartgen.viewing.contours import EDGE_RADIUS, TUBE_SIDES
from heartgen.viewing.inside import inner_grid
from heartgen.viewing.polydata import (
    MAX_TRIANGLES,
    mask_surface,
    mesh_edges,
    mesh_surface,
    to_surface,
)
from heartgen.viewing.scene import DARK, LIGHT, MASK, MASK_OPACITY
from heartgen.viewing.stages import STAGES, Stage, registered, stages_of
from heartgen.widgets.colors import COLORINGS, Painted, PaintedFaces
from heartgen.widgets.scene_cuts import CUT_NORMALS, cut, cut_plane, cut_surface
from heartgen.widgets.scene_lines import both_contours, fibers, fibers_within, segment_numbers
from heartgen.widgets.scene_parts import joined, opaque, placed, rgba
from heartgen.widgets.scene_views import views_of

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.widgets.runs import Outcome

Array = NDArray[np.float64]


FADE = 1.0
"""Distance between mask and mesh from which the mask is shown in full, mm."""

WHOLE_OPACITY = 0.3
"""Opacity of the mask where all of it is shown."""

ALONE_OPACITY = 1.0
"""Opacity of the mask as long as there is no mesh."""

ELEMENT = "element"
"""Array of the points of a surface: the element that each belongs to."""

MEASURED = ("error", "thickness")
"""Arrays of the points of a surface that are told where the pointer is."""

CACHED = 16
"""Surfaces that are kept: the stages of a few runs."""

MASK_VIEWS = {
    "misfit": "Where it differs",
    "whole": "All of it",
    "slices": "Its slices",
    "off": "Hidden",
}
"""The contours are those of a stack; other masks have none."""


LINES = {
    "edges": "Element edges",
    "fibers": "Fibers",
    "depth": "Fibers at a depth",
    "off": "None",
}


@dataclass(frozen=True)
class SceneView:
    """What the user asked to see.

    Attributes
    ----------
    stage, color, mask : str
        Keys of `STAGES`, `COLORINGS`, `MASK_VIEWS`.
    lines : str
        Key of `LINES`.
    cut : str
        Key of `CUTS`.
    position : float
        Of the cut, from 0 to 1 through the heart.
    normal : (float, float, float)
        Of a free cut: towards what is cut away, heart frame.
    depth : float
        Of fibers in the wall, from 0, endocardium, to 1.
    limit : float or None
        End of the error's color scale, mm; None for one that suits the result.
    against : Outcome or None
        With which the mesh is compared.
    """

    stage: str = "optimized"
    color: str = "error"
    mask: str = "misfit"
    lines: str = "edges"
    cut: str = "off"
    position: float = 0.5
    normal: tuple[float, float, float] = (1.0, 0.0, 0.0)
    depth: float = 0.5
    limit: float | None = None
    against: Outcome | None = None


@dataclass(frozen=True, eq=False)
class Probe:
    """What is told of the points of a mesh.

    Attributes
    ----------
    element : (n,) int
        Element of each point of the scene's mesh, from 0.
    quality : (e,) float64
        Jacobian ratio of the elements.
    values : dict of str to (n,) float64
        At the points, nan where nothing is measured.
    """

    element: NDArray[np.intp]
    quality: Array
    values: dict[str, Array]


@dataclass(frozen=True)
class Scene:
    """Surfaces to show, each with colors "rgba" at its points; mm, heart frame.

    Attributes
    ----------
    mesh, edges, mask : PolyData
        Empty where they are not to be seen.
    painted : Painted or None
        How the mesh is colored, for the key.
    frame : (4, 4) float64
        From the scene to the world (LPS), mm.
    views : dict of str to (list, list)
        From where one may look, by name; see `heartgen.widgets.scene_views`.
    probe : Probe or None
        What is told of the mesh's points.
    """

    mesh: pv.PolyData
    edges: pv.PolyData
    mask: pv.PolyData
    painted: Painted | None
    frame: Array
    views: dict[str, Any]
    probe: Probe | None = None


def mask_scene(anatomy: Anatomy) -> Scene:
    """The mask alone, before there is a mesh.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    """
    surface = placed(_mask_of(anatomy).copy(), anatomy)
    opacity = ALONE_OPACITY if anatomy.slices is None else WHOLE_OPACITY
    surface.point_data["rgba"] = rgba(MASK, np.full(surface.n_points, opacity))
    contours = both_contours(anatomy, DARK)
    return Scene(pv.PolyData(), contours, surface, None, anatomy.frame, views_of(anatomy.frame))


def mesh_scene(outcome: Outcome, view: SceneView) -> Scene:
    """A mesh with its edges over the mask.

    Parameters
    ----------
    outcome : Outcome
        Whose mesh is shown.
    view : SceneView
        What of it, and how.

    Returns
    -------
    Scene
    """
    _result, anatomy = outcome.result, outcome.result.anatomy
    keys = [stage.key for stage in _stages(outcome)]
    drawn = _drawn(outcome, view.stage if view.stage in keys else keys[-1])
    if view.lines == "depth":
        mesh, lines, painted = fibers_within(drawn.patch, view.depth)
    else:
        patch = drawn.patch
        if view.against is not None:
            patch = replace(patch, other=view.against.result.mesh)
        painted = COLORINGS[view.color].paint(patch, view.limit)
        mesh = drawn.surface.copy(deep=False)
        mesh.point_data["rgba"] = opaque(painted.rgb)
        lines = _lines(drawn, view.lines, LIGHT if view.color == "error" else DARK)
        if view.color == "segment":
            numbers = segment_numbers(drawn.patch)
            numbers.point_data["rgba"] = rgba(DARK, np.ones(numbers.n_points))
            lines = lines.append_polydata(numbers)
    mask = _mask(drawn, view.mask)
    if view.mask == "slices" and drawn.contours.n_points > 0:
        lines = lines.append_polydata(drawn.contours)
    if view.cut != "off":
        normal = np.array(view.normal if view.cut == "free" else CUT_NORMALS[view.cut], dtype=float)
        plane = cut_plane(drawn.surface, normal / np.linalg.norm(normal), view.position)
        mesh = cut(mesh, plane)
        if view.lines != "depth":
            mesh = joined(mesh, cut_surface(drawn.grid, plane, painted))
        lines, mask = cut(lines, plane), cut(mask, plane)
    probe = _probe(drawn, mesh) if ELEMENT in mesh.point_data else None
    return Scene(mesh, lines, mask, painted, anatomy.frame, _views(outcome), probe)


def stages_moving(outcome: Outcome) -> list[tuple[str, Array, Array]]:
    """The mesh on its way through the stages: name, points of the surface, and of the edges, mm.

    Parameters
    ----------
    outcome : Outcome
        Whose mesh is shown.
    """
    drawn = [(stage.title, _drawn(outcome, stage.key)) for stage in _stages(outcome)]
    return [(title, np.asarray(d.surface.points), np.asarray(d.edges.points)) for title, d in drawn]


def _stages(outcome: Outcome) -> tuple[Stage, ...]:
    """Stages that can be shown: of a result that was kept without its way, the last."""
    result = outcome.result
    return stages_of(result) if result.has_stages else STAGES[-1:]


@lru_cache(CACHED)
def _views(outcome: Outcome) -> dict[str, Any]:
    """Named sides of a heart; of a mesh that is not valid, those that its mask tells."""
    result = outcome.result
    try:
        axes = heart_axes(result.mesh, result.options.septal_direction)
    except HeartgenError:
        return views_of(result.anatomy.frame)
    return views_of(result.anatomy.frame, axes)


def _probe(drawn: _Drawn, mesh: pv.PolyData) -> Probe:
    """What is told of the points of a mesh that may have been cut."""
    element = np.round(np.asarray(mesh.point_data[ELEMENT])).astype(np.intp)
    values = {name: np.asarray(mesh.point_data[name]) for name in MEASURED}
    return Probe(element, drawn.patch.quality, values)


def prepare(outcome: Outcome) -> None:
    """Make what takes long of a mesh's scene, before somebody looks at it.

    Parameters
    ----------
    outcome : Outcome
        The mesh.
    """
    _drawn(outcome, _stages(outcome)[-1].key)
    _views(outcome)


@lru_cache(2)
def _mask_of(anatomy: Anatomy) -> pv.PolyData:
    """The mask's surface, world (LPS): that of all meshes of a heart."""
    return mask_surface(anatomy.myocardium, MAX_TRIANGLES)


@dataclass(frozen=True, eq=False)
class _Drawn:
    """The geometry of one stage of one result, before it is colored and cut."""

    surface: pv.PolyData
    edges: pv.PolyData
    mask: pv.PolyData
    misfit: Array
    contours: pv.PolyData
    grid: pv.UnstructuredGrid
    patch: PaintedFaces


@lru_cache(CACHED)
def _drawn(outcome: Outcome, key: str) -> _Drawn:
    """Surfaces of a stage, and the distance of the mask to it."""
    result, anatomy = outcome.result, outcome.result.anatomy
    stage = next(s for s in STAGES if s.key == key)
    mesh = stage.mesh(result)
    surface, grid = mesh_surface(mesh), inner_grid(mesh)
    lines = mesh_edges(mesh, like=result.mesh)
    if stage.registered:
        for data in (surface, lines, grid):
            data.points = registered(np.asarray(data.points), result).astype(np.float32)
        surface.point_data["Normals"] = mesh_surface(result.warped).point_data["Normals"]
        surface.point_data.active_normals_name = "Normals"
    mask = _mask_of(anatomy).copy()
    misfit = to_surface(np.asarray(mask.points), surface)
    patch = PaintedFaces(result, mesh, np.asarray(surface.points, dtype=float))
    surface.point_data[ELEMENT] = patch.of_faces(mesh.topology.external[:, 0]).astype(np.float32)
    surface.point_data["error"] = patch.error.astype(np.float32)
    thickness = patch.of_field(patch.field("thickness", "wall thickness"))
    surface.point_data["thickness"] = thickness.astype(np.float32)
    radius = EDGE_RADIUS * float(np.ptp(lines.points, axis=0).max())
    edges = placed(lines.tube(radius=radius, n_sides=TUBE_SIDES), anatomy)
    return _Drawn(
        surface=placed(surface, anatomy),
        edges=edges,
        mask=placed(mask, anatomy),
        misfit=misfit,
        contours=both_contours(anatomy, MASK),
        grid=placed(grid, anatomy),
        patch=patch,
    )


def _lines(drawn: _Drawn, kind: str, color: str) -> pv.PolyData:
    """The edges of the elements, or fibers, in one color."""
    if kind == "off":
        return pv.PolyData()
    lines = drawn.edges.copy(deep=False) if kind == "edges" else fibers(drawn.patch)
    lines.point_data["rgba"] = rgba(color, np.ones(lines.n_points))
    return lines


def _mask(drawn: _Drawn, view: str) -> pv.PolyData:
    """The mask's surface in the wanted opacity."""
    if view in ("off", "slices"):
        return pv.PolyData()
    share = np.clip(drawn.misfit / FADE, 0, 1) * MASK_OPACITY
    if view == "whole":
        share = np.full(len(share), WHOLE_OPACITY)
    mask = drawn.mask.copy(deep=False)
    mask.point_data["rgba"] = rgba(MASK, share)
    return mask
