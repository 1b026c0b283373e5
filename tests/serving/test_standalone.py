from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen import personalize, samples
from heartgen.errors import InputError
from heartgen.formats import write_mesh
from heartgen.serving.standalone import DISTANCE, PLAIN, color_by, colors_of, make_scene, read_mesh

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result():
    return personalize(samples.lifelike_lv(3.0).mask)


@pytest.fixture(scope="module")
def scene(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "mesh.vtu"
    write_mesh(result.mesh, path)
    plotter = make_scene(read_mesh(path), result.anatomy)
    yield plotter
    plotter.close()


def test_mesh_lies_on_its_mask(scene):
    surface = scene.actors["mesh"].mapper.dataset
    assert np.mean(surface[DISTANCE]) < 0.6
    assert sorted(scene.actors) == ["edges", "mask", "mesh"]


def test_arrays_of_the_file_and_the_distance_are_offered(scene):
    assert set(colors_of(scene)) == {PLAIN, "jacobian_ratio", DISTANCE}
    assert "to" in color_by(scene, "jacobian_ratio")
    assert color_by(scene, PLAIN) == ""


def test_an_ex_file_is_the_same_mesh(result, tmp_path):
    mesh = result.mesh
    for name in ("mesh.exf", "mesh.vtu"):
        write_mesh(mesh, tmp_path / name)
    shown = [read_mesh(tmp_path / name) for name in ("mesh.exf", "mesh.vtu")]
    np.testing.assert_allclose(shown[0].points, shown[1].points, atol=1e-9)


@pytest.mark.parametrize("name", ["absent.vtu", "mesh.exf", "text.vtu"])
def test_what_is_no_mesh_gets_a_sentence(tmp_path, name):
    if name != "absent.vtu":
        (tmp_path / name).write_text("hello")
    with pytest.raises(InputError, match=name):
        read_mesh(tmp_path / name)
