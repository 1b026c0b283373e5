"""Quality of the elements as sums of squares: even Jacobians, right angles, little bending."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba as nb
import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.freedom import Freedom
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.jacobian import QUALITY_GAUSS
from heartgen.mesh.quadrature import gauss_cube
from heartgen.refinement.assembly import Blocks

Array = NDArray[np.float64]

GUARD_WEIGHT, MOST_GUARDED = 0.1, 0.5
"""Weight of the corners and edges of the elements against their inside, where folds begin; and
the most of it, in elements that were folded."""

GUARDS = 3
"""Guard points along an edge of an element..."""

CLOSE_GUARDS = 7
"""...and in a mesh that folded between them. They crowd towards the corners, as folds do."""

PAIRS = ((0, 1), (1, 2), (2, 0))

FOLDED = 1e-3
"""Least det J over the mean in an element below which it is being unfolded."""

LIFT = 0.1
"""Size of the smooth step that replaces det J near zero while unfolding, over its mean."""

SHEAR_GAUSS = 3
"""Quadrature points per direction for the angles between the elements' directions."""

LEAST_SCALED = 0.3
"""Scaled Jacobian below which cosines gain no more weight."""

SECOND = ((2, 0, 0), (0, 2, 0), (1, 1, 0))


@dataclass(frozen=True)
class Care:
    """What keeps elements from folding between the guard points.

    Attributes
    ----------
    emphasis : (e,) float64
        Weight of an element's quality over that of others, and most at its guard points.
    firmness : (e,) float64
        1, or more for elements that are to be held straight and fitted less closely.
    """

    emphasis: NDArray[np.float64]
    firmness: NDArray[np.float64]

    @property
    def treated(self) -> int:
        """Number of elements that get more of either than the usual."""
        return int(self._more.sum())

    @property
    def _more(self) -> NDArray[np.bool_]:
        """Elements (e,) that get more of either than the usual."""
        return np.asarray((self.emphasis > 1) | (self.firmness > 1))

    @property
    def most(self) -> float:
        """Most of either that any element gets."""
        return float(max(self.emphasis.max(), self.firmness.max()))

    def eased(self, emphasis: float) -> Care:
        """Return the care that gives the same elements this much emphasis, and no firmness."""
        return usual_care(len(self.emphasis)).with_more(
            "emphasis", np.where(self._more, emphasis, 1.0)
        )

    def with_more(self, remedy: str, factor: NDArray[np.float64]) -> Care:
        """Return the same with one of the two multiplied by factors (e,)."""
        return replace(self, **{remedy: getattr(self, remedy) * factor})


def usual_care(n: int) -> Care:
    """Care of n elements none of which has folded."""
    return Care(np.ones(n), np.ones(n))


@dataclass(frozen=True)
class State:
    """Jacobians at the quadrature points.

    Attributes
    ----------
    jacobian : (e, q, 3, 3) float64
        Last axis is the xi direction, mm.
    det : (e, q) float64
    lift : (e, 1) float64
        Half-width of the smooth step that replaces det J; 0 where nothing is folded, mm^3.
    inner : (e, p, 3, 3) float64
        Jacobians at the points where the angles are measured.
    """

    jacobian: NDArray[np.float64]
    det: NDArray[np.float64]
    lift: NDArray[np.float64]
    inner: NDArray[np.float64]

    @property
    def log_det(self) -> NDArray[np.float64]:
        """Logarithm of det J, or of what stands for it while unfolding."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.log((self.det + self.root) / 2))

    @property
    def root(self) -> NDArray[np.float64]:
        """What d log det J divides by."""
        return np.asarray(np.sqrt(self.det**2 + 4 * self.lift**2))


class Elements:
    """Quality terms of a topology as functions of its free degrees of freedom.

    The guard points stand closer once an element was treated.
    """

    def __init__(self, freedom: Freedom, topology: Topology, care: Care) -> None:
        e = topology.n_elements
        self.freedom = freedom
        self.share = care.emphasis / e
        self.stiffness = (care.firmness - 1) / e
        xi, weights, guards = _points(CLOSE_GUARDS if care.treated else GUARDS)
        self.slopes = [freedom.functions(xi, _unit(d)) for d in range(3)]
        inner, self.inner_weights = gauss_cube((SHEAR_GAUSS,) * 3)
        self.inner_slopes = [freedom.functions(inner, _unit(d)) for d in range(3)]
        self.second = [freedom.functions(inner, d) for d in SECOND]
        guarded = np.minimum(GUARD_WEIGHT * care.emphasis, MOST_GUARDED)[:, None]
        self.use = (1 - guarded) * weights + guarded * guards
        at_pole = np.flatnonzero(xi[:, 1] == 0)
        self.use[np.ix_(topology.collapsed[:, 0], at_pole)] = 0
        self.use /= self.use.sum(1, keepdims=True)

    def emphasise(self, factor: NDArray[np.float64]) -> None:
        """Multiply the weight of the elements' quality by factors (e,)."""
        self.share = self.share * factor

    def _local(self, q: NDArray[np.float64]) -> Array:
        """Degrees of freedom of each element (e, m, 3) from the free ones (n, 3)."""
        return np.asarray(np.concatenate([q, np.zeros((1, 3))])[self.freedom.dofs])

    def _jacobian(self, q: NDArray[np.float64], slopes: list[NDArray[np.float64]]) -> Array:
        """Jacobians (e, q, 3, 3) for free degrees of freedom (n, 3)."""
        local = self._local(q)
        return np.stack([np.matmul(s, local) for s in slopes], -1)

    def state(self, q: NDArray[np.float64], unfolding: bool | None = None) -> State:
        """Jacobians for free degrees of freedom (n, 3); `unfolding` None: if there are folds."""
        jacobian = self._jacobian(q, self.slopes)
        det = np.sum(jacobian[..., 0] * np.cross(jacobian[..., 1], jacobian[..., 2]), axis=-1)
        det = np.where(self.use > 0, det, 1.0)
        size = np.einsum("eq,eq->e", np.abs(det), self.use)[:, None]
        if unfolding is None:
            unfolding = bool((det < FOLDED * size).any())
        inner = self._jacobian(q, self.inner_slopes)
        return State(jacobian, det, LIFT * size * unfolding, inner)

    def spread(self, state: State) -> float:
        """Mean variance of log det J within the elements; infinite for folded ones."""
        log_det = state.log_det
        if not np.isfinite(log_det).all():
            return np.inf
        mean = np.einsum("eq,eq->e", log_det, self.use)[:, None]
        return float(np.einsum("eq,eq,e->", (log_det - mean) ** 2, self.use, self.share))

    def oblique(self, state: State) -> NDArray[np.float64]:
        """Weight (e, p) of the cosines: one over the squared scaled Jacobian.

        The scaled Jacobian falls the faster the smaller it is; squares alone would let one point
        shear so that many others need not. Not while unfolding: a folded element's is near zero in
        one place or another from step to step, and weights that follow lead the mesh astray.
        """
        if state.lift.any():
            return np.broadcast_to(self.inner_weights, state.inner.shape[:2])
        unit, _ = _directions(state.inner)
        scaled = np.abs(np.linalg.det(unit))
        return np.asarray(self.inner_weights / np.maximum(scaled, LEAST_SCALED) ** 2)

    def shear(self, state: State, weight: NDArray[np.float64]) -> float:
        """Mean over the elements of the weighted squared cosines between their directions."""
        unit, _ = _directions(state.inner)
        cosines = (np.sum(unit[..., a] * unit[..., b], axis=-1) for a, b in PAIRS)
        return float(sum(self.share @ np.sum(weight * c**2, axis=1) for c in cosines))

    def stiff(self, state: State) -> NDArray[np.float64]:
        """Quadratic form (e, m, m) that holds elements straight: their bending by firmness."""
        if not self.stiffness.any():
            return np.zeros((1, 1, 1))
        return self.stiffness[:, None, None] * self._bending(_directions(state.inner)[1])

    def bent(self, q: NDArray[np.float64], stiff: NDArray[np.float64]) -> float:
        """Value of such a form."""
        if not stiff.any():
            return 0.0
        local = self._local(q)
        return float(np.sum(local * np.matmul(stiff, local)))

    def blocks(
        self, q: NDArray[np.float64], state: State, spread: float, shear: float, bending: float
    ) -> Blocks:
        """Gauss-Newton blocks of the weighted terms.

        Bending is that of the step to come, and in firm elements that of the whole.
        """
        e, m = self.freedom.dofs.shape
        root = np.sqrt(self.use * self.share[:, None])[..., None]
        rows, values = [], []
        gradient = self._log_det_rows(state)
        mean = np.einsum("eqk,eq->ek", gradient, self.use)[:, None]
        log_det = state.log_det
        centre = np.einsum("eq,eq->e", log_det, self.use)[:, None]
        rows.append(np.sqrt(spread) * root * (gradient - mean))
        values.append(np.sqrt(spread) * root[..., 0] * (log_det - centre))
        unit, length = _directions(state.inner)
        root = np.sqrt(self.oblique(state) * self.share[:, None])[..., None]
        for a, b in PAIRS:
            cosine = np.sum(unit[..., a] * unit[..., b], axis=-1)
            of_a = (unit[..., b] - cosine[..., None] * unit[..., a]) / length[..., a, None]
            of_b = (unit[..., a] - cosine[..., None] * unit[..., b]) / length[..., b, None]
            slopes = (self.inner_slopes[a], self.inner_slopes[b])
            row = _combined(slopes, np.stack([of_a, of_b]))
            rows.append(np.sqrt(shear) * root * row)
            values.append(np.sqrt(shear) * root[..., 0] * cosine)
        stacked, value = np.concatenate(rows, axis=1), np.concatenate(values, axis=1)
        across = stacked.transpose(0, 2, 1)
        matrix = np.matmul(across, stacked)
        gradient = np.matmul(across, value[..., None])[..., 0]
        view = matrix.reshape(e, m, 3, m, 3)
        stiff = bending * self.stiff(state)
        bent = bending / e * self._bending(length) + stiff
        for x in range(3):
            view[:, :, x, :, x] += bent
        if stiff.any():
            gradient += np.matmul(stiff, self._local(q)).reshape(e, -1)
        return Blocks(self.freedom.dofs, matrix, gradient)

    def _log_det_rows(self, state: State) -> NDArray[np.float64]:
        """Derivative of log det J by the local degrees of freedom, (e, q, 3 m)."""
        j = state.jacobian
        cofactors = [np.cross(j[..., (d + 1) % 3], j[..., (d + 2) % 3]) for d in range(3)]
        return np.asarray(
            _combined(tuple(self.slopes), np.stack(cofactors) / state.root[..., None])
        )

    def _bending(self, length: NDArray[np.float64]) -> NDArray[np.float64]:
        """Squared second derivatives over squared sizes of the elements, (e, m, m)."""
        size = np.einsum("eqd,q->ed", length**2, self.inner_weights)
        scales = (size[:, 0], size[:, 1], np.sqrt(size[:, 0] * size[:, 1]))
        rows = (second * np.sqrt(self.inner_weights)[:, None] for second in self.second)
        squares = (
            np.matmul(row.transpose(0, 2, 1), row) / scale[:, None, None]
            for row, scale in zip(rows, scales, strict=True)
        )
        return np.asarray(sum(squares))


def _points(
    guards: int,
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Gauss points and a grid of guard points on an element's faces; the weights of either."""
    inner, weights = gauss_cube((QUALITY_GAUSS,) * 3)
    t = (1 - np.cos(np.linspace(0, np.pi, guards))) / 2
    guard = np.stack(np.meshgrid(t, t, t, indexing="ij"), -1).reshape(-1, 3)
    guard = guard[np.any((guard == 0) | (guard == 1), axis=1)]
    even = np.full(len(guard), 1 / len(guard))
    return (
        np.concatenate([inner, guard]),
        np.concatenate([weights, np.zeros(len(guard))]),
        np.concatenate([np.zeros(len(inner)), even]),
    )


def _unit(direction: int) -> tuple[int, int, int]:
    """First derivative along one direction."""
    return (int(direction == 0), int(direction == 1), int(direction == 2))


def _directions(jacobian: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Unit columns (e, q, 3, 3) of Jacobians, and their lengths (e, q, 3)."""
    length = np.maximum(np.linalg.norm(jacobian, axis=2), np.finfo(float).tiny)
    return jacobian / length[:, :, None, :], length


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
