"""Gauss-Newton on the free degrees of freedom: the whole energy, one sparse system a step.

Registration to a voxel image and projection leave accuracy and quality on the table. Here the
degrees of freedom of the mesh's surfaces are moved, the inside following in straight lines across
the wall. What is minimised: the squared distances between mesh and patient in both directions; the
mean over the elements of the variance of log det J, which is zero for elements of one constant
Jacobian and infinite for folded ones, so that it is its own barrier; the cosines between the
elements' directions, so that even Jacobians are not bought with shear; and the bending of each
step and how far material points of the left ventricle move, so that nodes slide but do not drift.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.biventricular import right_apex
from heartgen.mesh.freedom import FaceFreedom, Freedom
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.validity import certify_jacobian
from heartgen.options import Insertion
from heartgen.refinement.anchor import DRIFT, Anchor, anchored
from heartgen.refinement.assembly import Assembler
from heartgen.refinement.distances import (
    Distances,
    changes,
    distance_blocks,
    from_patient,
    to_patient,
)
from heartgen.refinement.elements import Care, Elements, State, usual_care
from heartgen.refinement.patient import Patient

STEPS = 10

FULL_STEPS = 2
"""Last steps that are made against all points of the patient's surfaces, not few."""

SCALE = 0.3
"""Distance that weighs as much as one unit of the quality terms, voxels."""

TRIES = 10
"""Tries of a step, each shorter than the one before, after which none is made."""

HELD_BACK, EMPHASIS = 0.25, 4.0
"""Share of a step that is left to elements that would fold under it; and, where none was found,
factor by which their quality counts for more in those that follow."""

QUALITY = (1.7, 1.3, 1.0, 0.55, 0.25)
"""Weight of quality against accuracy for each level of detail, of both ventricles..."""

QUALITY_OF_ONE = (1.36, 1.16, 0.91, 0.52, 0.28)
"""...of the left one alone, whose registration is so close that more would lose against it..."""

QUALITY_OF_SLICES = (1.0, 0.8, 0.6, 0.38, 0.28)
"""...and of the left one in a stack of slices."""


@dataclass(frozen=True)
class Weights:
    """Weights of the terms against the mean squared distances over the squared scale.

    Attributes
    ----------
    spread : float
        Variance of log det J.
    shear : float
        Squared cosines between the elements' directions, over the squared scaled Jacobian.
    bending : float
        Squared second derivatives of a step over the elements' squared sizes.
    drift : float
        Squared movement beyond the leeway, in units of `anchor.DRIFT`.
    stiffening : float
        Power of the excess over the farthest movement by which a face's movement weighs more.
    cut : float
        Distances at the base and at an apical hole, relative to those elsewhere.
    right_apex : float
        Distances in the elements at the right ventricle's apex, relative to those elsewhere.
    apex : float
        Distances in the elements around the apex, where the wall turns within one of them.
    """

    spread: float = 70.0
    shear: float = 6.25
    bending: float = 0.05
    drift: float = 40.0
    stiffening: float = 2.0
    cut: float = 5.0
    right_apex: float = 1.0
    apex: float = 3.0


SHEARED = Weights(spread=30.0, shear=38.0)
"""Weights for two ventricles: the corners of the right one would be paid for with shear."""

USUAL_COLUMNS, WIDER = 12, 2.8
"""Elements around the left ventricle that those are for, and power of their width with which the
weights grow where there are fewer: wide elements bend more, and accuracy would cost quality."""

ROUNDED = 16.0
"""Weight of distances at the right ventricle's apex that draws the insertion line, square in the
template, onto the round one of the anatomy: its elements alone would rather stay square."""

SPARSE = Weights(spread=85.0, shear=52.0)
"""Weights for two ventricles in a stack of slices. Those are met closely whatever lies between:
there is room for better elements."""

LOOSE = 0.0
"""Stiffening in a stack, whose registration is too coarse to be an anchor."""


def weights_for(
    lod: int,
    quality: float,
    biventricular: bool = False,
    stack: bool = False,
    insertion: Insertion = "rounded",
    columns: int = USUAL_COLUMNS,
) -> Weights:
    """Weights for a level of detail.

    Parameters
    ----------
    lod : int
        Level of detail, 1 to 5.
    quality : float
        The quality dial; 1 is the level's own weight.
    biventricular : bool
        Whether the mesh has a right ventricle.
    stack : bool
        Whether it is fitted to slices far apart.
    insertion : {"rounded", "squared"}
        Course of its insertion line around its apex.
    columns : int
        Elements around the left ventricle.

    Returns
    -------
    Weights
    """
    if not biventricular:
        plain, of_width = Weights(), 1.0
        of_level = QUALITY_OF_SLICES if stack else QUALITY_OF_ONE
    elif stack:
        plain, of_level, of_width = SPARSE, QUALITY, 1.0
    else:
        plain, of_level = SHEARED, QUALITY
        of_width = max(1.0, USUAL_COLUMNS / columns) ** WIDER
    factor = of_level[lod - 1] * quality * of_width
    return replace(
        plain,
        spread=factor * plain.spread,
        shear=factor * plain.shear,
        stiffening=LOOSE if stack else plain.stiffening,
        right_apex=ROUNDED if insertion == "rounded" else 1.0,
    )


def refine(
    mesh: HexMesh,
    patient: Patient,
    weights: Weights,
    steps: int = STEPS,
    care: Care | None = None,
    anchor: HexMesh | None = None,
    within: bool = False,
    progress: Callable[[float], None] = lambda done: None,
) -> HexMesh:
    """Optimise a mesh for accuracy and quality.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS). Its surfaces are the start; the inside is straightened.
    patient : Patient
    weights : Weights
    steps : int
        Gauss-Newton steps.
    care : Care, optional
        What keeps elements that would fold from it.
    anchor : HexMesh, optional
        The mesh whose material points are to be kept; by default `mesh` itself.
    within : bool
        Whether no step may leave the meshes that are proven valid, of which `mesh` is one.
    progress : callable
        Called with the share of the work done; may raise to cancel.

    Returns
    -------
    HexMesh
        Same topology, straight across the wall.
    """
    freedom = Freedom(mesh.topology)
    faces = FaceFreedom(freedom, mesh.topology)
    care = care or usual_care(mesh.n_elements)
    elements = Elements(freedom, mesh.topology, care)
    around = _around(freedom, care.firmness)
    trust = 1 / around
    trust[right_apex(mesh.topology)] *= weights.right_apex
    trust[mesh.topology.index[:, 2] == 0] *= weights.apex
    trust = trust[faces.faces[:, 0]]
    assembler = Assembler([freedom.dofs, faces.dofs, faces.dofs], freedom.n)
    per_square = 1 / (SCALE * patient.voxel) ** 2
    per_drift = weights.drift / (DRIFT * patient.length) ** 2
    kept = anchored(anchor or mesh, faces, patient, weights.stiffening, weights.cut, around)

    def shape(q: NDArray[np.float64]) -> HexMesh:
        return mesh.with_dofs(np.asarray(freedom.straight @ q))

    def outwards(q: NDArray[np.float64]) -> Distances:
        return to_patient(shape(q), faces, patient, weights.cut).trusted(trust)

    q = mesh.dofs[freedom.free]
    outward = outwards(q)
    for step in range(steps):
        progress(step / steps)
        points = patient.few if step < steps - FULL_STEPS else patient.points
        inward = from_patient(shape(q), faces, points, patient.voxel).trusted(trust)
        state = elements.state(q)
        kept = kept.tightened(shape(q))
        blocks = [
            elements.blocks(q, state, weights.spread, weights.shear, weights.bending),
            distance_blocks(faces, [outward, inward], per_square),
            distance_blocks(faces, [kept.drift(shape(q))], per_drift),
        ]
        direction = assembler.solve(blocks)
        stiff, oblique = weights.bending * elements.stiff(state), elements.oblique(state)

        def energy(
            q: NDArray[np.float64],
            state: State,
            out: Distances,
            back: NDArray[np.float64],
            kept: Anchor = kept,
            weight: NDArray[np.float64] = inward.weight,
            stiff: NDArray[np.float64] = stiff,
            oblique: NDArray[np.float64] = oblique,
        ) -> float:
            return (
                per_square * (out.mean_square + float(weight @ back**2))
                + per_drift * kept.drift(shape(q)).mean_square
                + elements.bent(q, stiff)
                + weights.spread * elements.spread(state)
                + weights.shear * elements.shear(state, oblique)
            )

        start, length = energy(q, state, outward, inward.value), 1.0
        unfolding = bool(state.lift.any())
        change, emphasis = changes(faces, inward, direction), np.ones(mesh.n_elements)
        for _ in range(TRIES):
            candidate = q + length * direction
            out, back = outwards(candidate), inward.value + length * change
            value = energy(candidate, elements.state(candidate, unfolding), out, back)
            if not value < start:  # nor is a step made to where it is not a number
                length /= 2
            elif within and (folded := ~certify_jacobian(shape(candidate)).valid).any():
                # The elements that would fold hold themselves back, and not all the others.
                direction[np.setdiff1d(freedom.dofs[folded], freedom.n)] *= HELD_BACK
                change = changes(faces, inward, direction)
                emphasis[folded] = EMPHASIS
            else:
                q, outward = candidate, out
                break
        else:
            elements.emphasise(emphasis)
    return shape(q)


def _around(freedom: Freedom, firmness: NDArray[np.float64]) -> NDArray[np.float64]:
    """Greatest firmness (e,) among each element and those it shares degrees of freedom with."""
    of_dof = np.zeros(freedom.n + 1)
    np.maximum.at(of_dof, freedom.dofs, firmness[:, None])
    of_dof[-1] = 0
    return np.asarray(of_dof[freedom.dofs].max(1))
