"""Grids of simple cells for VTK and as XDMF, read back; and what formats of such cells refuse."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import HeartgenError, InputError, MeshError
from heartgen.formats import FORMATS, Resampling, file_name, write_mesh
from heartgen.formats.resampling import fidelity
from heartgen.formats.resampling.cell_files import CellFormat
from heartgen.mesh import MeshField

from .cells import KIND_OF_TYPE
from .simple import FIBERS, MESHIO, assert_same_cells, fields_of, written

# --- VTK and XDMF --------------------------------------------------------------------------------


GRIDS = ("vtu-cells", "xdmf")
KINDS = ("hex8", "hex20", "hex27", "tet4", "tet10")


@pytest.mark.slow
@pytest.mark.parametrize("form", GRIDS)
@pytest.mark.parametrize("kind", KINDS)
def test_pyvista_reads_the_grid(heart, form, kind, tmp_path):
    pv = pytest.importorskip("pyvista")
    outcome, cells = written(heart, tmp_path, form, kind, fields_of(heart))
    grid = pv.read(outcome.files[0])
    blocks = [(KIND_OF_TYPE[int(t)], np.asarray(n)) for t, n in grid.cells_dict.items()]
    blocks.sort(key=lambda block: block[0])
    assert_same_cells(np.asarray(grid.points), blocks, cells)
    assert_data(grid.point_data, grid.cell_data, heart, cells)


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_meshio_reads_the_grid(heart, kind, tmp_path):
    meshio = pytest.importorskip("meshio")
    outcome, cells = written(heart, tmp_path, "vtu-cells", kind, fields_of(heart))
    if "wedge15" in {block.kind.name for block in cells.cells}:
        pytest.skip("meshio does not read these cells from VTU")
    found = meshio.read(outcome.files[0])
    blocks = [
        # It turns wedges of six points, for which VTK has one order in words and one in numbers.
        (MESHIO[b.type], b.data[:, [0, 2, 1, 3, 5, 4]] if b.type == "wedge" else b.data)
        for b in found.cells
    ]
    assert_same_cells(found.points, blocks, cells)
    cell_data = {name: np.concatenate(parts) for name, parts in found.cell_data.items()}
    assert_data(found.point_data, cell_data, heart, cells)


@pytest.mark.slow
def test_xdmf_holds_fields_of_any_size(usual, tmp_path):
    pv = pytest.importorskip("pyvista")
    bends = np.random.default_rng(0).random((usual.n_elements, 2))
    outcome, cells = written(usual, tmp_path, "xdmf", "tet4", [MeshField("bend", bends)])
    grid = pv.read(outcome.files[0])
    element = cells.cells[0].element
    for k in range(2):
        assert_allclose(grid.cell_data[f"bend {k + 1}"], bends[element, k], rtol=0, atol=1e-15)


def assert_data(point_data, cell_data, mesh, cells):
    """Fields, regions and surfaces are those of the mesh."""
    element = np.concatenate([block.element for block in cells.cells])
    assert_array_equal(cell_data["element"], element)
    assert_array_equal(cell_data["segment"], element)
    assert_array_equal(cell_data["part"], cells.part_numbers())
    assert np.asarray(cell_data["scaled_jacobian"]).min() > 0
    vertices = np.unique(
        np.concatenate([b.nodes[:, : b.kind.vertices].ravel() for b in cells.cells])
    )
    height = np.asarray(point_data["height"])[vertices]
    assert_allclose(height, cells.points[vertices, 2], rtol=0, atol=1e-9)
    assert np.asarray(point_data[FIBERS]).shape == (len(cells.points), 3)
    for name in mesh.topology.surfaces:
        nodes = np.unique(np.concatenate([f.ravel() for f in cells.facets(name)]))
        assert_array_equal(np.flatnonzero(point_data[name]), nodes)


# --- notes and refusals --------------------------------------------------------------------------


def test_notes_tell_what_resampling_cost(usual, tmp_path):
    outcome, cells = written(usual, tmp_path, "inp", "hex8")
    assert outcome.notes == (str(fidelity(usual, cells)),)
    outcome, cells = written(usual, tmp_path, "stl", "tet4")
    assert outcome.notes[0].startswith(f"{sum(map(len, cells.surfaces.values()))} triangles: ")


@pytest.mark.parametrize(
    ("name", "kind", "sentence"),
    [
        ("inp", "hex27", "Abaqus input has no place for hex27 and wedge18"),
        ("feb", "hex27", "FEBio has no cells hex27 and wedge18"),
        ("pts", "hex8", "openCARP are written as linear tetrahedra: choose tet4"),
        ("pts", "tet10", "choose tet4"),
        ("cheart", "hex8", "CHeart has no meshes of hex8 and wedge6: choose tet4"),
        ("stl", "hex8", "flat triangles: choose tet4"),
    ],
)
def test_formats_refuse_cells_they_do_not_have(usual, tmp_path, name, kind, sentence):
    with pytest.raises(MeshError, match=sentence):
        written(usual, tmp_path, name, kind)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [name for name, each in FORMATS.items() if each.exact])
def test_exact_formats_take_no_cells(small, tmp_path, name):
    with pytest.raises(InputError, match="leave out the choice of cells"):
        write_mesh(small, tmp_path / file_name("m", name), format=name, cells=Resampling("hex8"))


def test_a_choice_of_cells_finds_the_format_that_takes_it(usual, tmp_path):
    write_mesh(usual, tmp_path / "a.vtu", cells=Resampling("hex8", (1, 1, 1)))
    _, cells = written(usual, tmp_path, "vtu-cells", "hex8")
    assert f'NumberOfCells="{cells.n_cells}"' in (tmp_path / "a.vtu").read_text()
    with pytest.raises(HeartgenError, match=r"a\.exf: .*leave out the choice of cells"):
        write_mesh(usual, tmp_path / "a.exf", cells=Resampling("hex8"))


def test_every_format_of_simple_cells_is_tested():
    simple = {name for name, each in FORMATS.items() if isinstance(each.write, CellFormat)}
    tested = {"vtu-cells", "xdmf", "inp", "feb", "pts", "cheart", "stl", "ply", "obj", "glb"}
    assert simple == tested
