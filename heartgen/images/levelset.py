"""Smooth sub-voxel surfaces of voxel shapes: signed distances that can be evaluated anywhere."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numba as nb
import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.images.tricubic import interpolate

SMOOTHING = 0.7
"""Gaussian width, in voxels, that turns voxel stairs into a surface. Light: it moves a surface of
radius R voxels by about 0.25/R voxels."""

INSIDE = 0.5
"""Level of the smoothed indicator that is the surface."""

PLANE_REACH = 0.75
"""Tangential distance, in voxels, up to which a surface sample stands for its tangent plane; what
exceeds it counts towards the distance."""

TIE = 1e-9
"""Relative difference below which two squared distances count as equal."""

SETTLING_ROUNDS = 2
"""Rounds in which each voxel tries the surface points of all 26 neighbors: the sweeps, which look
at six, can miss the nearest one, and which they miss depends on the order of the axes..."""

SETTLING_REACH = 10.0
"""...as far from the surface as this, in voxels."""


@dataclass(frozen=True, eq=False)
class LevelSet:
    """Signed distance to a surface, sampled on a voxel grid.

    Attributes
    ----------
    values : (nx, ny, nz) float32
        Signed distance, mm, negative inside.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.
    """

    values: NDArray[np.float32]
    affine: NDArray[np.float64]

    def sample(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Evaluate by Catmull-Rom interpolation, which has a continuous gradient.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS). Outside the grid the distance to the grid is added.

        Returns
        -------
        values : (n,) float64
            Signed distance, mm.
        gradient : (n, 3) float64
            Its gradient in the world, dimensionless.
        """
        inverse = np.linalg.inv(self.affine)
        index = np.ascontiguousarray(points @ inverse[:3, :3].T + inverse[:3, 3])
        inside = np.clip(index, 0, np.array(self.values.shape) - 1.0)
        values, slope = interpolate(self.values, inside)
        gradient = slope @ inverse[:3, :3]
        beyond = (index - inside) @ self.affine[:3, :3].T
        far = np.linalg.norm(beyond, axis=1)
        outside = far > 0
        values[outside] += far[outside]
        gradient[outside] += beyond[outside] / far[outside, None]
        return values, gradient


def signed_distance(inside: NDArray[np.bool_], affine: NDArray[np.float64]) -> LevelSet:
    """Signed distance to the smooth surface of a voxel shape.

    The surface is the half-level of the lightly smoothed indicator, sampled where it crosses grid
    edges; distances are propagated from those samples and refined by their tangent planes.

    Parameters
    ----------
    inside : (nx, ny, nz) bool
        The shape; at least two empty voxels on every side.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.

    Returns
    -------
    LevelSet
    """
    return signed_distances([inside], affine)[0]


def signed_distances(
    shapes: Sequence[NDArray[np.bool_]], affine: NDArray[np.float64]
) -> list[LevelSet]:
    """Signed distances to several shapes on the same grid; see `signed_distance`.

    Parameters
    ----------
    shapes : sequence of (nx, ny, nz) bool
        The shapes, as for `signed_distance`.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.

    Returns
    -------
    list of LevelSet
    """
    return _distances_to([smooth_indicator(shape) for shape in shapes], affine)


def level_distances(
    levels: Sequence[NDArray[np.float64]], affine: NDArray[np.float64]
) -> list[LevelSet]:
    """Signed distances to the surfaces that level functions are zero on.

    Parameters
    ----------
    levels : sequence of (nx, ny, nz) float64
        Level functions, negative inside, positive at the grid's borders; about distances in mm near
        zero.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.

    Returns
    -------
    list of LevelSet
    """
    return _distances_to([INSIDE - level for level in levels], affine)


def _distances_to(
    smooths: Sequence[NDArray[np.float64]], affine: NDArray[np.float64]
) -> list[LevelSet]:
    """Signed distances to where functions that are larger inside cross `INSIDE`."""
    metric = np.ascontiguousarray(affine[:3, :3])
    voxel = float(np.min(np.linalg.norm(metric, axis=0)))
    reach, near = PLANE_REACH * voxel, (SETTLING_REACH * voxel) ** 2
    levels = []
    # Sweeps are serial: one thread for each shape. What follows them is parallel in itself.
    with ThreadPoolExecutor() as pool:
        for smooth, seeds, normals, nearest in pool.map(lambda s: _propagated(s, affine), smooths):
            for _ in range(SETTLING_ROUNDS):
                nearest = _settle(nearest, seeds, normals, metric, near)
            values = _distances(nearest, seeds, normals, metric, smooth > INSIDE, reach)
            levels.append(LevelSet(values, affine))
    return levels


def _propagated(
    smooth: NDArray[np.float64], affine: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
    """Smooth function, surface points, their normals, and which of them is each voxel's."""
    metric = np.ascontiguousarray(affine[:3, :3])
    seeds, normals, owner = _crossings(smooth, metric)
    return smooth, seeds, normals, _sweep(owner, seeds, normals, metric)


def smooth_indicator(inside: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Lightly smoothed indicator of a voxel shape, in [0, 1]; its half-level is the surface.

    Parameters
    ----------
    inside : array of bool
        The shape, in two or three dimensions.
    """
    return np.asarray(ndi.gaussian_filter(inside.astype(float), SMOOTHING, mode="constant"))


def _crossings(
    smooth: NDArray[np.float64], metric: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]]:
    """Surface points on grid edges (mm from the first voxel), normals, each voxel's nearest one."""
    level = smooth - INSIDE
    points = []
    for axis in range(3):
        low = np.moveaxis(level, axis, 0)[:-1]
        high = np.moveaxis(level, axis, 0)[1:]
        start = np.argwhere((low > 0) != (high > 0))
        a, b = low[tuple(start.T)], high[tuple(start.T)]
        place = start.astype(float)
        place[:, 0] += a / (a - b)
        points.append(np.insert(place[:, 1:], axis, place[:, 0], axis=1))
    seeds = np.concatenate(points)
    slope = np.stack(
        [ndi.map_coordinates(np.asarray(g), seeds.T, order=1) for g in np.gradient(smooth)], axis=-1
    )
    normals = -slope @ np.linalg.inv(metric)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    owner, places = np.full(smooth.shape, -1, dtype=np.int32), seeds @ metric.T
    _claim(owner, seeds, places, metric)
    return places, normals, owner


@nb.njit(cache=True)
def _center(metric, i, j, k):  # type: ignore[no-untyped-def]
    """Center of a voxel, mm from that of the first."""
    return (
        metric[0, 0] * i + metric[0, 1] * j + metric[0, 2] * k,
        metric[1, 0] * i + metric[1, 1] * j + metric[1, 2] * k,
        metric[2, 0] * i + metric[2, 1] * j + metric[2, 2] * k,
    )


@nb.njit(cache=True)
def _squared(place, center):  # type: ignore[no-untyped-def]
    """Squared distance between a surface point and a voxel center."""
    x, y, z = place[0] - center[0], place[1] - center[1], place[2] - center[2]
    return x * x + y * y + z * z


@nb.njit(cache=True)
def _claim(owner, seeds, places, metric):  # type: ignore[no-untyped-def]
    """Give every voxel at an end of a crossed edge the nearest of its surface points."""
    for s in range(len(seeds)):
        i0, j0, k0 = (
            int(np.floor(seeds[s, 0])),
            int(np.floor(seeds[s, 1])),
            int(np.floor(seeds[s, 2])),
        )
        i1, j1, k1 = int(np.ceil(seeds[s, 0])), int(np.ceil(seeds[s, 1])), int(np.ceil(seeds[s, 2]))
        for end in range(2):
            i, j, k = (i0, j0, k0) if end == 0 else (i1, j1, k1)
            old, center = owner[i, j, k], _center(metric, i, j, k)
            if old < 0 or _squared(places[s], center) < _squared(places[old], center):
                owner[i, j, k] = s


@nb.njit(cache=True)
def _height(place, normal, center):  # type: ignore[no-untyped-def]
    """Height of a voxel center over the tangent plane of a surface point."""
    x, y, z = center[0] - place[0], center[1] - place[1], center[2] - place[2]
    return x * normal[0] + y * normal[1] + z * normal[2]


@nb.njit(cache=True, nogil=True)
def _sweep(owner, places, normals, metric):  # type: ignore[no-untyped-def]
    """Propagate nearest surface points by eight directional sweeps (vector distance transform).

    Among points at the same distance the one whose tangent plane is nearer wins, whatever the order
    of the axes.
    """
    nx, ny, nz = owner.shape
    for direction in range(8):
        di = 1 if direction & 1 else -1
        dj = 1 if direction & 2 else -1
        dk = 1 if direction & 4 else -1
        for ii in range(nx):
            i = ii if di > 0 else nx - 1 - ii
            for jj in range(ny):
                j = jj if dj > 0 else ny - 1 - jj
                for kk in range(nz):
                    k = kk if dk > 0 else nz - 1 - kk
                    best, center = owner[i, j, k], _center(metric, i, j, k)
                    least = _squared(places[best], center) if best >= 0 else np.inf
                    for n in range(3):
                        a = i - di if n == 0 else i
                        b = j - dj if n == 1 else j
                        c = k - dk if n == 2 else k
                        if 0 <= a < nx and 0 <= b < ny and 0 <= c < nz:
                            other = owner[a, b, c]
                            if other < 0 or other == best:
                                continue
                            d = _squared(places[other], center)
                            if d > least * (1 + TIE):
                                continue
                            if d > least * (1 - TIE):
                                new = _height(places[other], normals[other], center)
                                old = _height(places[best], normals[best], center)
                                if abs(new) >= abs(old) * (1 - TIE):
                                    continue
                            least, best = d, other
                    owner[i, j, k] = best
    return owner


@nb.njit(cache=True, parallel=True)
def _settle(owner, places, normals, metric, near):  # type: ignore[no-untyped-def]
    """Best of the own and the 26 neighbors' surface points of each voxel near the surface."""
    nx, ny, nz = owner.shape
    out = owner.copy()
    for i in nb.prange(nx):
        for j in range(ny):
            for k in range(nz):
                best, center = owner[i, j, k], _center(metric, i, j, k)
                least = _squared(places[best], center)
                if least > near:
                    continue
                height = abs(_height(places[best], normals[best], center))
                for a in range(max(i - 1, 0), min(i + 2, nx)):
                    for b in range(max(j - 1, 0), min(j + 2, ny)):
                        for c in range(max(k - 1, 0), min(k + 2, nz)):
                            other = owner[a, b, c]
                            if other == best:
                                continue
                            d = _squared(places[other], center)
                            if d > least * (1 + TIE):
                                continue
                            new = abs(_height(places[other], normals[other], center))
                            if d > least * (1 - TIE) and new >= height * (1 - TIE):
                                continue
                            least, height, best = d, new, other
                out[i, j, k] = best
    return out


@nb.njit(cache=True, parallel=True)
def _distances(nearest, places, normals, metric, inside, reach):  # type: ignore[no-untyped-def]
    """Signed distance per voxel to the patch of tangent plane at its surface point."""
    out = np.empty(nearest.shape, dtype=np.float32)
    for i in nb.prange(nearest.shape[0]):
        for j in range(nearest.shape[1]):
            for k in range(nearest.shape[2]):
                s, center = nearest[i, j, k], _center(metric, i, j, k)
                squared = _squared(places[s], center)
                along = _height(places[s], normals[s], center)
                aside = max(squared - along * along, 0.0)
                size = np.sqrt(along * along + max(aside - reach * reach, 0.0))
                out[i, j, k] = -size if inside[i, j, k] else size
    return out
