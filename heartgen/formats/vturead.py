"""VTU files of cubic cells into meshes in the Lagrange basis.

Points that coincide are one, so that elements are joined where a file has a point for each of them,
as at the pole or where a field jumps. Coordinates are taken to be mm, world (LPS).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import HeartgenError, InputError
from heartgen.formats.assembled import MeshFile, NamedSets, assembled
from heartgen.formats.vtkarrays import BROKEN, GridFile, read_grid
from heartgen.formats.vtu import (
    BEZIER_HEXAHEDRON,
    DEGREES,
    LAGRANGE_HEXAHEDRON,
    PART,
    PATCH,
    SURFACE,
)
from heartgen.mesh.bases import lagrange_extraction
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.connectivity import SAME, merge_coincident
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import COEFFICIENTS
from heartgen.mesh.lattice_order import VTK_ORDER, places

COINCIDE = 1e-11
"""Distance, relative to the extent of the mesh, below which two points are one."""

SWAPPED_BEFORE = (2, 1)
"""Version of the file format before which the last two vertical edges were in the other order."""

EDGES = slice(28, 32)
"""Points of these edges."""

CORNERS = "000 300 030 330 003 303 033 333"

OURS = ("structure", "jacobian_ratio", DEGREES)
"""Cell data that are no fields."""


def read_vtu(path: str | Path) -> MeshFile:
    """Read a mesh of cubic Lagrange or Bezier hexahedra.

    Parameters
    ----------
    path : path
        File to read.

    Returns
    -------
    MeshFile
        In the Lagrange basis; fields of the points are cubic, those of the cells constant.

    Raises
    ------
    InputError
        If the file cannot be read, or has other cells.
    """
    try:
        return _mesh_file(path, read_grid(path))
    except HeartgenError:
        raise
    except BROKEN as error:
        raise InputError(f"{path}: The file is damaged ({error}): give the whole of it.") from error


def _mesh_file(path: str | Path, grid: GridFile) -> MeshFile:
    """The mesh and all data in a grid."""
    cells, to_lattice = _cells(path, grid)
    points = np.einsum("ab,ebx->eax", to_lattice, grid.points[cells]).reshape(-1, 3)
    extent = float(np.ptp(points, axis=0).max())
    if not extent > 0:
        raise InputError(f"{path}: The mesh has no extent: give one with coordinates.")
    number, first = merge_coincident(points / extent * (SAME / COINCIDE))
    corners = number.reshape(len(cells), -1)[:, places(CORNERS)]
    structure = grid.cell_data.get("structure")
    named = {
        kind: {
            name.removeprefix(kind): values.astype(np.intp)
            for name, values in grid.cell_data.items()
            if name.startswith(kind)
        }
        for kind in (SURFACE, PATCH, PART)
    }
    mesh = assembled(
        dofs=points[first],
        extraction=lagrange_extraction(number, len(first)),
        nodes=np.unique(corners, return_inverse=True)[1].reshape(corners.shape),
        constant=np.ones(len(first)),
        basis="lagrange",
        index=None if structure is None else structure.astype(np.intp).reshape(-1, 3),
        named=NamedSets(
            surfaces={name: _faces(bits) for name, bits in named[SURFACE].items()},
            parts={name: np.flatnonzero(inside) for name, inside in named[PART].items()},
            patches={name: _faces(bits) for name, bits in named[PATCH].items()},
        ),
    )
    fields = [
        MeshField(name, np.einsum("ab,ebk->eak", to_lattice, _rows(values)[cells]))
        for name, values in grid.point_data.items()
    ]
    fields += [
        MeshField(name, _rows(values))
        for name, values in grid.cell_data.items()
        if name not in OURS and not name.startswith((SURFACE, PATCH, PART))
    ]
    return MeshFile(mesh, tuple(fields))


def _cells(path: str | Path, grid: GridFile) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """Points of the cells (e, 64), xi1 fastest, and what makes of them values on the lattice."""
    kinds = set(grid.types.tolist())
    sizes = np.diff(grid.offsets, prepend=0)
    if kinds not in ({LAGRANGE_HEXAHEDRON}, {BEZIER_HEXAHEDRON}) or set(sizes) != {COEFFICIENTS}:
        raise InputError(
            f"{path}: The cells are not cubic hexahedra of {COEFFICIENTS} points, all Lagrange or "
            "all Bezier: give a mesh that heartgen wrote, or one of order 3."
        )
    cells = grid.connectivity.reshape(-1, COEFFICIENTS)
    if cells.min() < 0 or cells.max() >= len(grid.points):
        raise InputError(f"{path}: Cells name points that are not there: the file is damaged.")
    if kinds == {LAGRANGE_HEXAHEDRON} and grid.version < SWAPPED_BEFORE:
        cells = cells.copy()
        cells[:, EDGES] = np.roll(cells[:, EDGES], 2, axis=1)
    by_lattice = np.empty_like(cells)
    by_lattice[:, places(VTK_ORDER)] = cells
    bezier = kinds == {BEZIER_HEXAHEDRON}
    return by_lattice, tabulate(lattice()) if bezier else np.eye(COEFFICIENTS)


def _faces(bits: NDArray[np.intp]) -> NDArray[np.intp]:
    """Faces (n, 2) from the sums of 2^f over the faces f of each element."""
    return np.argwhere(bits[:, None] >> np.arange(6) & 1)


def _rows(values: NDArray[np.generic]) -> NDArray[np.float64]:
    """Data (n, k) of points or cells."""
    return values.reshape(len(values), -1).astype(np.float64)
