"""The poorest elements, which a mean does not see: those below a least quality weigh more."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.refinement.elements import Care, usual_care

ROUNDS = 6
"""Rounds in which they may get more weight."""

MOST = 4.0
"""Factor by which an element's weight grows in a round, at most."""

AIM = 1.1
"""Ratio aimed at, over the least: the closer they are to it, the less they would still gain."""


def raise_poorest(
    mesh: HexMesh,
    least: float,
    refined: Callable[[HexMesh, Care], HexMesh],
    progress: Callable[[float], None] = lambda done: None,
) -> HexMesh:
    """Refine a mesh again until all elements reach a Jacobian ratio, or as far as they can.

    Parameters
    ----------
    mesh : HexMesh
        Proven valid; mm, world (LPS).
    least : float
        Jacobian ratio (paper, equation 3.1) that every element should reach.
    refined : callable
        Refines a mesh with the care that its elements get, and leaves it proven valid.
    progress : callable
        Called with the share of the rounds that is done; may raise to cancel.

    Returns
    -------
    HexMesh
        Of all rounds, the one whose poorest element is best; `mesh` itself if it has none so poor.
    """
    best, care = mesh, usual_care(mesh.n_elements)
    for done in range(ROUNDS):
        progress(done / ROUNDS)
        ratio = jacobian_ratio(mesh)
        if ratio.min() >= least:
            break
        care = care.with_more("emphasis", np.clip((AIM * least / ratio) ** 2, 1, MOST))
        mesh = refined(mesh, care)
        best = max(best, mesh, key=lambda m: float(jacobian_ratio(m).min()))
    return best
