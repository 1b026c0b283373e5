"""Warping: carry a mesh along a deformation, by its continuum (paper, section 2.3) or its nodes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from heartgen.mesh.corner_parameters import CORNERS, PARAMETERS, corner_parameters
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.projection import projector

GAUSS = (8, 8, 5)
"""Quadrature points per element along xi1, xi2, xi3: fine enough for the finest node grid."""

NEAR_NODE = 0.005
"""Distance from a node at which the gradient of a deformation is taken, over the mesh's extent."""


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


def warp_nodes(
    mesh: HexMesh, deformation: Callable[[NDArray[np.float64]], NDArray[np.float64]]
) -> HexMesh:
    """Move every node of a mesh by itself, and turn its derivatives as space turns there.

    What `warp` is better than (Lamata et al. 2011): between the nodes the deformation is not
    looked at, nor how its gradient changes. Where elements disagree on a degree of freedom, it is
    the best fit to them. An affine map is reproduced.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    deformation : callable
        As of `warp`.

    Returns
    -------
    HexMesh
        Same topology.
    """
    rows = mesh.topology.functionals(corner_parameters().reshape(CORNERS * PARAMETERS, -1))
    parameters = np.asarray(rows @ mesh.dofs).reshape(-1, PARAMETERS, 3)
    places = parameters[:, 0]
    steps = NEAR_NODE * float(np.ptp(places, axis=0).max()) * np.eye(3)
    ahead, behind = (deformation((places[:, None] + s).reshape(-1, 3)) for s in (steps, -steps))
    gradient = (ahead - behind).reshape(-1, 3, 3) / (2 * steps[0, 0])
    moved = np.matmul(parameters, gradient)
    moved[:, 0] = deformation(places)
    factor = spla.splu(sp.csc_array(rows.T @ rows))
    return mesh.with_dofs(factor.solve(np.asarray(rows.T @ moved.reshape(-1, 3))))
