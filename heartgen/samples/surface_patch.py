"""A smooth surface patch over a region of the plane: its area, samples and distance.

Everything is worked out from the closed-form map itself, so it is exact to far below a micrometer
and no triangulation stands between a phantom and its truth.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.spatial import KDTree

from heartgen.samples.nearest import (
    LEAF,
    Curve,
    Surface,
    closest,
    curve_distance,
    make_curve,
    normal,
)
from heartgen.samples.region import Region

Array = NDArray[np.float64]

NODES = 64
"""Gauss-Legendre nodes along q: area of our patches to 1e-8."""

NODES_AROUND = 256
"""Nodes along v: trapezoidal rule all around (spectral), or Gauss-Legendre."""

DENSITY_CELLS = 256
"""Cells along q and v in which the area is tabulated to spread samples evenly."""

GOLDEN = (1 + 5**0.5) / 2
"""The golden ratio: successive samples turn by 1/GOLDEN turns, as seeds in a sunflower."""

SEED_AREA = 0.25
"""Area per start point of the closest-point search, mm^2 (a start lies within 0.4 mm)."""


@dataclass(frozen=True)
class Patch:
    """Surface over a region of a plane.

    Attributes
    ----------
    point : callable
        Plane coordinates (n, 2) to points (n, 3), mm; smooth on and a little beyond the region.
    region : Region
        Of plane coordinates.
    """

    point: Surface
    region: Region

    @cached_property
    def elements(self) -> tuple[Array, Array]:
        """Quadrature nodes (n, 3), mm, and area vectors (n, 3), mm^2, normal to the surface."""
        plane, weights = _product_rule(self)
        return self.point(plane), weights[:, None] * normal(self.point, plane)

    @cached_property
    def area(self) -> float:
        """Area of the patch, mm^2."""
        return float(np.linalg.norm(self.elements[1], axis=1).sum())

    @cached_property
    def column_volume(self) -> float:
        """Integral of z over the shadow of the patch on the plane z = 0, mm^3, positive upward."""
        points, vectors = self.elements
        return float(points[:, 2] @ vectors[:, 2])

    @cached_property
    def seeds(self) -> tuple[KDTree, Array]:
        """Search tree of evenly spread points and their plane coordinates (n, 2)."""
        plane, _ = _spread(self, int(np.ceil(self.area / SEED_AREA)))
        return KDTree(self.point(plane), leafsize=LEAF), plane

    @cached_property
    def boundary(self) -> tuple[Curve, ...]:
        """The smooth curves that bound the patch."""
        return tuple(
            make_curve(parameter, self.point(plane), self.region.closed)
            for parameter, plane in self.region.borders()
        )

    def samples(self, n: int) -> tuple[Array, Array]:
        """Spread samples evenly.

        Parameters
        ----------
        n : int
            Number of samples, at least 1.

        Returns
        -------
        points : (n, 3) float64, mm
        weights : (n,) float64, mm^2
            Nearly equal; their sum is the area of the patch.
        """
        plane, weights = _spread(self, n)
        return self.point(plane), weights * (self.area / weights.sum())

    def distance(self, points: Array) -> Array:
        """Distance to the patch: Newton from the nearest sample, and to its boundary curves.

        Every candidate lies on the patch, so the least is never below the true distance.

        Parameters
        ----------
        points : (n, 3) float64, mm
            In the frame of the patch.

        Returns
        -------
        (n,) float64, mm
            Not negative.
        """
        tree, plane = self.seeds
        best, start = tree.query(points)
        foot = closest(self.point, points, plane[start])
        reached = np.linalg.norm(self.point(foot) - points, axis=1)
        best = np.minimum(best, np.where(self.region.holds(foot), reached, np.inf))
        for curve in self.boundary:
            best = np.minimum(best, curve_distance(curve, points))
        return np.asarray(best)


def _product_rule(patch: Patch) -> tuple[Array, Array]:
    """Nodes (n, 2) and weights (n,) in the plane that integrate over the region."""
    node, gauss = np.polynomial.legendre.leggauss(NODES)
    if patch.region.closed:
        v = np.linspace(0, 1, NODES_AROUND, endpoint=False)
        share = np.full(NODES_AROUND, 1 / NODES_AROUND)
    else:
        v, share = np.polynomial.legendre.leggauss(NODES_AROUND)
        v, share = (v + 1) / 2, share / 2
    q, v = (a.ravel() for a in np.meshgrid((node + 1) / 2, v, indexing="ij"))
    plane, stretch = patch.region.place(q, v)
    return plane, np.outer(gauss / 2, share).ravel() * stretch


def _spread(patch: Patch, n: int) -> tuple[Array, Array]:
    """Plane coordinates (n, 2) of samples even in area, and their areas (n,) in space, mm^2."""
    edges = np.linspace(0, 1, DENSITY_CELLS + 1)
    middle = (edges[1:] + edges[:-1]) / 2
    q, v = (a.ravel() for a in np.meshgrid(middle, middle, indexing="ij"))
    density = _density(patch, q, v)[1].reshape(DENSITY_CELLS, -1)
    along, around = (
        np.concatenate([[0.0], np.cumsum(density.sum(axis=a)) / density.sum()]) for a in (1, 0)
    )
    # q^2, not q, is smooth in the share of area at a pole, where area grows as radius squared.
    square, turn = PchipInterpolator(along, edges**2), PchipInterpolator(around, edges)
    index = np.arange(n)
    u, w = (index + 1 / 2) / n, np.mod(1 / 2 + index / GOLDEN, 1)
    q, v = np.sqrt(square(u)), turn(w)
    stretch = square.derivative()(u) / (2 * q) * turn.derivative()(w)
    plane, density = _density(patch, q, v)
    return plane, density * stretch / n


def _density(patch: Patch, q: Array, v: Array) -> tuple[Array, Array]:
    """Plane coordinates (n, 2) and area in space, mm^2, per unit of (q, v), (n,)."""
    plane, stretch = patch.region.place(q, v)
    return plane, stretch * np.linalg.norm(normal(patch.point, plane), axis=1)
