"""Meshes as objects of meshio, which writes many formats more."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

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
        mm, world (LPS).
    fields : iterable of MeshField
        Fields on the mesh.

    Returns
    -------
    meshio.Mesh
        mm, world (LPS). Names of data have underscores for their spaces, which many of its writers
        refuse.

    Raises
    ------
    MeshError
        If a field does not fit the mesh.
    HeartgenError
        If meshio is not installed.

    Examples
    --------
    >>> import heartgen
    >>> from heartgen.formats import to_meshio
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> result = heartgen.personalize(mask, optimize=False)
    >>> to_meshio(result.mesh, result.fields(["thickness"])).cells[0].data.shape
    (72, 64)
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
        point_data={_name(name): _flat(values) for name, values in grid.point_data.items()},
        cell_data={_name(name): [_flat(values)] for name, values in grid.cell_data.items()},
    )


def _name(name: str) -> str:
    """A name as all formats of meshio can have it."""
    return name.replace(" ", "_")


def _flat(values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Data of one component as a list of numbers."""
    return values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values
