"""Rounds of refinement: until every element is proven valid, and quality has cost no accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.validity import certify
from heartgen.refinement.descent import Weights, refine
from heartgen.refinement.distances import misfit
from heartgen.refinement.patient import Patient

FIRMER = 2.0
"""Factor by which an element that is not proven valid becomes firmer after the first round; after
the second it is twice that, after the third three times, ..."""

FIRMER_ROUNDS = 10
"""Rounds in which elements may become firmer."""

EASIER_ROUNDS = 4
"""Rounds in which quality may get less weight than in the round before."""

EASING = 7.0
"""Power of the misfit that the weight of quality follows: halving it takes a tenth of the misfit.
In proportion to the excess rather than in steps, so that a level of detail whose misfit is barely
too high is not refined more closely than the level above it."""

EASIEST = 0.5
"""Smallest weight of quality, over that of the round before."""

WORTHWHILE = 0.25
"""Least share of the excess that easing must take: what firm elements miss, quality cannot give."""

MARGIN = 0.995
"""Misfit aimed at, over that allowed."""


def refine_in_rounds(
    mesh: HexMesh,
    patient: Patient,
    weights: Weights,
    no_worse: float = np.inf,
    progress: Callable[[float], None] = lambda done: None,
) -> tuple[HexMesh, int, bool]:
    """Refine a mesh until it is proven valid.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    patient : Patient
    weights : Weights
    no_worse : float
        Misfit, over that of the mesh given, above which quality gets less weight.
    progress : callable
        Called with the share of a round that is done; may raise to cancel.

    Returns
    -------
    refined : HexMesh
        Same topology, straight across the wall.
    firmer : int
        Elements that had to be fitted less closely.
    valid : bool
        Whether all elements are proven valid.
    """
    firmness = np.ones(mesh.n_elements)
    anchor = mesh
    enough = no_worse * misfit(mesh, patient) if np.isfinite(no_worse) else np.inf
    mesh, valid = _made_valid(mesh, patient, weights, firmness, anchor, progress)
    reached = misfit(mesh, patient) if np.isfinite(enough) else 0.0
    for _ in range(EASIER_ROUNDS - 1):
        if not valid or reached <= enough:
            break
        eased = max(EASIEST, (MARGIN * enough / reached) ** EASING)
        weights = replace(weights, spread=weights.spread * eased)
        firmer = firmness.copy()
        easier, proven = _made_valid(mesh, patient, weights, firmer, anchor, progress)
        closer = misfit(easier, patient)
        if not proven or reached - closer < WORTHWHILE * (reached - enough):
            break
        mesh, reached, firmness = easier, closer, firmer
    return mesh, int(np.sum(firmness > 1)), valid


def _made_valid(
    mesh: HexMesh,
    patient: Patient,
    weights: Weights,
    firmness: NDArray[np.float64],
    anchor: HexMesh,
    progress: Callable[[float], None],
) -> tuple[HexMesh, bool]:
    """Refined mesh, and whether it is valid; elements that are not become firmer, in place."""
    for number in range(1, FIRMER_ROUNDS + 1):
        mesh = refine(mesh, patient, weights, firmness=firmness, anchor=anchor, progress=progress)
        valid = certify(mesh).valid
        if valid.all():
            return mesh, True
        firmness[~valid] *= number * FIRMER
    return mesh, False
