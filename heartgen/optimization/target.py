"""What the mesh is optimized against: the patient's images, and points of their surfaces."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy, Slices
from heartgen.images.isosurface import Isosurface, isosurface
from heartgen.images.levelset import LevelSet
from heartgen.optimization.settings import (
    FROM_CUT,
    INTERPOLATED,
    NEAR_SLICE,
    POINTS,
    SCATTER,
    VOXELS_PER_LENGTH,
)

TRUNCATION_SURFACES = ("base", "apical_rim")
"""Surfaces where the wall is cut; the patient has no points for them."""


@dataclass(frozen=True)
class FitTarget:
    """What the mesh is to meet.

    Attributes
    ----------
    images : mapping of str to LevelSet
        Signed distance for each named surface of the mesh.
    points : mapping of str to Isosurface
        Points of the patient's surfaces away from the cuts, for the named surfaces they belong to:
        about `POINTS` each, chosen by their places in the heart alone.
    voxel : float
        Unit of distance, mm.
    length : float
        Of the ventricle, mm.
    slices : Slices or None
        Where there are data, if the surfaces were interpolated between slices.
    """

    images: Mapping[str, LevelSet]
    points: Mapping[str, Isosurface]
    voxel: float
    length: float
    slices: Slices | None = None

    def confidence(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """How far the images may be believed at points (n, 3), mm, world (LPS): (n,), up to 1.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        if self.slices is None:
            return np.ones(len(points))
        away = self.slices.away(points) / (NEAR_SLICE * self.slices.distance)
        return np.asarray(INTERPOLATED + (1 - INTERPOLATED) * np.exp(-(away**2)))


def fit_target(anatomy: Anatomy) -> FitTarget:
    """Collect images and surface points of an anatomy.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.

    Returns
    -------
    FitTarget
    """
    points = {}
    for name, level in anatomy.surfaces.items():
        if name not in TRUNCATION_SURFACES:
            part = _away_from_cuts(isosurface(level), anatomy)
            weighted = replace(part, weights=_areas(part.normals, level.affine))
            points[name] = _thinned(weighted, anatomy)
            if anatomy.slices is not None:
                contours = _away_from_cuts(anatomy.slices.contours[name], anatomy)
                points[name] = _with_contours(points[name], contours)
    voxel = min(anatomy.voxel, anatomy.length / VOXELS_PER_LENGTH)
    return FitTarget(anatomy.surfaces, points, voxel, anatomy.length, anatomy.slices)


def _away_from_cuts(surface: Isosurface, anatomy: Anatomy) -> Isosurface:
    """The points of a surface that are not beyond a cut nor at its rim."""
    beyond = anatomy.base.surface.height(surface.points)
    if "apical_rim" in anatomy.surfaces:
        beyond = np.maximum(beyond, anatomy.surfaces["apical_rim"].sample(surface.points)[0])
    return surface.part(beyond < -FROM_CUT * anatomy.voxel)


def _with_contours(surface: Isosurface, contours: Isosurface) -> Isosurface:
    """Contours, and with little weight the surface that was interpolated between them."""
    share = INTERPOLATED * contours.weights.sum() / surface.weights.sum()
    return Isosurface(
        np.concatenate([contours.points, surface.points]),
        contours.triangles,
        np.concatenate([contours.weights, share * surface.weights]),
        np.concatenate([contours.normals, surface.normals]),
    )


def _thinned(surface: Isosurface, anatomy: Anatomy) -> Isosurface:
    """Few of the points, whose weights fade out at the borders of the choice."""
    if len(surface.points) <= POINTS:
        return surface
    chance = anatomy.to_heart(surface.points) @ SCATTER / anatomy.voxel % 1
    place = chance * len(surface.points) / POINTS
    chosen = place < 1
    few = surface.part(chosen)
    return replace(few, weights=few.weights * np.sin(np.pi * place[chosen]))


def _areas(normals: NDArray[np.float64], affine: NDArray[np.float64]) -> NDArray[np.float64]:
    """Area (n,) that stands for each crossing of a grid's edges by a surface, mm^2.

    A flat surface of normal n and area A crosses ``A |n . (b x c)| / |a . (b x c)|`` edges along a.
    Unlike the areas of triangles, this does not depend on the order of the grid's axes.
    """
    a, b, c = affine[:3, :3].T
    faces = np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)])
    return np.asarray(abs(np.linalg.det(affine[:3, :3])) / np.abs(normals @ faces.T).sum(1))
