"""Smooth contours of a shape in the plane of a slice, and the distance to them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from skimage import measure

from heartgen.images.isosurface import Isosurface
from heartgen.images.levelset import INSIDE, smooth_indicator

FINE = 0.1
"""Step between the points of a contour from which distances are taken, pixels."""

FACING = -0.7
"""Cosine between the normals of a contour's two sides that face each other: 135 degrees."""

NEIGHBORS = 24
"""Points of a contour looked at for one that faces another: all within two pixels, of two lines."""


@dataclass(frozen=True, eq=False)
class Contour:
    """Points on the outline of a shape in a plane.

    Attributes
    ----------
    points : (n, 2) float64
        Pixel indices.
    normals : (n, 2) float64
        Unit normals out of the shape, in the directions of the pixel axes.
    lengths : (n,) float64
        Length of the outline that each point stands for, mm.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    lengths: NDArray[np.float64]


def contour(shape: NDArray[np.bool_], spacing: NDArray[np.float64]) -> Contour:
    """Half-level of the lightly smoothed indicator of a shape, where it crosses the pixel grid.

    Parameters
    ----------
    shape : (nx, ny) bool
        With empty pixels on every side.
    spacing : (2,) float64
        Pixel size, mm.

    Returns
    -------
    Contour
    """
    smooth = smooth_indicator(shape)
    points, lengths = [np.zeros((0, 2))], [np.zeros(0)]
    for line in measure.find_contours(smooth, INSIDE):  # type: ignore[no-untyped-call]
        closed = line[:-1]
        step = np.linalg.norm(np.diff(line, axis=0) * spacing, axis=1)
        points.append(closed)
        lengths.append((step + np.roll(step, 1)) / 2)
    places = np.concatenate(points)
    slope = np.stack(
        [ndi.map_coordinates(np.asarray(g), places.T, order=1) for g in np.gradient(smooth)],
        axis=-1,
    )
    normals = -slope / spacing
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), np.finfo(float).tiny)
    return Contour(places, normals, np.concatenate(lengths))


def planar_distance(
    shape: NDArray[np.bool_],
    spacing: NDArray[np.float64],
    moved: NDArray[np.float64] | tuple[float, float] = (0.0, 0.0),
) -> NDArray[np.float64]:
    """Signed distance of every pixel to the contour of a shape in its plane.

    Parameters
    ----------
    shape : (nx, ny) bool
        Large enough to have a contour.
    spacing : (2,) float64
        Pixel size, mm.
    moved : (2,) float64
        By how much the shape is moved along the axes of the pixels, mm.

    Returns
    -------
    (nx, ny) float64
        mm, negative inside.
    """
    smooth = smooth_indicator(shape)
    points = []
    for line in measure.find_contours(smooth, INSIDE):  # type: ignore[no-untyped-call]
        along = np.arange(len(line))
        fine = np.linspace(0, along[-1], int(np.ceil(along[-1] / FINE)) + 1)
        points.append(np.stack([np.interp(fine, along, line[:, a]) for a in range(2)], -1))
    tree = cKDTree(np.concatenate(points) * spacing)
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in shape.shape), indexing="ij"), -1)
    at = grid - np.asarray(moved) / spacing
    inside = ndi.map_coordinates(smooth, np.moveaxis(at, -1, 0), order=1, mode="nearest") > INSIDE
    far, _ = tree.query((at * spacing).reshape(-1, 2))
    return np.asarray(np.where(inside, -1, 1) * np.reshape(far, shape.shape))


def slits(outline: Isosurface, width: float) -> NDArray[np.bool_]:
    """Which points of contours are sides of a slit in a wall.

    A row of pixels that is missing across a thick wall has sides as long as the wall is thick, and
    no mesh follows them.

    Parameters
    ----------
    outline : Isosurface
        Contours in slices, mm, with n points.
    width : float
        Of a slit, at most, mm.

    Returns
    -------
    (n,) bool
    """
    away, other = cKDTree(outline.points).query(
        outline.points, NEIGHBORS, distance_upper_bound=width
    )
    there = np.isfinite(away)
    other = np.where(there, other, 0)
    ahead = np.sum(
        (outline.points[other] - outline.points[:, None]) * outline.normals[:, None], axis=-1
    )
    facing = np.sum(outline.normals[other] * outline.normals[:, None], axis=-1) < FACING
    return np.asarray((there & facing & (ahead > away / 2)).any(axis=1))
