"""What the 3-D view shows, as poly data with a color at every point: no window, no server.

Everything is in the frame of the heart, the apex down, so that the camera means the same for every
heart and stays where the user left it.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.fields.catalog import FIBER
from heartgen.mesh import HexMesh
from heartgen.mesh.surface_faces import evaluate_faces, field_on_faces
from heartgen.viewing.polydata import (
    MAX_TRIANGLES,
    SUBDIVISION,
    mask_surface,
    mesh_edges,
    mesh_surface,
    to_surface,
)
from heartgen.viewing.scene import DARK, EDGE_RADIUS, LIGHT, MASK, MASK_OPACITY, TUBE_SIDES
from heartgen.viewing.stages import STAGES, registered, stages_of
from heartgen.widgets.colors import COLORINGS, Painted, PaintedFaces

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.widgets.runs import Outcome

Array = NDArray[np.float64]
Data = TypeVar("Data", bound=pv.DataSet)

PIECES = (SUBDIVISION, SUBDIVISION, 2)
"""Flat pieces of an element, where it is cut open, along xi1, xi2 and xi3."""

FADE = 1.0
"""Distance between mask and mesh from which the mask is shown in full, mm."""

WHOLE_OPACITY = 0.3
"""Opacity of the mask where all of it is shown."""

ALONE_OPACITY = 1.0
"""Opacity of the mask as long as there is no mesh."""

CACHED = 16
"""Surfaces that are kept: the stages of a few runs."""

MASK_VIEWS = {
    "misfit": "Where it differs",
    "whole": "All of it",
    "slices": "Its slices",
    "off": "Hidden",
}
"""The contours are those of a stack; other masks have none."""

CONTOUR_RADIUS = 1.5
"""Of the contours, over that of the edges."""

GIVEN = "#8a94a0"
"""Color of contours where a slice was before it was moved."""

OVERLAP = 1.2
"""Length of the pieces of a contour, over what each stands for: they join."""

LINES = {"edges": "Element edges", "fibers": "Fibers", "off": "None"}

FIBERS = 5
"""Pieces of fibers along each side of a face."""

FIBER_LENGTH = 0.85
"""Of a piece, over the distance between two."""

CUTS = {"off": "No cut", "x": "Long axis, 1", "y": "Long axis, 2", "z": "Short axis"}

CUT_NORMALS = {"x": (1, 0, 0), "y": (0, -1, 0), "z": (0, 0, 1)}
"""Of the cuts: towards where the camera stands at first; what lies behind is kept."""


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
    limit : float or None
        End of the error's color scale, mm; None for one that suits the result.
    """

    stage: str = "optimized"
    color: str = "error"
    mask: str = "misfit"
    lines: str = "edges"
    cut: str = "off"
    position: float = 0.5
    limit: float | None = None


@dataclass(frozen=True)
class Scene:
    """Surfaces to show, each with colors "rgba" at its points; mm, heart frame.

    Attributes
    ----------
    mesh, edges, mask : PolyData
        Empty where they are not to be seen.
    painted : Painted or None
        How the mesh is colored, for the key.
    """

    mesh: pv.PolyData
    edges: pv.PolyData
    mask: pv.PolyData
    painted: Painted | None


def mask_scene(anatomy: Anatomy) -> Scene:
    """The mask alone, before there is a mesh.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    """
    surface = _placed(mask_surface(anatomy.myocardium, MAX_TRIANGLES), anatomy)
    opacity = ALONE_OPACITY if anatomy.slices is None else WHOLE_OPACITY
    surface.point_data["rgba"] = _rgba(MASK, np.full(surface.n_points, opacity))
    return Scene(pv.PolyData(), _both_contours(anatomy, DARK), surface, None)


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
    result = outcome.result
    keys = [stage.key for stage in stages_of(result)]
    drawn = _drawn(outcome, view.stage if view.stage in keys else keys[-1])
    painted = COLORINGS[view.color].paint(drawn.patch, view.limit)
    mesh = drawn.surface.copy(deep=False)
    mesh.point_data["rgba"] = _opaque(painted.rgb)
    lines = _lines(drawn, view.lines, LIGHT if view.color == "error" else DARK)
    mask = _mask(drawn, view.mask)
    if view.mask == "slices" and drawn.contours.n_points > 0:
        lines = lines.append_polydata(drawn.contours)
    if view.cut != "off":
        plane = _plane(drawn, np.array(CUT_NORMALS[view.cut], dtype=float), view.position)
        mesh = _cut(mesh, plane)
        mesh = mesh.append_polydata(_cap(drawn, plane, painted))
        lines, mask = _cut(lines, plane), _cut(mask, plane)
    return Scene(mesh, lines, mask, painted)


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
    surface, lines, grid = mesh_surface(mesh), mesh_edges(mesh), _grid(mesh)
    if stage.registered:
        for data in (surface, lines, grid):
            data.points = registered(np.asarray(data.points), result).astype(np.float32)
        surface.point_data["Normals"] = mesh_surface(result.warped).point_data["Normals"]
        surface.point_data.active_normals_name = "Normals"
    mask = mask_surface(anatomy.myocardium, MAX_TRIANGLES)
    misfit = to_surface(np.asarray(mask.points), surface)
    patch = PaintedFaces(result, mesh, np.asarray(surface.points, dtype=float))
    radius = EDGE_RADIUS * float(np.ptp(lines.points, axis=0).max())
    edges = _placed(lines.tube(radius=radius, n_sides=TUBE_SIDES), anatomy)
    return _Drawn(
        surface=_placed(surface, anatomy),
        edges=edges,
        mask=_placed(mask, anatomy),
        misfit=misfit,
        contours=_both_contours(anatomy, MASK),
        grid=_placed(grid, anatomy),
        patch=patch,
    )


def _placed(data: Data, anatomy: Anatomy) -> Data:
    """Points and normals in the frame of the heart."""
    data.points = anatomy.to_heart(np.asarray(data.points, dtype=float)).astype(np.float32)
    if "Normals" in data.point_data:
        turned = np.asarray(data.point_data["Normals"]) @ anatomy.frame[:3, :3]
        data.point_data["Normals"] = turned.astype(np.float32)
    return data


def _lines(drawn: _Drawn, kind: str, color: str) -> pv.PolyData:
    """The edges of the elements, or fibers, in one color."""
    if kind == "off":
        return pv.PolyData()
    lines = drawn.edges.copy(deep=False) if kind == "edges" else _fibers(drawn)
    lines.point_data["rgba"] = _rgba(color, np.ones(lines.n_points))
    return lines


def _fibers(drawn: _Drawn) -> pv.PolyData:
    """Short pieces of fibers on the endo- and epicardium, heart frame."""
    mesh, anatomy = drawn.patch.mesh, drawn.patch.result.anatomy
    surfaces = mesh.topology.surfaces
    faces = np.concatenate([part for name, part in surfaces.items() if name != "base"])
    t = (np.arange(FIBERS) + 0.5) / FIBERS
    uv = np.stack(np.meshgrid(t, t), -1).reshape(-1, 2)
    points, area = evaluate_faces(mesh, faces, uv)
    along = field_on_faces(drawn.patch.field("fibers", FIBER), faces, uv)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    half = FIBER_LENGTH / 2 * np.sqrt(np.linalg.norm(area, axis=-1, keepdims=True)) / FIBERS
    ends = np.stack([points - half * along, points + half * along], axis=-2).reshape(-1, 3)
    return _placed(_tubes(ends), anatomy)


def _contours(anatomy: Anatomy, given: bool = False) -> pv.PolyData:
    """What the slices of a stack show of the wall, in pieces of contours, heart frame.

    They are where the slices were moved, or, if `given`, where they were before.
    """
    if anatomy.slices is None:
        return pv.PolyData()
    outline = anatomy.slices.given if given else anatomy.slices.outline
    along = np.cross(anatomy.slices.normal, outline.normals)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    half = OVERLAP / 2 * (outline.weights / anatomy.slices.distance)[:, None]
    ends = np.stack([outline.points - half * along, outline.points + half * along], axis=1)
    tubes = _tubes(ends.reshape(-1, 3), CONTOUR_RADIUS)
    return _placed(tubes, anatomy)


def _both_contours(anatomy: Anatomy, color: str) -> pv.PolyData:
    """Contours in a color; where slices were moved, also as they were given, in gray."""
    shown = _contours(anatomy)
    if anatomy.slices is None:
        return shown
    shown.point_data["rgba"] = _rgba(color, np.ones(shown.n_points))
    if anatomy.slices.shifts.any():
        given = _contours(anatomy, given=True)
        given.point_data["rgba"] = _rgba(GIVEN, np.ones(given.n_points))
        shown = shown.append_polydata(given)
    return shown


def _tubes(ends: Array, thickness: float = 1.0) -> pv.PolyData:
    """Straight pieces between pairs of points (2 n, 3), mm."""
    rows = np.insert(np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1)
    lines = pv.PolyData(ends.astype(np.float32), lines=rows.ravel())
    radius = thickness * EDGE_RADIUS * float(np.ptp(ends, axis=0).max())
    tubes: pv.PolyData = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    return tubes


def _mask(drawn: _Drawn, view: str) -> pv.PolyData:
    """The mask's surface in the wanted opacity."""
    if view in ("off", "slices"):
        return pv.PolyData()
    share = np.clip(drawn.misfit / FADE, 0, 1) * MASK_OPACITY
    if view == "whole":
        share = np.full(len(share), WHOLE_OPACITY)
    mask = drawn.mask.copy(deep=False)
    mask.point_data["rgba"] = _rgba(MASK, share)
    return mask


def _grid(mesh: HexMesh) -> pv.UnstructuredGrid:
    """The inside of the mesh in flat pieces, with ``element`` and the depth ``xi3`` of each."""
    n, xi = PIECES, _inside()
    points = mesh.evaluate(xi)
    place = np.arange(len(xi)).reshape([k + 1 for k in n])
    corners = [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ]
    cells = np.stack(
        [place[a : a + n[0], b : b + n[1], c : c + n[2]].ravel() for a, b, c in corners], -1
    )
    shift = np.arange(mesh.n_elements)[:, None, None] * len(xi)
    cells = (cells[None] + shift).reshape(-1, 8)
    grid = pv.UnstructuredGrid({pv.CellType.HEXAHEDRON: cells}, points.reshape(-1, 3))
    grid.cell_data["element"] = np.repeat(np.arange(mesh.n_elements), np.prod(n))
    return grid


def _inside() -> Array:
    """Local coordinates (q, 3) of the corners of the pieces of an element."""
    t = [np.linspace(0, 1, k + 1) for k in PIECES]
    return np.stack(np.meshgrid(*t, indexing="ij"), -1).reshape(-1, 3)


def _plane(drawn: _Drawn, normal: Array, position: float) -> tuple[Array, Array]:
    """Origin and normal of a cut through the heart."""
    axis = int(np.argmax(np.abs(normal)))
    low, high = np.array(drawn.surface.bounds).reshape(3, 2).T
    origin = (low + high) / 2
    origin[axis] = low[axis] + position * (high[axis] - low[axis])
    return origin, normal


def _cut(data: pv.PolyData, plane: tuple[Array, Array]) -> pv.PolyData:
    """What lies behind the plane."""
    if data.n_points == 0:
        return data
    origin, normal = plane
    return data.clip(normal=normal, origin=origin)


def _cap(drawn: _Drawn, plane: tuple[Array, Array], painted: Painted) -> pv.PolyData:
    """The wall where it is cut."""
    origin, normal = plane
    grid = drawn.grid.copy(deep=False)
    if painted.field is not None:
        grid.point_data["value"] = painted.field.evaluate(_inside())[..., 0].ravel()
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
    cap.point_data["rgba"] = _opaque(rgb)
    return cap


def _opaque(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colors (n, 3) with full opacity."""
    return np.concatenate([rgb, np.full((len(rgb), 1), 255, np.uint8)], axis=1)


def _rgba(color: str, opacity: Array) -> NDArray[np.uint8]:
    """One color with an opacity of every point."""
    rgba = np.empty((len(opacity), 4), dtype=np.uint8)
    rgba[:, :3] = pv.Color(color).int_rgb
    rgba[:, 3] = np.round(255 * opacity)
    return rgba
