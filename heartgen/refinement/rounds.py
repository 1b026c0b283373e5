"""Rounds of refinement: until every element is proven valid, and quality has cost no accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.validity import certify
from heartgen.refinement.descent import Weights, refine
from heartgen.refinement.distances import misfit
from heartgen.refinement.elements import Care, usual_care
from heartgen.refinement.patient import Patient

REMEDIES = {"emphasis": 4, "firmness": 9}
"""What elements that are not proven valid get more of from round to round, and for how many.
Emphasis costs little accuracy, but where many neighbours fold it only passes the folds around."""

GROWTH = 2.0
"""Factor by which they get more after the first round; after the second it is twice that, after
the third three times, ..."""

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
    allowed: float = np.inf,
    progress: Callable[[float], None] = lambda done: None,
) -> tuple[HexMesh, int, bool]:
    """Refine a mesh until it is proven valid.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    patient : Patient
    weights : Weights
    allowed : float
        Misfit, mm, above which quality gets less weight.
    progress : callable
        Called with the share of a round that is done; may raise to cancel.

    Returns
    -------
    refined : HexMesh
        Same topology, straight across the wall.
    treated : int
        Elements that got more care than the usual, not to fold.
    valid : bool
        Whether all elements are proven valid.
    """
    care = usual_care(mesh.n_elements)
    anchor = mesh
    mesh, care, valid = _made_valid(mesh, patient, weights, care, anchor, progress)
    reached = misfit(mesh, patient) if np.isfinite(allowed) else 0.0
    for _ in range(EASIER_ROUNDS - 1):
        if not valid or reached <= allowed:
            break
        eased = max(EASIEST, (MARGIN * allowed / reached) ** EASING)
        weights = replace(weights, spread=weights.spread * eased)
        easier, more, proven = _made_valid(mesh, patient, weights, care, anchor, progress)
        closer = misfit(easier, patient)
        if not proven or reached - closer < WORTHWHILE * (reached - allowed):
            break
        mesh, reached, care = easier, closer, more
    return mesh, care.treated, valid


def _made_valid(
    mesh: HexMesh,
    patient: Patient,
    weights: Weights,
    care: Care,
    anchor: HexMesh,
    progress: Callable[[float], None],
) -> tuple[HexMesh, Care, bool]:
    """Refined mesh, the care that it took, and whether it is valid.

    Each remedy starts anew: what much of another has done to the neighbours is hard to undo.
    """
    refined = refine(mesh, patient, weights, care=care, anchor=anchor, progress=progress)
    folded = ~certify(refined).valid
    if not folded.any():
        return refined, care, True
    for remedy, rounds in REMEDIES.items():
        mesh, more, left = refined, care, folded
        for number in range(1, rounds + 1):
            more = more.with_more(remedy, np.where(left, number * GROWTH, 1))
            mesh = refine(mesh, patient, weights, care=more, anchor=anchor, progress=progress)
            left = ~certify(mesh).valid
            if not left.any():
                return mesh, more, True
    return mesh, more, False
