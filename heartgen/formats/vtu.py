"""VTK files: the mesh as cubic hexahedra for VTK, ParaView and finite element codes, exactly.

A tricubic element is as well given by its places on a 4 x 4 x 4 lattice (Lagrange cells), or by its
Bernstein coefficients (Bezier cells). Cell data keep what the mesh calls its parts: ``structure``,
the place of an element in it (radial, circumferential, longitudinal); for every region ``part
NAME``, 1 in its elements; for every surface ``surface NAME``, and for every piece of one ``patch
NAME``, the sum of 2^f over the faces f of an element that are in it, which are numbered xi1=0,
xi1=1, xi2=0, xi2=1, xi3=0, xi3=1 from 0. mm, world (LPS).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.formats.vtkgrid import write_grid
from heartgen.formats.written import Written, write_text
from heartgen.mesh.bernstein import DEGREE, cube, lagrange_to_bernstein
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.lagrange_nodes import shared_points
from heartgen.mesh.lattice_order import VTK_ORDER, places

LAGRANGE_HEXAHEDRON, BEZIER_HEXAHEDRON = 72, 79
"""VTK's numbers of the cell types."""

DEGREES = "HigherOrderDegrees"
"""Cell data in which VTK looks for the degrees of Bezier cells."""

SURFACE, PATCH, PART = "surface ", "patch ", "part "
"""Beginnings of the names of cell data that tell of named parts."""


def write_vtu(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as an unstructured VTK file of Lagrange cells.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Data of the points, or of the cells for those that are constant in each element. Elements
        do not share the points where one of them jumps. A field of that name takes the place of
        ``jacobian_ratio``, the quality of the elements.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    MeshError
        If a field does not fit the mesh.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import make_fields
    >>> from heartgen.formats import write_vtu
    >>> with TemporaryDirectory() as folder:
    ...     written = write_vtu(mesh, Path(folder) / "mesh.vtu", make_fields(mesh, ["fibers"]))
    >>> written.files[0].name
    'mesh.vtu'
    """
    grid = lagrange_grid(mesh, fields)
    cells = [(LAGRANGE_HEXAHEDRON, grid.cells)]
    return write_grid(path, grid.points, cells, grid.point_data, grid.cell_data)


def write_bezier_vtu(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as an unstructured VTK file of Bezier cells; parameters as for `write_vtu`.

    Points and their data are Bernstein coefficients: between corners the surface does not pass
    through them.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    path : path
        File to write; its folder is created if absent.
    fields : iterable of MeshField
        Fields on the mesh.
    """
    fields = fitting(fields, mesh.n_elements)
    to_bernstein = cube(lagrange_to_bernstein())
    smooth = [
        MeshField(field.name, np.matmul(to_bernstein, field.values))
        for field in fields
        if not field.per_element
    ]
    constant = tuple(field for field in fields if field.per_element)
    number, first = shared_points(mesh.topology, fields)
    grid = _grid(mesh, (*smooth, *constant), mesh.control, number, first)
    cells = [(BEZIER_HEXAHEDRON, grid.cells)]
    cell_data = {DEGREES: np.full((mesh.n_elements, 3), float(DEGREE)), **grid.cell_data}
    attributes = {DEGREES: DEGREES}
    return write_grid(path, grid.points, cells, grid.point_data, cell_data, attributes)


def write_legacy_vtk(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as a legacy VTK file, version 5.1; parameters as for `write_vtu`.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    path : path
        File to write; its folder is created if absent.
    fields : iterable of MeshField
        Fields on the mesh.
    """
    grid = lagrange_grid(mesh, fields)
    n, size = grid.cells.shape
    lines = [
        "# vtk DataFile Version 5.1",
        "heartgen: coordinates in mm, world (LPS)",
        *("ASCII", "DATASET UNSTRUCTURED_GRID"),
        *(f"POINTS {len(grid.points)} double", _rows(grid.points)),
        f"CELLS {n + 1} {n * size}",
        *("OFFSETS vtktypeint64", _rows(size * np.arange(n + 1)[:, None])),
        *("CONNECTIVITY vtktypeint64", _rows(grid.cells)),
        *(f"CELL_TYPES {n}", _rows(np.full((n, 1), LAGRANGE_HEXAHEDRON))),
    ]
    of_points, of_cells = ("POINT_DATA", grid.point_data), ("CELL_DATA", grid.cell_data)
    for title, data in (of_points, of_cells):
        if data:
            count = len(next(iter(data.values())))
            lines += [f"{title} {count}", f"FIELD FieldData {len(data)}"]
        for name, values in data.items():
            rows = values.reshape(len(values), -1)
            kind = "double" if rows.dtype.kind == "f" else "vtktypeint64"
            lines += [f"{_encoded(name)} {rows.shape[1]} {len(rows)} {kind}", _rows(rows)]
    return write_text("\n".join(lines) + "\n", path)


@dataclass(frozen=True, eq=False)
class PointGrid:
    """An unstructured grid of cells of 64 points, in VTK's order.

    Attributes
    ----------
    points : (m, 3) float64
        mm, world (LPS).
    cells : (e, 64) int
        Points of each cell.
    point_data, cell_data : dict of str to (m, ...) or (e, ...)
        By name.
    """

    points: NDArray[np.float64]
    cells: NDArray[np.intp]
    point_data: dict[str, NDArray[np.generic]]
    cell_data: dict[str, NDArray[np.generic]]


def lagrange_grid(mesh: HexMesh, fields: Iterable[MeshField] = ()) -> PointGrid:
    """Points, cells and data of a mesh as `write_vtu` writes them.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    fields : iterable of MeshField
        Fields on the mesh.

    Raises
    ------
    MeshError
        If a field does not fit the mesh.
    """
    fields = fitting(fields, mesh.n_elements)
    return _grid(mesh, fields, mesh.lagrange_points(), *shared_points(mesh.topology, fields))


def _grid(
    mesh: HexMesh,
    fields: tuple[MeshField, ...],
    places_of_elements: NDArray[np.float64],
    number: NDArray[np.intp],
    first: NDArray[np.intp],
) -> PointGrid:
    """Points (e, 64, 3) and data, shared by these numbers."""
    cell_data = _named_parts(mesh.topology)
    for field in fields:
        if field.name in cell_data:
            raise MeshError(
                f"field {field.name!r} would hide what the file says of the parts of the mesh: "
                "give it another name"
            )
    cell_data["jacobian_ratio"] = jacobian_ratio(mesh)
    return PointGrid(
        points=places_of_elements.reshape(-1, 3)[first],
        cells=number[:, places(VTK_ORDER)],
        point_data={
            field.name: field.values.reshape(-1, field.components)[first]
            for field in fields
            if not field.per_element
        },
        cell_data=cell_data | {field.name: field.values for field in fields if field.per_element},
    )


def _named_parts(topology: Topology) -> dict[str, NDArray[np.generic]]:
    """Cell data that tell where an element belongs."""
    data: dict[str, NDArray[np.generic]] = {"structure": topology.index}
    for kind, named in ((SURFACE, topology.surfaces), (PATCH, topology.patches)):
        for name, faces in named.items():
            bits = np.zeros(topology.n_elements, dtype=np.intp)
            np.bitwise_or.at(bits, faces[:, 0], 1 << faces[:, 1])
            data[kind + name] = bits
    for name, elements in topology.parts.items():
        inside = np.zeros(topology.n_elements, dtype=np.intp)
        inside[elements] = 1
        data[PART + name] = inside
    return data


def _rows(values: NDArray[np.generic]) -> str:
    """Numbers (n, k), a line a row."""
    form = "{:.17g}" if values.dtype.kind == "f" else "{}"
    return "\n".join(" ".join(map(form.format, row)) for row in values.tolist())


def _encoded(name: str) -> str:
    """A name as legacy files have it: one word, other characters by their number."""
    plain = re.compile(rb"[\w.-]")
    letters = (bytes([byte]) for byte in name.encode())
    return "".join(c.decode() if plain.match(c) else f"%{c[0]:02X}" for c in letters)
