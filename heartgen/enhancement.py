"""Quality enhancement: straighten the mesh across the wall (paper, section 2.4)."""

from __future__ import annotations

import numpy as np

from heartgen.errors import MeshError
from heartgen.mesh.hexmesh import HexMesh


def enhance(mesh: HexMesh) -> HexMesh:
    """Make every transmural line straight; endo- and epicardium do not move.

    Layers inside the wall and all radial and cross derivatives follow from the two surfaces, with
    the template's grading of the depth.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    HexMesh
        Same topology; endo- and epicardial degrees of freedom are bit-equal.

    Raises
    ------
    MeshError
        If the topology does not know how its wall is to be straightened.
    """
    if mesh.topology.straightening is None:
        raise MeshError(
            f"a mesh in the {mesh.topology.basis} basis that was converted or read from a file "
            "cannot be straightened: enhance it before"
        )
    return mesh.with_dofs(np.asarray(mesh.topology.straightening @ mesh.dofs))
