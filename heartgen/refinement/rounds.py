"""Rounds of refinement: until every element is proven valid, and quality has cost no accuracy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.validity import certify_jacobian
from heartgen.refinement.descent import Weights, refine
from heartgen.refinement.distances import misfit
from heartgen.refinement.elements import Care, usual_care
from heartgen.refinement.patient import Patient
from heartgen.refinement.poorest import raise_poorest

REMEDIES = {"emphasis": 6, "firmness": 9}
"""What elements that are not proven valid get more of from round to round, and for how many.
Emphasis costs little accuracy, but where many neighbours fold it only passes the folds around."""

GROWTH = 2.0
"""Factor by which they get more after the first round; after the second it is twice that, after
the third three times, ..."""

CLOSER_ROUNDS = 2
"""Rounds in which a mesh that took much care is fitted again with little."""

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
    least: float = 0.0,
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
    least : float
        Jacobian ratio below which elements get more weight in the end, as far as that helps.
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

    def refined(start: HexMesh, care: Care, weights: Weights, within: bool = False) -> HexMesh:
        return refine(
            start, patient, weights, care=care, anchor=mesh, within=within, progress=progress
        )

    best, care, valid = _made_valid(mesh, lambda start, care: refined(start, care, weights))
    if valid and care.most > GROWTH:
        # Out of the folds, much care is needless: the certificate keeps the mesh from going back.
        care = care.eased(GROWTH)
        for _ in range(CLOSER_ROUNDS):
            best = refined(best, care, weights, within=True)
    reached = misfit(best, patient) if np.isfinite(allowed) else 0.0
    for _ in range(EASIER_ROUNDS - 1):
        if not valid or reached <= allowed:
            break
        eased = max(EASIEST, (MARGIN * allowed / reached) ** EASING)
        weights = replace(weights, spread=weights.spread * eased)
        easier = refined(best, care, weights, within=True)
        closer = misfit(easier, patient)
        if reached - closer < WORTHWHILE * (reached - allowed):
            break
        best, reached = easier, closer
    if valid:
        best = raise_poorest(
            best, least, lambda start, care: refined(start, care, weights, within=True)
        )
    return best, care.treated, valid


def _made_valid(
    mesh: HexMesh, refined: Callable[[HexMesh, Care], HexMesh]
) -> tuple[HexMesh, Care, bool]:
    """Refined mesh, the care that it took, and whether it is valid.

    Each remedy starts anew: what much of another has done to the neighbours is hard to undo.
    """
    usual = usual_care(mesh.n_elements)
    first = refined(mesh, usual)
    folded = ~certify_jacobian(first).valid
    if not folded.any():
        return first, usual, True
    for remedy, rounds in REMEDIES.items():
        mesh, care, left = first, usual, folded
        for number in range(1, rounds + 1):
            care = care.with_more(remedy, np.where(left, number * GROWTH, 1))
            mesh = refined(mesh, care)
            left = ~certify_jacobian(mesh).valid
            if not left.any():
                return mesh, care, True
    return mesh, care, False
