"""What a researcher does with a result, in a few lines: made, shown, written, loaded."""

from __future__ import annotations

import doctest
import importlib
import logging
import pickle
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from pkgutil import walk_packages

import nibabel as nib
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import heartgen
from heartgen import samples
from heartgen.errors import FileError, HeartgenError, InputError, MeshError, NotKeptError
from heartgen.images.writing import write_mask
from heartgen.options import OPTIONS, STEPS, Options
from heartgen.result import Personalization
from heartgen.shown import MOST_LINES, in_lines

SPACING = 3.0


@pytest.fixture(scope="module")
def cup() -> samples.Sample:
    return samples.ideal_cup(SPACING)


@pytest.fixture(scope="module")
def path(cup: samples.Sample, tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("cup") / "cup.nii.gz"
    write_mask(cup.mask, file)
    return file


@pytest.fixture(scope="module")
def result(path: Path) -> Personalization:
    return heartgen.personalize(path, optimize=False)


@pytest.mark.slow
def test_path_array_and_images_give_the_same(result, path, cup):
    image = nib.load(path)
    for mask, place in (
        (cup.mask.voxels, {"affine": cup.mask.affine}),
        (image, {}),
    ):
        other = heartgen.personalize(mask, optimize=False, **place)
        assert_allclose(other.mesh.dofs, result.mesh.dofs, atol=1e-3)
    assert result.report.mask_source == {"path": str(path)}


def test_misspelled_option_gets_a_hint(cup):
    with pytest.raises(InputError, match="did you mean 'optimize'"):
        heartgen.personalize(cup.mask, optimizer=False)
    with pytest.raises(InputError, match="did you mean 'min_jacobian_ratio'"):
        heartgen.personalize_levels(cup.mask, min_jacobian=0.1)
    with pytest.raises(InputError, match="choose among lod, elements"):
        heartgen.personalize(cup.mask, xyz=0.1)
    with pytest.raises(InputError, match="options of type dict"):
        heartgen.personalize(cup.mask, {"lod": 1})


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("lod", "3"),
        ("lod", True),
        ("elements", 5),
        ("elements", "1x12x6"),
        ("elements", np.ones(3)),
        ("optimize", "no"),
        ("quality", "high"),
        ("min_jacobian_ratio", None),
        ("truncate", None),
        ("base", np.zeros(2)),
        ("septal_direction", 3),
        ("septal_direction", ("a", "b", "c")),
        ("hole_radius", "3"),
        ("apex", None),
    ],
)
def test_option_of_the_wrong_kind_is_refused(name, value):
    with pytest.raises(InputError, match=f"(?i){OPTIONS[name].about.title} .*: (give|choose) "):
        Options(**{name: value})


def test_numbers_of_numpy_are_numbers():
    options = Options(lod=np.int64(2), quality=np.float32(2), optimize=np.True_)
    assert options.lod == 2


def test_written_result_is_loaded(result, tmp_path):
    result.write(tmp_path, ("exf", "vtu"), fields=())
    again = Personalization.load(tmp_path)
    source = again.report.mask_source
    assert not Path(source["path"]).is_absolute()
    assert (tmp_path / source["path"]).resolve() == Path(result.report.mask_source["path"])
    assert replace(again.report, mask_source=result.report.mask_source) == result.report
    assert again.options == result.options
    xi = np.full((1, 3), 0.3)
    assert_allclose(again.mesh.evaluate(xi), result.mesh.evaluate(xi), atol=1e-9)
    assert again.mesh.topology.basis == "hermite"
    assert_array_equal(again.mask.voxels, result.mask.voxels)  # from its path
    assert again.anatomy.length == pytest.approx(result.anatomy.length)
    assert again.fields(["thickness"])[0].name == result.fields(["thickness"])[0].name
    assert repr(again).splitlines()[0] == repr(result).splitlines()[0]
    assert pickle.loads(pickle.dumps(again)).report == again.report


@pytest.mark.parametrize("part", ["template", "deformations", "warped", "enhanced"])
def test_parts_that_are_not_written_are_refused(result, tmp_path, part):
    result.write(tmp_path, ("vtu",), fields=())
    again = Personalization.load(tmp_path)
    with pytest.raises(NotKeptError, match=f"no {part}, which is not written"):
        getattr(again, part)
    assert not hasattr(again, part)
    with pytest.raises(AttributeError, match="nonsense"):
        _ = again.nonsense


@pytest.mark.slow
def test_mask_that_was_written_is_the_same_to_the_bit(cup, result, tmp_path):
    turn = np.eye(4)
    turn[:2, :2] = [[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]]
    mask = heartgen.mask_from_array(cup.mask.voxels, turn @ cup.mask.affine)
    fitted = heartgen.personalize(mask, optimize=False)
    assert tmp_path / "mask.nii.gz" in fitted.write(tmp_path, ("vtu",), fields=(), mask=True)
    found = Personalization.load(tmp_path).mask
    assert_array_equal(found.affine, mask.affine)
    assert_array_equal(found.voxels, mask.voxels)
    result.report.to_json()
    (tmp_path / "report.json").write_text(result.report.to_json())
    with pytest.raises(NotKeptError, match="not the mask of the report"):
        _ = Personalization.load(tmp_path).mask


def test_blood_pools_are_written_with_the_mask(result, tmp_path):
    blood = np.zeros(result.mask.voxels.shape, dtype=np.uint8)
    blood[~result.mask.voxels & (np.indices(blood.shape)[0] > blood.shape[0] // 2)] = 2
    mask = replace(result.mask, blood=blood)
    replace(result, mask=mask).write(tmp_path, "vtu", fields=(), mask=True)
    found = Personalization.load(tmp_path).mask
    assert_array_equal(found.blood, blood)
    assert_array_equal(found.voxels, mask.voxels)


@pytest.mark.slow
def test_points_of_both_ventricles_are_located():
    mesh = heartgen.personalize(samples.biv(SPACING).mask, optimize=False).mesh
    generator = np.random.default_rng(0)
    elements = generator.integers(mesh.n_elements, size=2000)
    xi = generator.uniform(size=(2000, 3))
    points = mesh.evaluate(elements, xi)
    found, places = mesh.locate(points)
    assert_array_equal(found, elements)
    assert_allclose(mesh.evaluate(found, places), points, atol=1e-9, rtol=0)


@pytest.mark.slow
def test_mask_that_is_not_there_is_said_so(cup, tmp_path):
    fitted = heartgen.personalize(cup.mask, optimize=False)
    fitted.write(tmp_path, ("vtu",), fields=())
    again = Personalization.load(tmp_path)
    with pytest.raises(NotKeptError, match=r"mask of this result, ideal cup, is not there: give"):
        _ = again.anatomy
    assert Personalization.load(tmp_path, mask=cup.mask).mask is cup.mask
    other = heartgen.mask_from_array(np.roll(cup.mask.voxels, 1, 0), cup.mask.affine)
    with pytest.raises(InputError, match="this is another mask"):
        Personalization.load(tmp_path, mask=other)


def test_folder_without_a_result_is_refused(result, tmp_path):
    with pytest.raises(FileNotFoundError, match="no such folder"):
        Personalization.load(tmp_path / "none")
    with pytest.raises(FileNotFoundError, match="no mesh that can be read"):
        Personalization.load(tmp_path)
    result.mesh.write(tmp_path / "mesh.vtu")
    with pytest.raises(FileNotFoundError, match="no report"):
        Personalization.load(tmp_path)
    (tmp_path / "report.json").write_text("[1]")
    with pytest.raises(InputError, match="no report that can be read"):
        Personalization.load(tmp_path)


def test_mesh_has_what_libraries_ask_for(result, tmp_path):
    mesh = result.mesh
    assert mesh.cells.shape == (mesh.n_elements, 64)
    assert mesh.cells.max() + 1 == len(mesh.points)
    corners = mesh.evaluate(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]))
    assert_allclose(mesh.points[mesh.cells[:, :4]], corners, atol=1e-10)
    assert set(mesh.surfaces) >= {"lv_endo", "epi", "base"}
    assert mesh.write(tmp_path / "cup.vtu") == [tmp_path / "cup.vtu"]
    assert heartgen.read_mesh(tmp_path / "cup.vtu").n_elements == mesh.n_elements


def test_mesh_goes_to_pyvista_and_meshio_exactly(result, tmp_path):
    meshio = pytest.importorskip("meshio")
    pytest.importorskip("pyvista")
    thickness = result.fields(["thickness"])
    grid = result.mesh.to_pyvista(thickness)
    assert grid.n_cells == result.mesh.n_elements
    assert_array_equal(grid.points, result.mesh.points)
    assert thickness[0].name in grid.point_data or thickness[0].name in grid.cell_data
    result.mesh.to_meshio(thickness).write(tmp_path / "cup.vtk")
    again = meshio.read(tmp_path / "cup.vtk")
    assert_array_equal(again.cells[0].data, result.mesh.cells)
    assert_allclose(again.points, result.mesh.points)


@pytest.mark.slow
def test_mesh_and_loaded_result_are_plotted(result, tmp_path):
    pytest.importorskip("pyvista")
    for color in ("region", "quality", None):
        assert "mesh" in result.mesh.plot(color, off_screen=True).actors
    with pytest.raises(InputError, match="choose quality, region or None"):
        result.mesh.plot("error", off_screen=True)
    result.write(tmp_path, ("exf",), fields=())
    plotter = Personalization.load(tmp_path).plot(off_screen=True)
    assert {"mesh", "mask", "edges"} <= set(plotter.actors)


def test_all_show_themselves_in_ten_lines(result):
    for each in (result, result.mesh, result.mask, result.report):
        shown = repr(each)
        assert 1 < len(shown.splitlines()) <= MOST_LINES
        assert type(each).__name__ in shown or each is result.report
        assert each._repr_html_().startswith("<pre")
    assert in_lines(map(str, range(30))).splitlines()[-1] == "  ... 21 more lines"


def test_arrays_make_no_comparison_ambiguous(result):
    again = heartgen.HexMesh(result.mesh.dofs.copy(), result.mesh.topology)
    assert result.mesh == result.mesh
    assert result.mesh != again
    assert len({result.mesh, again, result.mask, result, result.anatomy}) == 5
    assert result.mask != heartgen.Mask(result.mask.voxels.copy(), result.mask.affine)


def test_no_dataclass_of_arrays_compares_by_value():
    """Else to compare two raises that "the truth value of an array is ambiguous"."""
    skipped = ("heartgen.serving", "heartgen.widgets", "heartgen.cohort", "heartgen.viewing")
    skipped += ("heartgen.cli", "heartgen.service")
    for found in walk_packages(heartgen.__path__, "heartgen."):
        if found.name.startswith(skipped):
            continue
        for kind in vars(importlib.import_module(found.name)).values():
            if isinstance(kind, type) and is_dataclass(kind):
                texts = [str(each.type) for each in fields(kind)]
                if any("NDArray" in text or "csr_array" in text for text in texts):
                    assert kind.__eq__ is object.__eq__, kind


def test_errors_are_those_of_python():
    assert issubclass(InputError, ValueError)
    assert issubclass(MeshError, ValueError)
    assert issubclass(FileError, OSError)
    assert issubclass(NotKeptError, HeartgenError)


def test_missing_mesh_is_an_error_of_the_system(tmp_path):
    for name in ("mesh.exf", "mesh.vtu"):
        with pytest.raises(FileNotFoundError, match=r"cannot be read .*: give one that exists"):
            heartgen.read_mesh(tmp_path / name)


def test_mesh_without_surfaces_is_not_plotted(result):
    pytest.importorskip("pyvista")
    bare = replace(result.mesh, topology=replace(result.mesh.topology, surfaces={}))
    with pytest.raises(MeshError, match="without named surfaces"):
        bare.plot(off_screen=True)
    assert "surfaces none" in repr(bare)
    assert bare.to_pyvista().n_cells == bare.n_elements


def test_place_that_cannot_be_written_is_an_error_of_the_system(result, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OSError, match="cannot be written"):
        result.mesh.write(tmp_path / "file" / "mesh.vtu")


@pytest.mark.slow
def test_steps_and_findings_are_logged(cup, caplog, capfd):
    with caplog.at_level(logging.INFO, logger="heartgen"):
        heartgen.personalize(cup.mask.voxels, spacing=SPACING, optimize=False, truncate=5.0)
    assert {record.name for record in caplog.records} == {"heartgen"}
    said = "\n".join(record.getMessage() for record in caplog.records)
    assert all(f"{step}: " in said for step in STEPS)
    assert capfd.readouterr() == ("", "")


def test_library_is_silent_unless_asked():
    handlers = logging.getLogger("heartgen").handlers
    assert any(isinstance(handler, logging.NullHandler) for handler in handlers)


@pytest.mark.parametrize(
    "name",
    [
        "heartgen.errors",
        "heartgen.images.accepting",
        "heartgen.options.choosing",
        "heartgen.options.reference",
        "heartgen.options.text",
    ],
)
def test_examples_run(name):
    """Those of what is public are run by tests/test_doctests.py."""
    outcome = doctest.testmod(importlib.import_module(name))
    assert outcome.attempted > 0
    assert outcome.failed == 0
