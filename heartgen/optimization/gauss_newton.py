"""The driver: Gauss-Newton steps on a sum of terms, one sparse system each, with a line search."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from heartgen.optimization.assembly import Assembler
from heartgen.optimization.settings import CONVERGED, SHORTEST, STEPS
from heartgen.optimization.terms import Model, Term


def minimize(
    q: NDArray[np.float64],
    terms: Sequence[Term],
    assembler: Assembler,
    steps: int = STEPS,
    feasible: Callable[[NDArray[np.float64]], bool] = lambda q: True,
    progress: Callable[[float], None] = lambda done: None,
) -> NDArray[np.float64]:
    """Minimize the sum of some terms.

    Parameters
    ----------
    q : (n, 3) float64
        Free degrees of freedom to start from, mm, world (LPS).
    terms : sequence of Term
        What is summed up.
    assembler : Assembler
        Of the terms' blocks.
    steps : int
        Gauss-Newton steps at most.
    feasible : callable
        Whether free degrees of freedom may be stepped to.
    progress : callable
        Called with the share of the steps that is done; may raise to cancel.

    Returns
    -------
    (n, 3) float64
        Feasible if `q` is.
    """
    for step in range(steps):
        progress(step / steps)
        models = [term.near(q) for term in terms]
        direction = assembler.solve([model.blocks for model in models])
        start, length = _energy(models, q), 1.0
        while True:
            candidate = q + length * direction
            reached = _energy(models, candidate)
            # A step to where the energy is not a number is no descent, either.
            if reached < start and feasible(candidate):
                break
            length /= 2
            if length < SHORTEST:
                return q
        q = candidate
        if reached > (1 - CONVERGED) * start:
            break
    return q


def _energy(models: Sequence[Model], q: NDArray[np.float64]) -> float:
    """Sum of the terms."""
    return sum(model.value(q) for model in models)
