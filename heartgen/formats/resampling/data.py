"""Fields of a mesh on the points and cells it is resampled to."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.directions import FIBER, SHEET, orthonormal, restored
from heartgen.formats.resampling.resample import Resampled
from heartgen.mesh.field import MeshField

Array = NDArray[np.float64]

JUMP = 1e-9
"""Difference of the values at a point, over the largest value of the field, that is rounding."""


@dataclass(frozen=True, eq=False)
class Data:
    """Fields at points and in cells.

    Attributes
    ----------
    points : dict of str to (p, k) float64
        Fields that have one value at each point.
    jumping : frozenset of str
        Names of the others, which are in the cells only.
    cells : dict of str to (m, k) float64
        All fields, at the center of each cell.
    """

    points: dict[str, Array]
    jumping: frozenset[str]
    cells: dict[str, Array]

    def directions(self) -> list[Array]:
        """Fiber and, if there is one, sheet direction in each cell, (m, 3), orthonormal."""
        found = []
        for name in (FIBER, SHEET):
            if name not in self.cells or self.cells[name].shape[1] != 3:
                break
            found.append(self.cells[name])
        return orthonormal(found)

    def axes(self) -> tuple[Array, Array] | None:
        """Fiber direction and that of the sheet at right angles to it in each cell, if known.

        Without a sheet direction, the second is any across the fiber.
        """
        found = self.directions()
        if not found:
            return None
        if len(found) == 1:
            across = np.cross(found[0], np.eye(3)[np.abs(found[0]).argmin(1)])
            found.append(across / np.linalg.norm(across, axis=1, keepdims=True))
        return found[0], found[1]


def sample(cells: Resampled, fields: Iterable[MeshField]) -> Data:
    """Sample fields on a resampled mesh.

    Parameters
    ----------
    cells : Resampled
        Made from the mesh.
    fields : iterable of MeshField
        On the mesh that it is made from.

    Returns
    -------
    Data
        Directions of fibers and sheets are orthonormal where those of the fields are.
    """
    fields = tuple(fields)
    points: dict[str, Array] = {}
    centers = restored(fields, {field.name: _at_centers(field, cells) for field in fields})
    nodes = np.concatenate([block.nodes.ravel() for block in cells.cells])
    at_nodes = restored(fields, {field.name: _at_nodes(field, cells) for field in fields})
    for field in fields:
        if field.per_element:
            continue
        values = at_nodes[field.name]
        mean = np.empty((len(cells.points), field.components))
        count = np.bincount(nodes, minlength=len(mean))
        for k in range(field.components):
            mean[:, k] = np.bincount(nodes, values[:, k], len(mean)) / count
        if np.abs(values - mean[nodes]).max() <= JUMP * np.abs(values).max():
            points[field.name] = mean
    return Data(points, frozenset(centers) - frozenset(points), centers)


def _at_centers(field: MeshField, cells: Resampled) -> Array:
    """Values (m, k) in the middle of each cell."""
    return np.concatenate(
        [
            _at(field, block.element, block.xi[:, : block.kind.vertices].mean(1, keepdims=True))
            for block in cells.cells
        ]
    )[:, 0]


def _at_nodes(field: MeshField, cells: Resampled) -> Array:
    """Values (n, k) at all nodes of all cells."""
    return np.concatenate(
        [_at(field, block.element, block.xi).reshape(-1, field.components) for block in cells.cells]
    )


def _at(field: MeshField, element: NDArray[np.intp], xi: Array) -> Array:
    """Values (m, n, k) at local coordinates (m, n, 3) of elements (m,)."""
    places, which = np.unique(np.round(xi.reshape(-1, 3), 12), axis=0, return_inverse=True)
    return np.asarray(field.evaluate(places)[element[:, None], which.reshape(xi.shape[:2])])
