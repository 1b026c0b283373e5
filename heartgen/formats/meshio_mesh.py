"""Meshes as objects of meshio, which writes many formats more."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from heartgen.errors import HeartgenError
from heartgen.formats.vtu import lagrange_grid
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import HexMesh

if TYPE_CHECKING:
    import meshio

CELL_TYPE = "VTK_LAGRANGE_HEXAHEDRON"
"""meshio's name of VTK's cell type."""


def to_meshio(mesh: HexMesh, fields: Iterable[MeshField] = ()) -> meshio.Mesh:
    """Mesh of meshio, with the data that a VTU file has.

    Parameters
    ----------
    mesh : HexMesh
    fields : iterable of MeshField

    Returns
    -------
    meshio.Mesh
        mm, world (LPS).

    Raises
    ------
    MeshError
        If a field does not fit the mesh.
    HeartgenError
        If meshio is not installed.
    """
    try:
        import meshio
    except ModuleNotFoundError as error:
        raise HeartgenError(
            "a mesh of meshio needs the package meshio, which is not installed: pip install meshio"
        ) from error
    grid = lagrange_grid(mesh, fields)
    return meshio.Mesh(
        grid.points,
        [(CELL_TYPE, grid.cells)],
        point_data=grid.point_data,
        cell_data={name: [values] for name, values in grid.cell_data.items()},
    )
