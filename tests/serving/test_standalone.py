from __future__ import annotations

import json
import re

import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen import personalize, samples
from heartgen.errors import InputError
from heartgen.formats import write_mesh
from heartgen.serving.standalone import (
    DISTANCE,
    PLAIN,
    frame_beside,
    make_scene,
    read_mesh,
)
from heartgen.widgets.scene_file import scene_file

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def result():
    return personalize(samples.lifelike_lv(3.0).mask)


@pytest.fixture(scope="module")
def shown(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("view") / "mesh.vtu"
    write_mesh(result.mesh, path)
    return make_scene(read_mesh(path), result.anatomy, frame_beside(path, result.anatomy))


def test_mesh_lies_on_its_mask_and_stands_upright(shown):
    scene, _ = shown
    assert np.mean(scene.mesh.point_data[DISTANCE]) < 0.6
    assert scene.mask.n_points > 0
    heights = np.asarray(scene.mesh.points)[:, 2]
    assert heights.max() < 20
    assert heights.min() < -50
    assert {"Septal", "Apical"} < set(scene.views)


def test_arrays_of_the_file_and_the_distance_are_offered(shown):
    _, colorings = shown
    assert next(iter(colorings)) == PLAIN
    assert set(colorings) == {PLAIN, "jacobian_ratio", DISTANCE}
    assert len(np.unique(colorings["jacobian_ratio"].rgb, axis=0)) > 10


def test_page_holds_the_view_and_every_coloring(shown):
    page = scene_file(*shown, "mesh.vtu")
    assert "class Heart" in page
    state = re.search(r'<script id="state" type="application/json">(.*?)</script>', page, re.DOTALL)
    told = json.loads(state[1])
    assert list(told["colorings"]) == list(shown[1])
    assert told["scene"]["revision"] == 1


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
