"""The policy: a mesh is fitted until it is valid, close and good, by weights of its elements.

One loop. Elements that fold or cross get more weight against the data until there are none; if
that does not help, once more from the start, and their neighbors, too, by the root of it: walls
that cross are held where they are by what lies beside them. From then on no step may leave the
valid meshes, and the weights that did it go back to little more than the usual. If the mesh is then
farther from the patient than allowed, everything but the data weighs less; and elements whose
Jacobian ratio is below the least weigh more, as far as that helps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.validity import certify
from heartgen.optimization.distances import misfit
from heartgen.optimization.energy import Energy
from heartgen.optimization.gauss_newton import minimize
from heartgen.optimization.settings import (
    AIM,
    AIMED_MISFIT,
    GROWTH,
    MORE_ROUNDS,
    MOST_RAISED,
    MOST_RELAXED,
    RAISED_ROUNDS,
    RELAXED_ROUNDS,
    RELAXING,
    ROUNDS,
    FitSettings,
)
from heartgen.optimization.target import FitTarget

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Optimized:
    """An optimized mesh.

    Attributes
    ----------
    mesh : HexMesh
        Straight across the wall; mm, world (LPS).
    regularized : (e,) bool
        Elements that weighed more against the data, to keep det J > 0 and the walls apart.
    valid : bool
        Whether no element folds and no two walls cross.
    """

    mesh: HexMesh
    regularized: NDArray[np.bool_]
    valid: bool


def optimize(
    mesh: HexMesh,
    target: FitTarget,
    settings: FitSettings,
    allowed: float = np.inf,
    least: float = 0.0,
    progress: Callable[[float], None] = lambda done: None,
) -> Optimized:
    """Optimize a mesh for accuracy, quality and fairness, under constraints.

    Parameters
    ----------
    mesh : HexMesh
        Where to start, and where the lines' course is taken from; mm, world (LPS).
    target : FitTarget
        What the mesh is to follow.
    settings : FitSettings
        Weights of the terms.
    allowed : float
        Largest mean distance from the patient, mm.
    least : float
        Jacobian ratio that every element should reach.
    progress : callable
        Called with the share of a round that is done; may raise to cancel.

    Returns
    -------
    Optimized
    """
    energy = Energy(mesh, target, settings)

    def fit(start: HexMesh, weight: Array, within: bool = True) -> HexMesh:
        q = minimize(
            energy.degrees(start),
            energy.terms(weight, regularization),
            energy.assembler,
            feasible=(lambda q: certify(energy.shape(q)).all_valid) if within else lambda q: True,
            progress=progress,
        )
        return energy.shape(q)

    regularization = 1.0
    for rounds, spreading in ((ROUNDS, False), (MORE_ROUNDS, True)):
        weight, fitted, valid = np.ones(mesh.n_elements), mesh, False
        for number in range(1, rounds + 1):
            fitted = fit(fitted, weight, within=False)
            invalid = ~certify(fitted).valid
            valid = not invalid.any()
            if valid:
                break
            growth = np.where(invalid, number * GROWTH, 1)
            if spreading:
                beside = _neighbors(mesh) @ invalid & ~invalid
                growth = np.where(beside, np.sqrt(number * GROWTH), growth)
            weight = growth * weight
        if valid:
            break
    regularized = weight > 1
    if not valid:
        return Optimized(fitted, regularized, valid)
    if weight.max() > GROWTH:
        weight = np.where(regularized, GROWTH, 1)
        fitted = fit(fitted, weight)
    for _ in range(RELAXED_ROUNDS if np.isfinite(allowed) else 0):
        reached = misfit(fitted, target)
        if reached <= allowed:
            break
        regularization *= max(MOST_RELAXED, (AIMED_MISFIT * allowed / reached) ** RELAXING)
        fitted = fit(fitted, weight)
    fitted = raise_ratios(fitted, least, weight, fit)
    return Optimized(fitted, regularized, valid)


def _neighbors(mesh: HexMesh) -> NDArray[np.bool_]:
    """Which elements (e, e) share a node."""
    nodes = mesh.topology.nodes
    ends = np.zeros((len(nodes), nodes.max() + 1), dtype=np.intp)
    ends[np.arange(len(nodes))[:, None], nodes] = 1
    return np.asarray(ends @ ends.T > 0)


def raise_ratios(
    mesh: HexMesh,
    least: float,
    weight: Array,
    fit: Callable[[HexMesh, Array], HexMesh],
) -> HexMesh:
    """Fit a mesh again until all elements reach a Jacobian ratio, or as far as they can.

    Parameters
    ----------
    mesh : HexMesh
        Valid; mm, world (LPS).
    least : float
        Jacobian ratio (paper, equation 3.1) that every element should reach.
    weight : (e,) float64
        Weights of the elements that it was fitted with.
    fit : callable
        Fits a mesh with weights of its elements, and leaves it valid.

    Returns
    -------
    HexMesh
        Of all rounds, the one whose poorest element is best; `mesh` itself if it has none so poor.
    """
    best = mesh
    for _ in range(RAISED_ROUNDS):
        ratio = jacobian_ratio(mesh)
        if ratio.min() >= least:
            break
        weight = np.clip((AIM * least / ratio) ** 2, 1, MOST_RAISED) * weight
        mesh = fit(mesh, weight)
        best = max(best, mesh, key=lambda m: float(jacobian_ratio(m).min()))
    return best
