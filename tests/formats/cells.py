"""VTK's view of simple cells: its own shape functions say where they are and how large."""

from __future__ import annotations

import numpy as np
import pytest

TYPES = {
    "hex8": (12, "vtkHexahedron"),
    "hex20": (25, "vtkQuadraticHexahedron"),
    "hex27": (29, "vtkTriQuadraticHexahedron"),
    "wedge6": (13, "vtkWedge"),
    "wedge15": (26, "vtkQuadraticWedge"),
    "wedge18": (32, "vtkBiQuadraticQuadraticWedge"),
    "tet4": (10, "vtkTetra"),
    "tet10": (24, "vtkQuadraticTetra"),
}
"""VTK's number and class of each kind."""

KIND_OF_TYPE = {number: kind for kind, (number, _) in TYPES.items()}

GAUSS = 5


def vtk_gradients(kind, xi):
    """VTK's derivatives of shape functions at (q, 3), as (q, n, 3)."""
    model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
    cell = getattr(model, TYPES[kind][1])()
    n = cell.GetNumberOfPoints()
    out = np.empty((len(xi), 3 * n))
    for row, at in zip(out, np.asarray(xi).tolist(), strict=True):
        if kind == "tet4":  # a static method of no arguments but the table
            row[:] = [-1, 1, 0, 0, -1, 0, 1, 0, -1, 0, 0, 1]
        else:
            cell.InterpolateDerivs(at, row)
    return out.reshape(len(xi), 3, n).transpose(0, 2, 1)


def vtk_volumes(kind, points):
    """Volumes (m,) and least determinants (m,) of cells with nodes (m, n, 3), by VTK."""
    t, w = np.polynomial.legendre.leggauss(GAUSS)
    t, w = (t + 1) / 2, w / 2
    x, y, z = (a.ravel() for a in np.meshgrid(t, t, t, indexing="ij"))
    weight = np.einsum("i,j,k->ijk", w, w, w).ravel()
    if kind[0] in "wt":
        y, weight = y * (1 - x), weight * (1 - x)
    if kind[0] == "t":
        z, weight = z * (1 - x - y), weight * (1 - x - y)
    gradient = vtk_gradients(kind, np.stack([x, y, z], -1))
    det = np.linalg.det(np.einsum("qnd,mnx->mqxd", gradient, points))
    return det @ weight, det.min(1)


def open_edges(facets):
    """Edges of faces [(f, n)] of which there are not two; vertices of each face in a ring."""
    edges = [
        np.sort(np.stack([ring, np.roll(ring, -1, axis=1)], -1).reshape(-1, 2), axis=1)
        for ring in facets
    ]
    _, count = np.unique(np.concatenate(edges), axis=0, return_counts=True)
    return int(np.count_nonzero(count != 2))
