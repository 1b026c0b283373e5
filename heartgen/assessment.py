"""How good is the mesh: fitting error, element quality, validity (paper, sections 3.2 and 3.5)."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen.images.isosurface import Isosurface, isosurface
from heartgen.images.levelset import LevelSet
from heartgen.mesh.biventricular_topology import right_apex
from heartgen.mesh.closest import closest_points
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import determinants, jacobian_ratio, scaled_jacobian, volume
from heartgen.mesh.quadrature import gauss_cube
from heartgen.mesh.surface_faces import sample_faces
from heartgen.mesh.validity import certify

QUALITY_THRESHOLD = 0.33
"""Least mean Jacobian ratio of a successful mesh (paper, section 3.2)."""

GAUSS_TOLD = (2, 3, 4)
"""Gauss points per direction for which the mean Jacobian ratio is told."""

REVERSE_SAMPLES = 8
"""Samples per face and direction for the distance from mesh to mask."""

OVERLAP_GAUSS = (10, 10, 8)
"""Points per element for the overlap with the mask."""


@dataclass(frozen=True)
class Accuracy:
    """Distances between mesh and mask, mm.

    Attributes
    ----------
    mean, p95, max : float
        From the mask's surface to the mesh's external surface, area-weighted (equation 3.2): from
        the 0.5 isosurface of the mask smoothed by 0.7 voxels, which has no steps; of a stack, from
        the contours in its slices, weighted by length.
    reverse_mean, reverse_p95 : float
        From the mesh's external surface to the isosurface.
    symmetric_mean : float
        Mean of both directions.
    by_surface : dict of str to float
        Mean error of the isosurface's points nearest to each named surface, and to the lowest row
        of the right ventricle's endocardium, its apex.
    dice : float
        Overlap of mesh and mask.
    as_given : float or None
        Mean of a stack whose slices were moved: from the contours where they were given.
    raw_mean : float or None
        Mean from the 0.5 isosurface of the mask as it is, steps and all, as in the paper; None
        of a stack.
    """

    mean: float
    p95: float
    max: float
    reverse_mean: float
    reverse_p95: float
    symmetric_mean: float
    by_surface: dict[str, float]
    dice: float
    as_given: float | None = None
    raw_mean: float | None = None


@dataclass(frozen=True)
class Quality:
    """Quality of the elements.

    Attributes
    ----------
    mean, min : float
        Jacobian ratio (equation 3.1) at 4 x 4 x 4 Gauss points.
    below_threshold : float
        Share of elements below 0.33.
    apical_row : float
        Mean Jacobian ratio of the elements at the apex.
    scaled_mean, scaled_min : float
        Scaled Jacobian: low where elements are sheared.
    valid : bool
        det J is proven positive everywhere but on the pole itself, and no two walls cross.
    invalid_elements : int
        Elements in which det J is not proven positive.
    overlapping_elements : int
        Elements of walls that cross.
    by_gauss : dict of str to float
        Mean Jacobian ratio by the number of Gauss points along a direction: it falls with it, and
        the paper does not tell its own.
    """

    mean: float
    min: float
    below_threshold: float
    apical_row: float
    scaled_mean: float
    scaled_min: float
    valid: bool
    invalid_elements: int
    overlapping_elements: int
    by_gauss: dict[str, float]

    @property
    def faults(self) -> str:
        """What keeps the mesh from being valid, in words; empty if nothing does."""
        folds, crosses = self.invalid_elements, self.overlapping_elements
        texts = {
            "1 element folds" if folds == 1 else f"{folds} elements fold": folds,
            f"walls cross in {crosses} element{'' if crosses == 1 else 's'}": crosses,
        }
        return " and ".join(text for text, number in texts.items() if number)


def assess_quality(mesh: HexMesh) -> Quality:
    """Measure the quality and prove the validity of a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    Quality
    """
    ratio = jacobian_ratio(mesh)
    scaled = scaled_jacobian(mesh)
    certificate = certify(mesh)
    return Quality(
        mean=float(ratio.mean()),
        min=float(ratio.min()),
        below_threshold=float(np.mean(ratio < QUALITY_THRESHOLD)),
        apical_row=float(ratio[mesh.topology.index[:, 2] == 0].mean()),
        scaled_mean=float(scaled.mean()),
        scaled_min=float(scaled.min()),
        valid=certificate.all_valid,
        invalid_elements=int(np.sum(~certificate.positive)),
        overlapping_elements=int(np.sum(certificate.overlapping)),
        by_gauss={str(n): float(jacobian_ratio(mesh, n).mean()) for n in GAUSS_TOLD},
    )


def assess_accuracy(
    mesh: HexMesh,
    myocardium: LevelSet,
    wall_volume: float,
    outline: Isosurface | None = None,
    given: Isosurface | None = None,
    raw: LevelSet | None = None,
) -> Accuracy:
    """Measure the distances between a mesh and the mask it was fitted to.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    myocardium : LevelSet
        Level function of the wall, zero on its surface.
    wall_volume : float
        Volume of the mask, mm^3.
    outline : Isosurface, optional
        Contours in the slices of a stack, where only these are data. They take the place of the
        isosurface, but for the reverse distances and the overlap: there what was interpolated
        counts as well.
    given : Isosurface, optional
        The contours where the slices were given, if they were moved.
    raw : LevelSet, optional
        The level function of the mask that was not smoothed.

    Returns
    -------
    Accuracy
    """
    surface = isosurface(myocardium)
    target = surface if outline is None else outline
    faces = mesh.topology.external
    nearest = closest_points(mesh, faces, target.points)
    names = np.repeat(
        list(mesh.topology.surfaces), [len(f) for f in mesh.topology.surfaces.values()]
    )
    hit = names[nearest.face]
    points, _, area = sample_faces(mesh, faces, REVERSE_SAMPLES)
    back = distance_to(surface, points)
    mean = _mean(nearest.distance, target.weights)
    reverse = _mean(back, area)
    return Accuracy(
        mean=mean,
        p95=_percentile(nearest.distance, target.weights, 95),
        max=float(nearest.distance.max()),
        reverse_mean=reverse,
        reverse_p95=_percentile(back, area, 95),
        symmetric_mean=(mean + reverse) / 2,
        by_surface={
            name: _mean(nearest.distance[part], target.weights[part])
            for name, part in _parts(mesh, faces[nearest.face], hit).items()
            if np.any(part)
        },
        dice=_dice(mesh, myocardium, wall_volume),
        as_given=None if given is None else mean_error(mesh, given),
        raw_mean=None if raw is None else mean_error(mesh, isosurface(raw)),
    )


def mean_error(mesh: HexMesh, surface: Isosurface) -> float:
    """Mean distance from a patient's surface to the mesh's (equation 3.2).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    surface : Isosurface
        The patient's, mm, world (LPS).

    Returns
    -------
    float
        mm.
    """
    found = closest_points(mesh, mesh.topology.external, surface.points)
    return _mean(found.distance, surface.weights)


def _parts(
    mesh: HexMesh, faces: NDArray[np.intp], names: NDArray[np.str_]
) -> dict[str, NDArray[np.bool_]]:
    """Which points (n,), each nearest to a face of a named surface, belong to which part."""
    parts = {name: names == name for name in mesh.topology.surfaces}
    if "rv_endo" in parts:
        lowest = np.isin(faces[:, 0], right_apex(mesh.topology))
        parts["rv_apex"] = parts["rv_endo"] & lowest
    return parts


def distance_to(target: Isosurface, points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance to an isosurface: to the nearest vertex's tangent plane where that is close.

    Parameters
    ----------
    target : Isosurface
        mm, world (LPS).
    points : (n, 3) float64
        mm, world (LPS).

    Returns
    -------
    (n,) float64, mm
    """
    far, nearest = cKDTree(target.points).query(points, workers=nb.get_num_threads())
    reach = np.sqrt(np.median(target.weights))
    offset = points - target.points[nearest]
    along = np.abs(np.einsum("nx,nx->n", offset, target.normals[nearest]))
    aside = np.sqrt(np.maximum(far**2 - along**2, 0))
    return np.asarray(np.where(aside < reach, along, far))


def _dice(mesh: HexMesh, myocardium: LevelSet, wall_volume: float) -> float:
    """Overlap by quadrature over the mesh: no mesh is rasterized."""
    xi, weights = gauss_cube(OVERLAP_GAUSS)
    parts = np.abs(determinants(mesh, xi)) * weights
    value, _ = myocardium.sample(mesh.evaluate(xi).reshape(-1, 3))
    common = float(parts.ravel() @ (value < 0))
    return 2 * common / (abs(volume(mesh)) + wall_volume)


def _mean(values: NDArray[np.float64], weights: NDArray[np.float64]) -> float:
    """Weighted mean."""
    return float(np.average(values, weights=weights))


def _percentile(values: NDArray[np.float64], weights: NDArray[np.float64], q: float) -> float:
    """Weighted percentile."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return float(values[order][np.searchsorted(total, q / 100 * total[-1])])
