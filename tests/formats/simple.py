"""What tests of linear or quadratic cells share: fields, files, and a comparison by VTK."""

from __future__ import annotations

import numpy as np
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.formats import Resampling, file_name, write_mesh
from heartgen.formats.resampling import resample
from heartgen.mesh import MeshField

from .cells import vtk_volumes

MESHIO = {
    "hexahedron": "hex8",
    "hexahedron20": "hex20",
    "hexahedron27": "hex27",
    "wedge": "wedge6",
    "wedge15": "wedge15",
    "wedge18": "wedge18",
    "tetra": "tet4",
    "tetra10": "tet10",
}
"""Kind of each of meshio's cells, whose nodes are in VTK's order."""

FIBERS = "fiber"


def fields_of(mesh):
    """A smooth field, one per element, and a direction."""
    places = mesh.lagrange_points()
    along = places - places.mean((0, 1)) + 1e3
    return (
        MeshField("height", places[..., 2:]),
        MeshField("segment", np.arange(mesh.n_elements)),
        MeshField(FIBERS, along / np.linalg.norm(along, axis=-1, keepdims=True)),
    )


def written(mesh, folder, name, kind, fields=()):
    """Path of a file, and the cells that it should hold."""
    wanted = Resampling(kind, (1, 1, 1))
    path = folder / file_name("heart", name)
    outcome = write_mesh(mesh, path, fields, format=name, cells=wanted)
    assert all(file.is_file() for file in outcome.files)
    return outcome, resample(mesh, wanted)


def assert_same_cells(points, blocks, cells, close=1e-9):
    """Compare what was read, (points, [(kind, nodes)]), with what should be there."""
    assert_allclose(points, cells.points, rtol=0, atol=close)
    assert [kind for kind, _ in blocks] == [block.kind.name for block in cells.cells]
    for (kind, nodes), block in zip(blocks, cells.cells, strict=True):
        assert_array_equal(nodes, block.nodes)
        _, least = vtk_volumes(kind, points[nodes])
        assert least.min() > 0
