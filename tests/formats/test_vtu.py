"""VTU files, read by VTK."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import MeshError
from heartgen.formats import write_vtu
from heartgen.mesh import MeshField
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.jacobian import jacobian_ratio

core = pytest.importorskip("vtkmodules.vtkCommonCore")
model = pytest.importorskip("vtkmodules.vtkCommonDataModel")
xml = pytest.importorskip("vtkmodules.vtkIOXML")
vtk_to_numpy = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy

LAGRANGE_HEXAHEDRON = 72
CLOSE = 1e-9
"""mm; the file is exact, VTK's sums are rounded."""


def read(path):
    reader = xml.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


@pytest.fixture
def written(tmp_path):
    def write(mesh, **options):
        write_vtu(mesh, tmp_path / "mesh.vtu", **options)
        return read(tmp_path / "mesh.vtu")

    return write


def connectivity(grid):
    return vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 64)


def lattice_order():
    """VTK's number of each of the 64 points of a cell, xi1 fastest."""
    index = model.vtkHigherOrderHexahedron.PointIndexFromIJK
    return [index(i, j, k, [3, 3, 3]) for k in range(4) for j in range(4) for i in range(4)]


def points(grid):
    return vtk_to_numpy(grid.GetPoints().GetData())


def evaluate(grid, xi):
    """(e, q, 3) by VTK's own interpolation."""
    out = np.empty((grid.GetNumberOfCells(), len(xi), 3))
    part, place, weights = core.reference(0), [0.0] * 3, [0.0] * 64
    for e in range(len(out)):
        cell = grid.GetCell(e)
        for q, at in enumerate(xi.tolist()):
            cell.EvaluateLocation(part, at, place, weights)
            out[e, q] = place
    return out


# --- geometry ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_place_of_every_element_is_ours(mesh, written):
    grid = written(mesh)
    assert {grid.GetCellType(e) for e in range(mesh.n_elements)} == {LAGRANGE_HEXAHEDRON}
    assert grid.GetNumberOfCells() == mesh.n_elements
    xi = np.random.default_rng(0).random((12, 3))
    assert_allclose(evaluate(grid, xi), mesh.evaluate(xi), rtol=0, atol=CLOSE)


@pytest.mark.slow
def test_lattice_points_are_stored_to_the_bit(mesh, written):
    grid = written(mesh)
    stored = points(grid)[connectivity(grid)[:, lattice_order()]]
    assert stored.dtype == np.float64
    # A shared point has the bits of the first element that has it.
    assert_allclose(stored, mesh.lagrange_points(), rtol=0, atol=1e-13)
    assert_array_equal(stored[0], mesh.lagrange_points()[0])


def test_readers_of_every_age_take_the_same_order(usual, tmp_path):
    # Before version 2.1 of the format two edges were swapped, and readers go by its number.
    write_vtu(usual, tmp_path / "mesh.vtu")
    version = ET.parse(tmp_path / "mesh.vtu").getroot().get("version")
    assert tuple(map(int, version.split("."))) >= (2, 1)


def test_neighbors_share_points_and_the_pole_stays_apart(mesh, written):
    grid = written(mesh)
    radial, around, along = mesh.topology.shape
    assert grid.GetNumberOfPoints() == (3 * radial + 1) * (3 * around) * (3 * along + 1)
    assert all(len(np.unique(cell)) == 64 for cell in connectivity(grid))


def test_elements_with_other_axes_share_their_face(turned, written):
    grid = written(turned)
    assert grid.GetNumberOfPoints() == 2 * 64 - 16
    xi = np.random.default_rng(1).random((20, 3))
    assert_allclose(evaluate(grid, xi), turned.evaluate(xi), rtol=0, atol=CLOSE)


# --- data ----------------------------------------------------------------------------------------


def cell_data(grid, name):
    return vtk_to_numpy(grid.GetCellData().GetArray(name))


def test_place_and_quality_of_elements_are_there(mesh, written):
    grid = written(mesh)
    assert_array_equal(cell_data(grid, "structure"), mesh.topology.index)
    assert_array_equal(cell_data(grid, "jacobian_ratio"), jacobian_ratio(mesh))


def point_data(grid, name):
    return vtk_to_numpy(grid.GetPointData().GetArray(name))


def test_fields_per_element_are_data_of_the_cells(usual, written):
    n = usual.n_elements
    strain = np.random.default_rng(0).standard_normal((n, 6))
    fields = [
        MeshField('strain <ε> & "more"', strain),
        MeshField("segment", np.arange(n) % 17),
    ]
    grid = written(usual, fields=fields)
    assert_array_equal(cell_data(grid, 'strain <ε> & "more"'), strain)
    assert_array_equal(cell_data(grid, "segment"), np.arange(n) % 17)


def test_smooth_fields_are_data_of_the_points(usual, written):
    places = usual.lagrange_points()
    grid = written(usual, fields=[MeshField("affine", 2 * places[..., :2] + 1)])
    assert grid.GetNumberOfPoints() == written(usual).GetNumberOfPoints()
    assert_allclose(point_data(grid, "affine"), 2 * points(grid)[:, :2] + 1, atol=1e-12)


def test_where_a_field_jumps_each_element_has_its_own_value(usual, written):
    around = usual.topology.shape[1]
    turn = (usual.topology.index[:, 1, None] + lattice()[None, :, 0]) / around
    grid = written(usual, fields=[MeshField("turn", turn[..., None])])
    assert_allclose(
        point_data(grid, "turn")[connectivity(grid)[:, lattice_order()]], turn, atol=1e-12
    )
    seam = (3 * 1 + 1) * (3 * 6 + 1)  # lattice points on it
    assert grid.GetNumberOfPoints() == written(usual).GetNumberOfPoints() + seam


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ([MeshField("mine", np.zeros(71))], "'mine' is given on 71 elements"),
        ([MeshField("mine", np.zeros(72))] * 2, "two fields are named 'mine'"),
    ],
)
def test_fields_of_another_mesh_are_refused(usual, tmp_path, fields, message):
    with pytest.raises(MeshError, match=message):
        write_vtu(usual, tmp_path / "mesh.vtu", fields)
    assert list(tmp_path.iterdir()) == []
