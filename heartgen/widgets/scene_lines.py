"""Lines of a scene as thin tubes: fibers on the walls, and contours in the slices of a stack."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.fields.catalog import FIBER
from heartgen.mesh.surface_faces import evaluate_faces, field_on_faces
from heartgen.viewing.scene import EDGE_RADIUS, TUBE_SIDES
from heartgen.widgets.scene_parts import placed, rgba

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.widgets.colors import PaintedFaces

Array = NDArray[np.float64]

CONTOUR_RADIUS = 1.5
"""Of the contours, over that of the edges."""

GIVEN = "#8a94a0"
"""Color of contours where a slice was before it was moved."""

OVERLAP = 1.2
"""Length of the pieces of a contour, over what each stands for: they join."""

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
    return placed(_tubes(ends), anatomy)


def both_contours(anatomy: Anatomy, color: str) -> pv.PolyData:
    """Contours of a stack in a color; where slices were moved, also as they were given, in gray.

    Parameters
    ----------
    anatomy : Anatomy
        Of the mask; what is no stack has no contours.
    color : str
        As PyVista takes it.
    """
    shown = _contours(anatomy)
    if anatomy.slices is None:
        return shown
    shown.point_data["rgba"] = rgba(color, np.ones(shown.n_points))
    if anatomy.slices.shifts.any():
        given = _contours(anatomy, given=True)
        given.point_data["rgba"] = rgba(GIVEN, np.ones(given.n_points))
        shown = shown.append_polydata(given)
    return shown


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
    return placed(_tubes(ends.reshape(-1, 3), CONTOUR_RADIUS), anatomy)


def _tubes(ends: Array, thickness: float = 1.0) -> pv.PolyData:
    """Straight pieces between pairs of points (2 n, 3), mm."""
    rows = np.insert(np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1)
    lines = pv.PolyData(ends.astype(np.float32), lines=rows.ravel())
    radius = thickness * EDGE_RADIUS * float(np.ptp(ends, axis=0).max())
    tubes: pv.PolyData = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    return tubes
