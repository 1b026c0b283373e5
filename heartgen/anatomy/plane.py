"""A plane in the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane in the world.

    Attributes
    ----------
    origin : (3,) float64
        A point of the plane, mm, LPS.
    normal : (3,) float64
        Unit normal, from apex to base.
    """

    origin: NDArray[np.float64]
    normal: NDArray[np.float64]

    def height(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Signed distance of (n, 3) points, mm, positive beyond the base: (n,).

        Parameters
        ----------
        points : (n, 3) float64
            mm, in the frame of the plane.
        """
        return np.asarray((points - self.origin) @ self.normal)

    def shifted(self, distance: float) -> Plane:
        """Return the parallel plane `distance` mm towards the base.

        Parameters
        ----------
        distance : float
            mm.
        """
        return Plane(self.origin + distance * self.normal, self.normal)
