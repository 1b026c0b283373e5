"""What lies between the surfaces, moved for the elements' sake while every surface stays.

The enhancement (paper, section 2.4) makes transmural lines straight. Here they may bend: all
degrees of freedom on which no surface depends are optimized for even Jacobians and right angles.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.dof_map import DofMap
from heartgen.mesh.hexmesh import COEFFICIENTS, HexMesh, Topology
from heartgen.mesh.surface_faces import face_coefficients
from heartgen.mesh.validity import certify
from heartgen.optimization.assembly import Assembler
from heartgen.optimization.gauss_newton import minimize
from heartgen.optimization.policy import raise_ratios
from heartgen.optimization.quality import EvenJacobians, RightAngles
from heartgen.optimization.settings import INTERIOR_STEPS, FitSettings, weights_of


def curve_transmural_lines(
    mesh: HexMesh, least: float = 0.0, progress: Callable[[float], None] = lambda done: None
) -> HexMesh:
    """Optimize what lies between the surfaces of a mesh for the quality of its elements.

    Parameters
    ----------
    mesh : HexMesh
        Valid; mm, world (LPS).
    least : float
        Jacobian ratio below which elements get more weight, as far as that helps.
    progress : callable
        Called with the share of a round that is done; may raise to cancel.

    Returns
    -------
    HexMesh
        Same topology, valid; the degrees of freedom of all surfaces are bit-equal.
    """
    topology = mesh.topology
    even, angles = weights_of(topology).interior
    dof_map = DofMap(topology, bent=True)
    held = np.zeros(dof_map.n, dtype=bool)
    held[_of_surfaces(topology)] = True
    assembler = Assembler([dof_map.dofs], dof_map.n, held)

    def fit(start: HexMesh, weight: NDArray[np.float64]) -> HexMesh:
        per_element = weight / topology.n_elements
        of_even = even * per_element
        of_even[topology.collapsed[:, 0]] *= FitSettings.pole
        terms = (
            EvenJacobians(dof_map, topology, of_even),
            RightAngles(dof_map, angles * per_element),
        )
        return start.with_dofs(
            minimize(
                start.dofs,
                terms,
                assembler,
                INTERIOR_STEPS,
                lambda q: certify(start.with_dofs(q)).all_valid,
                progress,
            )
        )

    usual = np.ones(topology.n_elements)
    return raise_ratios(fit(mesh, usual), least, usual, fit)


def _of_surfaces(topology: Topology) -> NDArray[np.intp]:
    """Degrees of freedom on which the surfaces depend."""
    faces = topology.external
    rows = COEFFICIENTS * faces[:, :1] + face_coefficients()[faces[:, 1]]
    return np.unique(topology.extraction[rows.ravel()].indices)
