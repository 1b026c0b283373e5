"""How a heart moves: strains of the left ventricle between meshes with corresponding points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.fields.frames import frames_at
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.quadrature import gauss_cube

Array = NDArray[np.float64]

GAUSS = 4
"""Points per direction at which strains are averaged."""


RIGHT = ("septum", "right ventricle")
"""Parts that tell where the wall opens into the right ventricle."""


@dataclass(frozen=True)
class Strains:
    """Mean relative change of length of the left ventricle's wall, with the septum.

    Attributes
    ----------
    longitudinal, circumferential, radial : float
        Along the directions of the wall before; negative where it shortens.
    """

    longitudinal: float
    circumferential: float
    radial: float


def global_strains(before: HexMesh, after: HexMesh) -> Strains:
    """Strains from one mesh to another in which the same local coordinates are the same tissue.

    With F the deformation gradient and d a direction of the wall in the first mesh, |F d| - 1 is
    averaged over the volume of the wall there. Meshes are fitted to surfaces: motion along these,
    such as torsion, is not seen.

    Parameters
    ----------
    before, after : HexMesh
        Of the same topology.

    Returns
    -------
    Strains

    Raises
    ------
    MeshError
        If their elements do not correspond.
    """
    if not corresponding(before, after):
        raise MeshError(
            "strains need meshes whose elements correspond, and these have different numbers of "
            "elements, or the right ventricle begins at different ones"
        )
    xi, weights = gauss_cube((GAUSS,) * 3)
    gradient = after.gradient(xi) @ np.linalg.inv(before.gradient(xi))
    stretch = np.linalg.norm(gradient @ frames_at(before, xi), axis=-2)
    share = np.abs(determinants(before, xi)) * weights
    share[before.topology.parts.get("right ventricle", [])] = 0
    around, along, across = np.einsum("eqd,eq->d", stretch, share) / share.sum() - 1
    return Strains(float(along), float(around), float(across))


def corresponding(one: HexMesh, other: HexMesh) -> bool:
    """Whether two meshes have the same elements in the same places and parts."""
    a, b = one.topology, other.topology
    return np.array_equal(a.index, b.index) and all(
        np.array_equal(a.parts.get(name, []), b.parts.get(name, [])) for name in RIGHT
    )
