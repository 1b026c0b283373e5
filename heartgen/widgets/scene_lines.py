"""Lines of a scene as thin tubes: fibers on the walls, and contours in the slices of a stack."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.fields import heart_axes
from heartgen.fields.catalog import FIBER
from heartgen.fields.segments import segments_of_elements
from heartgen.mesh.surface_faces import evaluate_faces, field_on_faces
from heartgen.viewing.contours import contour_tubes, tubes_between
from heartgen.viewing.fiber_glyphs import fiber_sheet, fiber_tubes
from heartgen.viewing.fields import segment_places
from heartgen.viewing.scene import MESH, Scale
from heartgen.widgets.colors import Painted, PaintedFaces, scaled
from heartgen.widgets.scene_parts import opaque, placed, rgba

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy

Array = NDArray[np.float64]

GIVEN = "#8a94a0"
"""Color of contours where a slice was before it was moved."""

NUMBER = 0.055
"""Height of the numbers of segments, over the size of the mesh."""

UPRIGHT = 0.2
"""Part of the long axis within the surface from which a number stands upright along it."""

FIBERS = 5
"""Pieces of fibers along each side of a face."""

FIBER_LENGTH = 0.85
"""Of a piece, over the distance between two."""


def fibers(patch: PaintedFaces) -> pv.PolyData:
    """Short pieces of fibers on the endo- and epicardium, heart frame.

    Parameters
    ----------
    patch : PaintedFaces
        The surface of a mesh.
    """
    mesh, anatomy = patch.mesh, patch.result.anatomy
    surfaces = mesh.topology.surfaces
    faces = np.concatenate([part for name, part in surfaces.items() if name != "base"])
    t = (np.arange(FIBERS) + 0.5) / FIBERS
    uv = np.stack(np.meshgrid(t, t), -1).reshape(-1, 2)
    points, area = evaluate_faces(mesh, faces, uv)
    along = field_on_faces(patch.field("fibers", FIBER), faces, uv)
    along /= np.linalg.norm(along, axis=-1, keepdims=True)
    half = FIBER_LENGTH / 2 * np.sqrt(np.linalg.norm(area, axis=-1, keepdims=True)) / FIBERS
    ends = np.stack([points - half * along, points + half * along], axis=-2).reshape(-1, 3)
    return placed(tubes_between(ends), anatomy)


def fibers_within(patch: PaintedFaces, depth: float) -> tuple[pv.PolyData, pv.PolyData, Painted]:
    """A sheet in the wall and the fibers on it, colored by the helix angle, heart frame.

    Parameters
    ----------
    patch : PaintedFaces
        The surface of a mesh.
    depth : float
        From 0, endocardium, to 1, epicardium.
    """
    mesh, anatomy = patch.mesh, patch.result.anatomy
    sheet = placed(fiber_sheet(mesh, depth), anatomy)
    sheet.point_data["rgba"] = rgba(MESH, np.ones(sheet.n_points))
    tubes, limit = fiber_tubes(mesh, depth)
    scale = Scale("helix angle (degrees)", "viridis", (-limit, limit))
    painted = scaled(np.asarray(tubes.point_data["helix"]), scale)
    tubes.point_data["rgba"] = opaque(painted.rgb)
    return sheet, placed(tubes, anatomy), painted


def both_contours(anatomy: Anatomy, color: str) -> pv.PolyData:
    """Contours of a stack in a color; where slices were moved, also as they were given, in gray.

    Parameters
    ----------
    anatomy : Anatomy
        Of the mask; what is no stack has no contours.
    color : str
        As PyVista takes it.
    """
    if anatomy.slices is None:
        return pv.PolyData()
    shown = placed(contour_tubes(anatomy), anatomy)
    shown.point_data["rgba"] = rgba(color, np.ones(shown.n_points))
    if anatomy.slices.shifts.any():
        given = placed(contour_tubes(anatomy, given=True), anatomy)
        given.point_data["rgba"] = rgba(GIVEN, np.ones(given.n_points))
        shown = shown.append_polydata(given)
    return shown


def segment_numbers(patch: PaintedFaces) -> pv.PolyData:
    """The numbers of the AHA segments on the outside of the wall, upright, heart frame.

    Parameters
    ----------
    patch : PaintedFaces
        The surface of a mesh.
    """
    mesh = patch.mesh
    axes = heart_axes(mesh, patch.result.options.septal_direction)
    size = NUMBER * float(np.ptp(patch.points, axis=0).max())
    drawn = pv.PolyData()
    for number, (place, normal) in segment_places(mesh, segments_of_elements(mesh, axes)).items():
        up = axes.longitudinal - (axes.longitudinal @ normal) * normal
        if np.linalg.norm(up) < UPRIGHT:  # the apex is seen from below, the front above
            up = axes.anterior - (axes.anterior @ normal) * normal
        up /= np.linalg.norm(up)
        # Read from outside: against the normal, with `up` above, the right is this way.
        right = np.cross(up, normal)
        text: Any = pv.Text3D(str(number), depth=0.0, height=size, normal=(0, 0, 1))
        flat = np.asarray(text.points, dtype=float)
        flat -= flat.mean(0)
        text.points = (place + flat @ np.stack([right, up, normal])).astype(np.float32)
        piece = pv.PolyData(text.points, faces=text.triangulate().faces)
        piece.point_data["Normals"] = np.tile(normal, (len(flat), 1)).astype(np.float32)
        drawn = drawn.append_polydata(piece)
    drawn.point_data.active_normals_name = "Normals"
    return placed(drawn, patch.result.anatomy)
