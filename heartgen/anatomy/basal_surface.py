"""The basal surface: a smooth one through a rim that rises and falls with the valves."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from scipy.interpolate import RBFInterpolator

from heartgen.anatomy.plane import Plane

SMOOTHING = 2e-2
"""Smoothing of the thin-plate spline, over lengths in units of the ventricle's."""

HIGHEST = 0.1
"""Height over the plane, in lengths of the ventricle, above which a rim is an outflow tract that
the surface passes through."""

MARGIN = 0.15
"""How far beyond the rim the surface is known, in lengths of the ventricle."""

CELLS = 128
"""Cells of the surface's grid along its longer side."""


@dataclass(frozen=True, eq=False)
class BasalSurface:
    """A plane with bumps.

    Attributes
    ----------
    plane : Plane
        What the bumps stand on.
    axes : (2, 3) float64
        Unit vectors in the plane.
    corner : (2,) float64
        Place of the first node of the grid along the axes, from the plane's origin, mm.
    spacing : float
        Of the grid, mm.
    bumps : (i, j) float64
        Height of the surface over the plane at the nodes of the grid, mm.
    """

    plane: Plane
    axes: NDArray[np.float64]
    corner: NDArray[np.float64]
    spacing: float
    bumps: NDArray[np.float64]

    def height(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Height over the surface of (n, 3) points along the plane's normal, mm: (n,).

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        place = (points - self.plane.origin) @ self.axes.T
        grid = (place - self.corner) / self.spacing
        bump = ndi.map_coordinates(self.bumps, grid.T, order=1, mode="nearest")
        return np.asarray(self.plane.height(points) - bump)

    def shifted(self, distance: float) -> BasalSurface:
        """Return the same surface `distance` mm towards the base.

        Parameters
        ----------
        distance : float
            mm.
        """
        return replace(self, plane=self.plane.shifted(distance))


def fit_basal_surface(plane: Plane, rim: NDArray[np.float64], length: float) -> BasalSurface:
    """Smooth surface through a rim.

    Parameters
    ----------
    plane : Plane
        Through the rim.
    rim : (n, 3) float64
        Points of the rim, mm, world (LPS).
    length : float
        Of the ventricle, mm.

    Returns
    -------
    BasalSurface
    """
    axes = np.linalg.svd(plane.normal[None])[2][1:]
    place = (rim - plane.origin) @ axes.T
    spline = RBFInterpolator(
        place / length,
        np.minimum(plane.height(rim) / length, HIGHEST),
        kernel="thin_plate_spline",
        smoothing=SMOOTHING,
    )
    corner = place.min(0) - MARGIN * length
    size = place.max(0) + MARGIN * length - corner
    spacing = float(size.max()) / CELLS
    i, j = (np.arange(np.ceil(s / spacing) + 1) for s in size)
    nodes = corner + spacing * np.stack(np.meshgrid(i, j, indexing="ij"), -1)
    bumps = length * spline(nodes.reshape(-1, 2) / length).reshape(len(i), len(j))
    return BasalSurface(plane, axes, corner, spacing, bumps)
