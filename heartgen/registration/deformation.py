"""A deformation of space: a chain of maps, each given by displacements on a regular grid of nodes.

A trilinear map can be proven free of folds, but it can compress a cell only so far. A chain of such
maps can compress any amount and, like each of its links, never folds.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class NodeGrid:
    """A regular grid of nodes in the world.

    Attributes
    ----------
    frame : (4, 4) float64
        Node index to world, mm, LPS: orthogonal axes, equal spacing.
    shape : (int, int, int)
        Nodes along each axis.
    """

    frame: NDArray[np.float64]
    shape: tuple[int, int, int]

    @property
    def spacing(self) -> float:
        """Distance between neighboring nodes, mm."""
        return float(np.linalg.norm(self.frame[:3, 0]))

    @property
    def size(self) -> int:
        """Number of nodes."""
        return int(np.prod(self.shape))

    def nodes(self) -> NDArray[np.float64]:
        """World positions of the nodes, (n, 3), mm, LPS; the last axis varies fastest."""
        index = np.stack(np.meshgrid(*(np.arange(n) for n in self.shape), indexing="ij"), -1)
        return np.asarray(index.reshape(-1, 3) @ self.frame[:3, :3].T + self.frame[:3, 3])

    def interpolation(self, points: NDArray[np.float64]) -> sp.csr_array:
        """Trilinear interpolation from the nodes to points.

        Parameters
        ----------
        points : (m, 3) float64
            mm, world (LPS); clamped to the grid.

        Returns
        -------
        (m, n) sparse
        """
        inverse = np.linalg.inv(self.frame)
        index = points @ inverse[:3, :3].T + inverse[:3, 3]
        limit = np.array(self.shape) - 1
        index = np.clip(index, 0, limit)
        cell = np.minimum(index.astype(int), limit - 1)
        t = index - cell
        strides = np.array([self.shape[1] * self.shape[2], self.shape[2], 1])
        columns, weights = [], []
        for corner in product((0, 1), repeat=3):
            columns.append((cell + corner) @ strides)
            weights.append(np.prod(np.where(corner, t, 1 - t), axis=1))
        rows = np.arange(0, 8 * len(points) + 1, 8)
        entries = (np.stack(weights, 1).ravel(), np.stack(columns, 1).ravel(), rows)
        return sp.csr_array(entries, shape=(len(points), self.size))


@dataclass(frozen=True, eq=False)
class GridMap:
    """One map x + u(x), trilinear on a grid of nodes; the identity's continuation outside.

    Attributes
    ----------
    grid : NodeGrid
        The nodes; mm, world (LPS).
    displacement : (n, 3) float64
        u at the nodes, mm, world (LPS).
    """

    grid: NodeGrid
    displacement: NDArray[np.float64]

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Moved positions of points (m, 3), mm, world (LPS)."""
        return np.asarray(points + self.grid.interpolation(points) @ self.displacement)

    @staticmethod
    def identity(grid: NodeGrid) -> GridMap:
        """The map that moves nothing.

        Parameters
        ----------
        grid : NodeGrid
            The nodes; mm, world (LPS).
        """
        return GridMap(grid, np.zeros((grid.size, 3)))

    def on(self, grid: NodeGrid) -> GridMap:
        """The same displacement, interpolated to another grid.

        Parameters
        ----------
        grid : NodeGrid
            The other nodes; mm, world (LPS).
        """
        return GridMap(grid, np.asarray(self.grid.interpolation(grid.nodes()) @ self.displacement))

    def least_determinant(self) -> float:
        """Lower bound of det(I + grad u); positive: the map folds nowhere."""
        return float(fold_bound(self.grid, self.displacement).min())


@dataclass(frozen=True)
class Deformation:
    """Map from template to patient: maps applied one after the other, each free of folds.

    Attributes
    ----------
    maps : tuple of GridMap
        In the order of application.
    """

    maps: tuple[GridMap, ...] = ()

    def __call__(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Deformed positions of points (m, 3), mm, world (LPS)."""
        for part in self.maps:
            points = part(points)
        return points

    def then(self, part: GridMap) -> Deformation:
        """Return this deformation followed by one more map.

        Parameters
        ----------
        part : GridMap
            The map that comes last.
        """
        return Deformation((*self.maps, part))

    def least_determinant(self) -> float:
        """Least of the parts' fold bounds; positive: the deformation folds nowhere."""
        return min((part.least_determinant() for part in self.maps), default=1.0)


def fold_bound(grid: NodeGrid, displacement: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lower bound of det(I + grad u) in every cell, (cells,) float64.

    In a cell the determinant is a polynomial of degree 2 per direction; its least Bernstein
    coefficient bounds it from below.

    Parameters
    ----------
    grid : NodeGrid
        The nodes; mm, world (LPS).
    displacement : (n, 3) float64
        mm, world (LPS).
    """
    axes = grid.frame[:3, :3] / grid.spacing
    index = np.stack(np.meshgrid(*(np.arange(n) for n in grid.shape), indexing="ij"), -1)
    place = index + (displacement @ axes).reshape(*grid.shape, 3) / grid.spacing
    edges = []
    for axis in range(3):
        step = np.diff(place, axis=axis)
        corners = {}
        for corner in product((0, 1), repeat=2):
            others = [a for a in range(3) if a != axis]
            cut = [slice(None)] * 3
            for a, c in zip(others, corner, strict=True):
                cut[a] = slice(c, grid.shape[a] - 1 + c)
            corners[corner] = step[tuple(cut)].reshape(-1, 3)
        edges.append(corners)
    return _least_coefficient(edges)


def _least_coefficient(
    edges: list[dict[tuple[int, ...], NDArray[np.float64]]],
) -> NDArray[np.float64]:
    """Least of the 27 Bernstein coefficients of the determinant of trilinear cells."""
    sums: dict[tuple[int, int, int], NDArray[np.float64]] = {}
    for (j1, k1), a in edges[0].items():
        for (i2, k2), b in edges[1].items():
            normal = np.cross(a, b)
            for (i3, j3), c in edges[2].items():
                place = (i2 + i3, j1 + j3, k1 + k2)
                sums[place] = sums.get(place, 0.0) + np.einsum("cx,cx->c", normal, c)
    binomial = np.array([1.0, 2.0, 1.0])
    least = np.min([v / np.prod(binomial[list(p)]) for p, v in sums.items()], axis=0)
    return np.asarray(least)
