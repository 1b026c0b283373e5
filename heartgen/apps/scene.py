"""What the 3-D view shows, as poly data with a colour at every point: no window, no server.

Everything is in the frame of the heart, the apex down, so that the camera means the same for every
heart and stays where the user left it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.apps.colours import COLOURINGS, Painted, Patch
from heartgen.mesh import HexMesh
from heartgen.viewing.scene import DARK, EDGE_RADIUS, LIGHT, MASK, MASK_OPACITY, TUBE_SIDES
from heartgen.viewing.surfaces import (
    MAX_TRIANGLES,
    SUBDIVISION,
    mask_surface,
    mesh_edges,
    mesh_surface,
)

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.apps.runs import Outcome
    from heartgen.pipeline import Personalization

Array = NDArray[np.float64]
Data = TypeVar("Data", bound=pv.DataSet)

FADE = 1.0
"""Distance between mask and mesh from which the mask is shown in full, mm."""

WHOLE_OPACITY = 0.3
"""Opacity of the mask where all of it is shown."""

ALONE_OPACITY = 1.0
"""Opacity of the mask as long as there is no mesh."""

CACHED = 16
"""Surfaces that are kept: the stages of a few runs."""

MASK_VIEWS = {"misfit": "Where it differs", "whole": "All of it", "off": "Hidden"}

CUTS = {"off": "No cut", "x": "Long axis, 1", "y": "Long axis, 2", "z": "Short axis"}

CUT_NORMALS = {"x": (1, 0, 0), "y": (0, -1, 0), "z": (0, 0, 1)}
"""Of the cuts: towards where the camera stands at first; what lies behind is kept."""


@dataclass(frozen=True)
class Stage:
    """A state of the mesh on its way through the pipeline.

    Attributes
    ----------
    key, title, explanation : str
    mesh : callable
        The mesh of a result at that stage.
    registered : bool
        Show the template's points moved by the deformation, not a mesh of their own.
    """

    key: str
    title: str
    explanation: str
    mesh: Callable[[Personalization], HexMesh]
    registered: bool = False


STAGES = (
    Stage("template", "Template", "An ellipsoid tailored to the heart", lambda r: r.template),
    Stage(
        "registered",
        "Registered",
        "The template's points, moved by the deformation",
        lambda r: r.template,
        registered=True,
    ),
    Stage("warped", "Warped", "The cubic mesh that follows the deformation", lambda r: r.warped),
    Stage("enhanced", "Enhanced", "Straight across the wall", lambda r: r.enhanced),
    Stage("refined", "Refined", "The result", lambda r: r.mesh),
)


def stages_of(result: Personalization) -> tuple[Stage, ...]:
    """Stages that a result went through."""
    skipped = set()
    if not result.options.refine:
        skipped.add("refined")
    if not result.options.enhance:
        skipped.add("enhanced")
    return tuple(stage for stage in STAGES if stage.key not in skipped)


@dataclass(frozen=True)
class View:
    """What the user asked to see.

    Attributes
    ----------
    stage, colour, mask : str
        Keys of `STAGES`, `COLOURINGS`, `MASK_VIEWS`.
    edges : bool
    cut : str
        Key of `CUTS`.
    position : float
        Of the cut, from 0 to 1 through the heart.
    limit : float or None
        End of the error's colour scale, mm; None for one that suits the result.
    """

    stage: str = "refined"
    colour: str = "error"
    mask: str = "misfit"
    edges: bool = True
    cut: str = "off"
    position: float = 0.5
    limit: float | None = None


@dataclass(frozen=True)
class Scene:
    """Surfaces to show, each with colours "rgba" at its points; mm, heart frame.

    Attributes
    ----------
    mesh, edges, mask : PolyData
        Empty where they are not to be seen.
    painted : Painted or None
        How the mesh is coloured, for the key.
    """

    mesh: pv.PolyData
    edges: pv.PolyData
    mask: pv.PolyData
    painted: Painted | None


def mask_scene(anatomy: Anatomy) -> Scene:
    """The mask alone, before there is a mesh."""
    surface = _placed(mask_surface(anatomy.myocardium, MAX_TRIANGLES), anatomy)
    surface.point_data["rgba"] = _rgba(MASK, np.full(surface.n_points, ALONE_OPACITY))
    return Scene(pv.PolyData(), pv.PolyData(), surface, None)


def mesh_scene(outcome: Outcome, view: View) -> Scene:
    """A mesh with its edges over the mask.

    Parameters
    ----------
    outcome : Outcome
    view : View

    Returns
    -------
    Scene
    """
    result = outcome.result
    keys = [stage.key for stage in stages_of(result)]
    drawn = _drawn(outcome, view.stage if view.stage in keys else keys[-1])
    painted = COLOURINGS[view.colour].paint(drawn.patch, view.limit)
    mesh = drawn.surface.copy(deep=False)
    mesh.point_data["rgba"] = _opaque(painted.rgb)
    edges = (
        _edges(drawn, LIGHT if view.colour == "error" else DARK) if view.edges else pv.PolyData()
    )
    mask = _mask(drawn, view.mask)
    if view.cut != "off":
        plane = _plane(drawn, np.array(CUT_NORMALS[view.cut], dtype=float), view.position)
        mesh = _cut(mesh, plane)
        mesh = mesh.append_polydata(_cap(drawn, plane, painted))
        edges, mask = _cut(edges, plane), _cut(mask, plane)
    return Scene(mesh, edges, mask, painted)


@dataclass(frozen=True)
class _Drawn:
    """The geometry of one stage of one result, before it is coloured and cut."""

    surface: pv.PolyData
    edges: pv.PolyData
    mask: pv.PolyData
    misfit: Array
    grid: pv.UnstructuredGrid
    patch: Patch


@lru_cache(CACHED)
def _drawn(outcome: Outcome, key: str) -> _Drawn:
    """Surfaces of a stage, and the distance of the mask to it."""
    result, anatomy = outcome.result, outcome.result.anatomy
    stage = next(s for s in STAGES if s.key == key)
    mesh = stage.mesh(result)
    surface, lines, grid = mesh_surface(mesh), mesh_edges(mesh), _grid(mesh)
    if stage.registered:
        move = result.deformations[-1]
        normals = mesh_surface(result.warped).point_data["Normals"]
        for data in (surface, lines, grid):
            data.points = move(np.asarray(data.points, dtype=float)).astype(np.float32)
        surface.point_data["Normals"] = normals
        surface.point_data.active_normals_name = "Normals"
    mask = mask_surface(anatomy.myocardium, MAX_TRIANGLES)
    triangles = surface.triangulate()
    measured = mask.compute_implicit_distance(triangles)["implicit_distance"]
    patch = Patch(result, mesh, np.asarray(surface.points, dtype=float))
    radius = EDGE_RADIUS * float(np.ptp(lines.points, axis=0).max())
    edges = _placed(lines.tube(radius=radius, n_sides=TUBE_SIDES), anatomy)
    return _Drawn(
        surface=_placed(surface, anatomy),
        edges=edges,
        mask=_placed(mask, anatomy),
        misfit=np.abs(np.asarray(measured, dtype=float)),
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


def _edges(drawn: _Drawn, colour: str) -> pv.PolyData:
    """The edges of the elements in one colour."""
    edges = drawn.edges.copy(deep=False)
    edges.point_data["rgba"] = _rgba(colour, np.ones(edges.n_points))
    return edges


def _mask(drawn: _Drawn, view: str) -> pv.PolyData:
    """The mask's surface in the wanted opacity."""
    if view == "off":
        return pv.PolyData()
    share = np.clip(drawn.misfit / FADE, 0, 1) * MASK_OPACITY
    if view == "whole":
        share = np.full(len(share), WHOLE_OPACITY)
    mask = drawn.mask.copy(deep=False)
    mask.point_data["rgba"] = _rgba(MASK, share)
    return mask


def _grid(mesh: HexMesh) -> pv.UnstructuredGrid:
    """The inside of the mesh in flat pieces, with ``element`` and the depth ``xi3`` of each."""
    n = (SUBDIVISION, SUBDIVISION, 2)
    t = [np.linspace(0, 1, k + 1) for k in n]
    xi = np.stack(np.meshgrid(*t, indexing="ij"), -1).reshape(-1, 3)
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
    cap = drawn.grid.slice(normal=normal, origin=origin)
    if cap.n_cells == 0:
        return pv.PolyData()
    rgb = painted.inside(np.asarray(cap.cell_data["element"], dtype=int))
    cap = pv.PolyData(cap.points, faces=cap.faces)
    corners = cap.cast_to_unstructured_grid()
    sizes = np.diff(corners.cell_offsets)
    flat = cap.points[corners.cell_connectivity]  # no points in common: each face has one colour
    faces = np.insert(np.arange(len(flat)), np.r_[0, np.cumsum(sizes)[:-1]], sizes)
    cap = pv.PolyData(flat, faces=faces)
    cap.point_data["Normals"] = np.tile(normal, (len(flat), 1)).astype(np.float32)
    cap.point_data["rgba"] = _opaque(np.repeat(rgb, sizes, axis=0))
    return cap


def _opaque(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colours (n, 3) with full opacity."""
    return np.concatenate([rgb, np.full((len(rgb), 1), 255, np.uint8)], axis=1)


def _rgba(colour: str, opacity: Array) -> NDArray[np.uint8]:
    """One colour with an opacity of every point."""
    rgba = np.empty((len(opacity), 4), dtype=np.uint8)
    rgba[:, :3] = pv.Color(colour).int_rgb
    rgba[:, 3] = np.round(255 * opacity)
    return rgba
