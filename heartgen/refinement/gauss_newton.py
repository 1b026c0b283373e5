"""The driver: Gauss-Newton steps on a sum of terms, one sparse system each, with a line search."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from heartgen.refinement.assembly import Assembler
from heartgen.refinement.terms import Term

SHORTEST = 2.0**-10
"""Share of a step below which none is made."""

CONVERGED = 2e-3
"""Relative decrease of the energy in a step below which no further one is made."""


def minimize(
    q: NDArray[np.float64],
    terms: Sequence[Term],
    assembler: Assembler,
    steps: int,
    feasible: Callable[[NDArray[np.float64]], bool] = lambda q: True,
    progress: Callable[[float], None] = lambda done: None,
) -> NDArray[np.float64]:
    """Minimize the sum of some terms.

    Parameters
    ----------
    q : (n, 3) float64
        Free degrees of freedom to start from, mm, world (LPS).
    terms : sequence of Term
    assembler : Assembler
        Of the terms' blocks.
    steps : int
        Gauss-Newton steps.
    feasible : callable
        Whether free degrees of freedom may be stepped to.
    progress : callable
        Called with the share of the steps that is done; may raise to cancel.

    Returns
    -------
    (n, 3) float64
        Of no greater energy than `q`, and feasible if `q` is.
    """
    for step in range(steps):
        progress(step / steps)
        models = [term.near(q) for term in terms]
        direction = assembler.solve([model.blocks for model in models])

        def energy(
            q: NDArray[np.float64], models: Sequence = models  # type: ignore[type-arg]
        ) -> float:
            return sum(model.value(q) for model in models)

        start, length = energy(q), 1.0
        # A step to where the energy is not a number is no descent, either.
        while not (energy(q + length * direction) < start and feasible(q + length * direction)):
            length /= 2
            if length < SHORTEST:
                return q
        q = q + length * direction
        if energy(q) > (1 - CONVERGED) * start:
            return q
    return q
