"""VTU: the mesh as cubic Lagrange hexahedra for VTK, ParaView and finite element codes, exactly.

A tricubic element is as well given by its places on a 4 x 4 x 4 lattice. mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.files import Written
from heartgen.formats.vtkgrid import write_grid
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.lattice import shared_points

LAGRANGE_HEXAHEDRON = 72
"""VTK's number of the cell type."""

ORDER = """
000 300 330 030 003 303 333 033
100 200 310 320 130 230 010 020 103 203 313 323 133 233 013 023 001 002 301 302 331 332 031 032
011 021 012 022 311 321 312 322 101 201 102 202 131 231 132 232 110 210 120 220 113 213 123 223
111 211 121 221 112 212 122 222
"""
"""Lattice place (i, j, k) of each of VTK's points: corners, edges, faces, inside."""


def write_vtu(mesh: HexMesh, path: str | Path, fields: Iterable[MeshField] = ()) -> Written:
    """Write a mesh as an unstructured VTK file.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Data of the points, or of the cells for those that are constant in each element. Elements
        do not share the points where one of them jumps. Data of the cells are always
        ``structure``, the place of an element in the mesh (radial, circumferential,
        longitudinal), and ``jacobian_ratio``, unless a field of that name is given.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    MeshError
        If a field does not fit the mesh.
    """
    fields = fitting(fields, mesh.n_elements)
    data: dict[str, NDArray[np.generic]] = {
        "structure": mesh.topology.index,
        "jacobian_ratio": jacobian_ratio(mesh),
    }
    data |= {field.name: field.values for field in fields if field.per_element}
    number, first = shared_points(mesh.topology, fields)
    points = mesh.lagrange_points().reshape(-1, 3)[first]
    order = np.array([[int(digit) for digit in place] for place in ORDER.split()]) @ [1, 4, 16]
    connectivity = number[:, order]
    point_data = {
        field.name: field.values.reshape(-1, field.components)[first]
        for field in fields
        if not field.per_element
    }
    return write_grid(path, points, [(LAGRANGE_HEXAHEDRON, connectivity)], point_data, data)
