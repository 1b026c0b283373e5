"""An energy is a list of terms, each a sum of squares that says how it changes near a mesh."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from heartgen.optimization.assembly import Blocks


@dataclass(frozen=True, eq=False)
class Model:
    """A term near a mesh.

    Attributes
    ----------
    value : callable
        The term at free degrees of freedom (n, 3). What was fixed at the mesh (matches, weights,
        tangent planes) stays so; infinite where the term is not defined.
    blocks : Blocks
        Its Gauss-Newton matrix and gradient at the mesh itself.
    """

    value: Callable[[NDArray[np.float64]], float]
    blocks: Blocks


class Term(Protocol):
    """One term of an energy."""

    def near(self, q: NDArray[np.float64]) -> Model:
        """Return the term near a mesh.

        Parameters
        ----------
        q : (n, 3) float64
            Its free degrees of freedom, mm, world (LPS).

        Returns
        -------
        Model
        """
