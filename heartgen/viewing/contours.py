"""Contours in the slices of a stack, as thin tubes: what the mesh of a stack is fitted to."""

from __future__ import annotations

import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen.anatomy import Anatomy
from heartgen.anatomy.heart_shape import Slices
from heartgen.images.isosurface import Isosurface

EDGE_RADIUS = 0.0025
"""Radius of the tubes that show element edges, over the size of the mesh."""

CONTOUR_RADIUS = 1.5
"""Of the contours, over that of the edges."""

TUBE_SIDES = 6

OVERLAP = 1.2
"""Length of the pieces of a contour, over what each stands for: they join."""

WITHIN = 1e-3
"""Distance from the plane of a slice up to which a point belongs to it, mm: numerical noise."""


def contour_tubes(anatomy: Anatomy, given: bool = False) -> pv.PolyData:
    """What the slices of a stack show of the wall, in pieces of contours.

    Parameters
    ----------
    anatomy : Anatomy
        Of the mask; what is no stack has no contours.
    given : bool
        Where the slices were before they were aligned; otherwise where they were moved.

    Returns
    -------
    PolyData
        mm, world (LPS); empty if it is no stack.
    """
    if anatomy.slices is None:
        return pv.PolyData()
    outline = anatomy.slices.given if given else anatomy.slices.outline
    along = _along(outline, anatomy.slices)
    half = OVERLAP / 2 * (outline.weights / anatomy.slices.distance)[:, None]
    ends = np.stack([outline.points - half * along, outline.points + half * along], axis=1)
    return tubes_between(ends.reshape(-1, 3), CONTOUR_RADIUS)


def _along(outline: Isosurface, slices: Slices) -> NDArray[np.float64]:
    """Directions (n, 3) of contours: in their slices, or, of further views, to the next point."""
    along = np.cross(slices.normal, outline.normals)
    views = slices.away(outline.points) > WITHIN
    if views.sum() > 1:
        points = outline.points[views]
        near = np.asarray(cKDTree(points).query(points, k=2)[1])
        along[views] = points[near[:, 1]] - points[near[:, 0]]
    length = np.linalg.norm(along, axis=1, keepdims=True)
    return np.asarray(along / np.maximum(length, np.finfo(float).tiny))


def tubes_between(ends: NDArray[np.float64], thickness: float = 1.0) -> pv.PolyData:
    """Straight tubes between pairs of points.

    Parameters
    ----------
    ends : (2 n, 3) float64
        Pairs, mm.
    thickness : float
        Over that of element edges.
    """
    rows = np.insert(np.arange(len(ends)).reshape(-1, 2), 0, 2, axis=1)
    lines = pv.PolyData(ends.astype(np.float32), lines=rows.ravel())
    radius = thickness * EDGE_RADIUS * float(np.ptp(ends, axis=0).max())
    tubes: pv.PolyData = lines.tube(radius=radius, n_sides=TUBE_SIDES)
    return tubes
