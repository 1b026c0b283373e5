"""VTU files, read by VTK."""

from __future__ import annotations

from xml.etree import ElementTree as ET

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import MeshError
from heartgen.formats import write_vtu
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


def test_every_place_of_every_element_is_ours(mesh, written):
    grid = written(mesh)
    assert {grid.GetCellType(e) for e in range(mesh.n_elements)} == {LAGRANGE_HEXAHEDRON}
    assert grid.GetNumberOfCells() == mesh.n_elements
    xi = np.random.default_rng(0).random((12, 3))
    assert_allclose(evaluate(grid, xi), mesh.evaluate(xi), rtol=0, atol=CLOSE)


def test_lattice_points_are_stored_to_the_bit(mesh, written):
    grid = written(mesh)
    degree = [3, 3, 3, 64]
    index = model.vtkHigherOrderHexahedron.PointIndexFromIJK
    order = [index(i, j, k, degree) for k in range(4) for j in range(4) for i in range(4)]
    stored = points(grid)[connectivity(grid)[:, order]]
    assert stored.dtype == np.float64
    # A shared point has the bits of the first element that has it.
    assert_allclose(stored, mesh.lagrange_points(), rtol=0, atol=1e-13)
    assert_array_equal(stored[0], mesh.lagrange_points()[0])


def test_readers_of_every_age_take_the_same_order(usual, tmp_path):
    # Before version 2.1 of the format two edges were swapped, and readers go by its number.
    write_vtu(usual, tmp_path / "mesh.vtu")
    version = ET.parse(tmp_path / "mesh.vtu").getroot().get("version")
    assert tuple(map(int, version.split("."))) >= (2, 1)


def test_neighbours_share_points_and_the_pole_stays_apart(mesh, written):
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


def test_more_data_may_be_given(usual, written):
    n = usual.n_elements
    data = {
        'strain <ε> & "more"': np.random.default_rng(0).standard_normal((n, 6)),
        "segment": np.arange(n, dtype=np.int32) % 17,
        "scar": np.arange(n) % 2 == 0,
        "unknown": np.full(n, np.nan),
        "single": np.linspace(0, 1, n, dtype=np.float32),
        "big endian": np.arange(n, dtype=">i4"),
        "structure": np.arange(n),
    }
    grid = written(usual, cell_data=data)
    for name, values in data.items():
        assert_array_equal(cell_data(grid, name), values)


@pytest.mark.parametrize(
    "values",
    [np.zeros(71), np.zeros(73), np.float64(1), np.zeros((72, 2, 2)), ["basal"] * 72, [1j] * 72],
    ids=["short", "long", "one number", "matrices", "words", "complex"],
)
def test_data_that_does_not_fit_is_refused(usual, tmp_path, values):
    with pytest.raises(MeshError, match=r"cell data 'mine': .* shape \(72,\) or \(72, n\)"):
        write_vtu(usual, tmp_path / "mesh.vtu", cell_data={"mine": values})
    assert list(tmp_path.iterdir()) == []
