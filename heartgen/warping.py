"""Variational warping: carry a mesh along a deformation (paper, section 2.3)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.projection import projector

GAUSS = (8, 8, 5)
"""Quadrature points per element along xi1, xi2, xi3: fine enough for the finest node grid."""


def warp(
    mesh: HexMesh, deformation: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> HexMesh:
    """Move the whole continuum of a mesh, not only its nodes.

    Minimizes ``int |x_h(xi) - phi(x(xi))|^2 dV`` over the degrees of freedom (Lamata et al. 2011).
    An affine map is reproduced exactly.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    deformation : callable
        Maps points (m, 3) to deformed points (m, 3), mm, world (LPS).

    Returns
    -------
    HexMesh
        Same topology.
    """
    projection = projector(mesh, GAUSS)
    return mesh.with_dofs(projection.project(deformation(projection.points)))
