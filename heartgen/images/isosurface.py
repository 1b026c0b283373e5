"""Triangulated surfaces of level functions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from skimage import measure

from heartgen.images.levelset import LevelSet


@dataclass(frozen=True, eq=False)
class Isosurface:
    """Triangulated surface of the mask, the reference for the fitting error.

    Attributes
    ----------
    points : (n, 3) float64
        Vertices, mm, world (LPS).
    triangles : (t, 3) int
        Vertices of each triangle, counted from 0.
    weights : (n,) float64
        Area that each vertex stands for, mm^2.
    normals : (n, 3) float64
        Unit normals.
    """

    points: NDArray[np.float64]
    triangles: NDArray[np.intp]
    weights: NDArray[np.float64]
    normals: NDArray[np.float64]

    def part(self, keep: NDArray[np.bool_]) -> Isosurface:
        """The vertices (n,) to keep, with the triangles that have all three of theirs.

        Parameters
        ----------
        keep : (n,) bool
            Which vertices.
        """
        number = np.cumsum(keep) - 1
        triangles = number[self.triangles[keep[self.triangles].all(1)]]
        return Isosurface(self.points[keep], triangles, self.weights[keep], self.normals[keep])


def isosurface(myocardium: LevelSet) -> Isosurface:
    """Triangulated zero level of a level function, in the world.

    Parameters
    ----------
    myocardium : LevelSet
        Negative inside.

    Returns
    -------
    Isosurface
    """
    surface = measure.marching_cubes(myocardium.values, 0.0)  # type: ignore[no-untyped-call]
    vertices, triangles = surface[:2]
    affine = myocardium.affine
    points = vertices.astype(float) @ affine[:3, :3].T + affine[:3, 3]
    corners = points[triangles]
    area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    weights = np.bincount(triangles.ravel(), np.repeat(area / 6, 3), len(points)).astype(float)
    _, slope = myocardium.sample(points)
    normals = slope / np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-12)
    return Isosurface(points, triangles.astype(np.intp), weights, normals)
