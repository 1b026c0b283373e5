"""Quality of the elements: even Jacobians and right angles between their directions.

    E_det   = sum_e w_e  Var_e(log det J)
    E_angle = sum_e w_e  mean_e(sum of cos^2 between the columns of J) / sJ^2

Var_e is the variance and mean_e the mean over quadrature points of an element, sJ its scaled
Jacobian. The variance of log det J is zero for an element of one constant Jacobian and infinite for
a folded one: it is its own barrier. The angles see to it that even Jacobians are not bought with
shear.
"""

from __future__ import annotations

import numba as nb
import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.dof_map import DofMap
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.jacobian import QUALITY_GAUSS
from heartgen.mesh.quadrature import gauss_cube
from heartgen.optimization.assembly import Blocks
from heartgen.optimization.settings import (
    ANGLE_GAUSS,
    COLLOCATED,
    COLLOCATION,
    FOLDED,
    LEAST_SCALED,
    SHIFT,
)
from heartgen.optimization.terms import Model

Array = NDArray[np.float64]

COLUMN_PAIRS = ((0, 1), (1, 2), (2, 0))


class EvenJacobians:
    """The variance of log det J within the elements.

    Parameters
    ----------
    dof_map : DofMap
        Free degrees of freedom of the mesh.
    topology : Topology
        Of the mesh.
    weight : (e,) float64
        Of each element.
    """

    def __init__(self, dof_map: DofMap, topology: Topology, weight: Array) -> None:
        xi, gauss, collocated = _points()
        self._dof_map, self._weight = dof_map, weight
        self._slopes = [dof_map.functions(xi, _unit(d)) for d in range(3)]
        use = np.tile((1 - COLLOCATED) * gauss + COLLOCATED * collocated, (topology.n_elements, 1))
        use[np.ix_(topology.collapsed[:, 0], np.flatnonzero(xi[:, 1] == 0))] = 0
        self._use = use / use.sum(1, keepdims=True)

    def near(self, q: Array) -> Model:
        """Return the term near a mesh (see `Term`).

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom of the mesh, mm, world (LPS).
        """
        jacobian, det = self._jacobian(q)
        folded = (det < FOLDED * self._size(det)) & (self._use > 0)
        untangling = bool(folded.any())
        shift = SHIFT * self._size(det) * untangling
        root = np.sqrt(det**2 + 4 * shift**2)
        with np.errstate(divide="ignore", invalid="ignore"):
            log_det = np.log((det + root) / 2)
        cofactors = [
            np.cross(jacobian[..., (d + 1) % 3], jacobian[..., (d + 2) % 3]) for d in range(3)
        ]
        rows = _combined(tuple(self._slopes), np.stack(cofactors) / root[..., None])
        scale = np.sqrt(self._use * self._weight[:, None])
        blocks = _normal_equations(
            self._dof_map.dofs,
            scale[..., None] * (rows - self._mean(rows)),
            scale * (log_det - self._mean(log_det)),
        )
        return Model(lambda q: self._value(q, untangling), blocks)

    def _value(self, q: Array, untangling: bool) -> float:
        """The term; infinite for folded elements, unless they are being untangled."""
        _, det = self._jacobian(q)
        shift = SHIFT * self._size(det) * untangling
        with np.errstate(divide="ignore", invalid="ignore"):
            log_det = np.log((det + np.sqrt(det**2 + 4 * shift**2)) / 2)
        if not np.isfinite(log_det).all():
            return np.inf
        spread = (log_det - self._mean(log_det)) ** 2
        return float(np.einsum("eq,eq,e->", spread, self._use, self._weight))

    def _jacobian(self, q: Array) -> tuple[Array, Array]:
        """Jacobian matrices (e, q, 3, 3) and determinants (e, q), 1 where they do not count."""
        jacobian = _columns(self._dof_map, q, self._slopes)
        det = np.sum(jacobian[..., 0] * np.cross(jacobian[..., 1], jacobian[..., 2]), axis=-1)
        return jacobian, np.where(self._use > 0, det, 1.0)

    def _size(self, det: Array) -> Array:
        """Mean size (e, 1) of det J in each element."""
        return np.asarray(np.einsum("eq,eq->e", np.abs(det), self._use)[:, None])

    def _mean(self, of: Array) -> Array:
        """Mean (e, 1, ...) over the points of each element."""
        return np.asarray(np.einsum("eq...,eq->e...", of, self._use)[:, None])


class RightAngles:
    """Squared cosines between the elements' directions, over the squared scaled Jacobian.

    The scaled Jacobian falls the faster the smaller it is: squares alone would let one point shear
    so that many others need not.

    Parameters
    ----------
    dof_map : DofMap
        Free degrees of freedom of the mesh.
    weight : (e,) float64
        Of each element.
    """

    def __init__(self, dof_map: DofMap, weight: Array) -> None:
        xi, self._gauss = gauss_cube((ANGLE_GAUSS,) * 3)
        self._dof_map, self._weight = dof_map, weight
        self._slopes = [dof_map.functions(xi, _unit(d)) for d in range(3)]

    def near(self, q: Array) -> Model:
        """Return the term near a mesh (see `Term`).

        Parameters
        ----------
        q : (n, 3) float64
            Free degrees of freedom of the mesh, mm, world (LPS).
        """
        unit, length = _directions(_columns(self._dof_map, q, self._slopes))
        scaled = np.linalg.det(unit)
        # A folded element's angles lead nowhere: where one is, they count plainly.
        least = LEAST_SCALED if (scaled > 0).all() else 1.0
        use = self._gauss * self._weight[:, None] / np.maximum(scaled, least) ** 2
        root, rows, values = np.sqrt(use), [], []
        for a, b in COLUMN_PAIRS:
            cosine = np.sum(unit[..., a] * unit[..., b], axis=-1)
            of_a = (unit[..., b] - cosine[..., None] * unit[..., a]) / length[..., a, None]
            of_b = (unit[..., a] - cosine[..., None] * unit[..., b]) / length[..., b, None]
            row = _combined((self._slopes[a], self._slopes[b]), np.stack([of_a, of_b]))
            rows.append(root[..., None] * row)
            values.append(root * cosine)
        blocks = _normal_equations(
            self._dof_map.dofs, np.concatenate(rows, axis=1), np.concatenate(values, axis=1)
        )
        return Model(lambda q: self._value(q, use), blocks)

    def _value(self, q: Array, use: Array) -> float:
        """The term with the given weights (e, q) of the points."""
        unit, _ = _directions(_columns(self._dof_map, q, self._slopes))
        squares = (np.sum(unit[..., a] * unit[..., b], axis=-1) ** 2 for a, b in COLUMN_PAIRS)
        return float(np.sum(use * sum(squares)))


def _columns(dof_map: DofMap, q: Array, slopes: list[Array]) -> Array:
    """Jacobian matrices (e, q, 3, 3) for free degrees of freedom (n, 3)."""
    local = np.concatenate([q, np.zeros((1, 3))])[dof_map.dofs]
    return np.stack([np.matmul(s, local) for s in slopes], -1)


def _directions(jacobian: Array) -> tuple[Array, Array]:
    """Unit columns (e, q, 3, 3) of Jacobians, and their lengths (e, q, 3)."""
    length = np.maximum(np.linalg.norm(jacobian, axis=2), np.finfo(float).tiny)
    return jacobian / length[:, :, None, :], length


def _normal_equations(dofs: NDArray[np.intp], rows: Array, values: Array) -> Blocks:
    """Blocks of residuals `values` (e, q) with derivatives `rows` (e, q, 3 m)."""
    across = rows.transpose(0, 2, 1)
    return Blocks(dofs, np.matmul(across, rows), np.matmul(across, values[..., None])[..., 0])


def _points() -> tuple[Array, Array, Array]:
    """Gauss points and points on an element's faces, (q, 3); the weights (q,) of either."""
    inner, weights = gauss_cube((QUALITY_GAUSS,) * 3)
    t = (1 - np.cos(np.linspace(0, np.pi, COLLOCATION))) / 2
    outer = np.stack(np.meshgrid(t, t, t, indexing="ij"), -1).reshape(-1, 3)
    outer = outer[np.any((outer == 0) | (outer == 1), axis=1)]
    return (
        np.concatenate([inner, outer]),
        np.concatenate([weights, np.zeros(len(outer))]),
        np.concatenate([np.zeros(len(inner)), np.full(len(outer), 1 / len(outer))]),
    )


def _unit(direction: int) -> tuple[int, int, int]:
    """First derivative along one direction."""
    return (int(direction == 0), int(direction == 1), int(direction == 2))


@nb.njit(cache=True, parallel=True)
def _combined(slopes, vectors):  # type: ignore[no-untyped-def]
    """Sum (e, q, 3 m) of products of functions (e, q, m) and vectors (d, e, q, 3)."""
    e, q, m = slopes[0].shape
    out = np.zeros((e, q, 3 * m))
    for i in nb.prange(e):
        for d in range(len(slopes)):
            for p in range(q):
                for a in range(m):
                    for x in range(3):
                        out[i, p, 3 * a + x] += slopes[d][i, p, a] * vectors[d, i, p, x]
    return out
