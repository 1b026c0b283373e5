"""The inside of the wall, moved for the elements' sake while every surface stays.

The enhancement (paper, section 2.4) makes transmural lines straight. Here they may bend: all
degrees of freedom on which no surface depends are optimised for even Jacobians and right angles.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.freedom import Freedom
from heartgen.mesh.hexmesh import COEFFICIENTS, HexMesh, Topology
from heartgen.mesh.surfaces import face_coefficients
from heartgen.mesh.validity import certify_jacobian
from heartgen.refinement.assembly import Assembler, Blocks
from heartgen.refinement.elements import Care, Elements, usual_care
from heartgen.refinement.poorest import raise_poorest

SPREAD, SHEAR, SHEAR_OF_TWO = 45.0, 6.0, 40.0
"""Weights of the variance of log det J, and of the squared cosines between directions, in meshes of
one ventricle and of two: so much shear that the right angles of straight walls are kept."""

STEPS = 6
"""Of Gauss-Newton."""

BENDING = 0.05
"""Of each step; as for the surfaces."""

SHORTEST = 1e-3
"""Step below which none is made."""

LEAST_SHARE = 0.1
"""Of the movement, below which a mesh that would fold is left as it is."""


def relax(
    mesh: HexMesh, least: float = 0.0, progress: Callable[[float], None] = lambda done: None
) -> HexMesh:
    """Optimise what lies between the surfaces of a mesh for the quality of its elements.

    Parameters
    ----------
    mesh : HexMesh
        Proven valid; mm, world (LPS).
    least : float
        Jacobian ratio below which elements get more weight, as far as that helps.
    progress : callable
        Called with the share of the rounds that is done; may raise to cancel.

    Returns
    -------
    HexMesh
        Same topology, proven valid; the degrees of freedom of all surfaces are bit-equal.
    """
    relaxed = _relaxed(mesh, usual_care(mesh.n_elements))
    return raise_poorest(relaxed, least, _relaxed, progress)


def _relaxed(mesh: HexMesh, care: Care) -> HexMesh:
    """The mesh, moved as far as it stays proven valid."""
    moved = _optimised(mesh, care)
    share = 1.0
    while share > LEAST_SHARE:
        mixed = mesh.with_dofs(mesh.dofs + share * (moved - mesh.dofs))
        if certify_jacobian(mixed).all_valid:
            return mixed
        share /= 2
    return mesh


def _optimised(mesh: HexMesh, care: Care) -> NDArray[np.float64]:
    """Degrees of freedom after Gauss-Newton steps."""
    shear = SHEAR_OF_TWO if "rv_endo" in mesh.topology.surfaces else SHEAR
    freedom = Freedom(mesh.topology, bent=True)
    inner = np.ones(freedom.n + 1, dtype=bool)
    inner[_of_surfaces(mesh.topology)] = False
    movable = np.where(inner[freedom.dofs], freedom.dofs, freedom.n)
    elements = Elements(freedom, mesh.topology, care)
    assembler = Assembler([movable], freedom.n)

    def energy(q: NDArray[np.float64], oblique: NDArray[np.float64]) -> float:
        state = elements.state(q, unfolding=False)
        return SPREAD * elements.spread(state) + shear * elements.shear(state, oblique)

    q = mesh.dofs
    for _ in range(STEPS):
        state = elements.state(q)
        oblique = elements.oblique(state)
        start = energy(q, oblique)
        if not np.isfinite(start):
            break
        blocks = elements.blocks(q, state, SPREAD, shear, BENDING)
        direction = assembler.solve([Blocks(movable, blocks.matrix, blocks.gradient)])
        length = 1.0
        while not energy(q + length * direction, oblique) < start:
            length /= 2
            if length < SHORTEST:
                return q
        q = q + length * direction
    return q


def _of_surfaces(topology: Topology) -> NDArray[np.intp]:
    """Degrees of freedom on which the surfaces depend."""
    faces = topology.external
    rows = COEFFICIENTS * faces[:, :1] + face_coefficients()[faces[:, 1]]
    return np.unique(topology.extraction[rows.ravel()].indices)
