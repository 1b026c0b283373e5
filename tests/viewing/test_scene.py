from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from heartgen.errors import HeartgenError, InputError

pytest.importorskip("pyvista")

import pyvista as pv

from heartgen.viewing import plot
from heartgen.viewing.scene import nice_limit

SIZE = (300, 300)


@pytest.fixture(scope="module")
def scene(result):
    plotter = plot(result, off_screen=True)
    yield plotter
    plotter.close()


def in_view(plotter, points):
    """Place of world points (n, 3) in the view: right and up, 1 at its border."""
    matrix = plotter.camera.GetCompositeProjectionTransformMatrix(1, 0, 1)
    matrix = pv.array_from_vtkmatrix(matrix)
    places = np.c_[points, np.ones(len(points))] @ matrix.T
    return places[:, :2] / places[:, 3:]


def test_everything_is_in_view_with_the_apex_down(scene, result):
    points = result.mesh.lagrange_points().reshape(-1, 3)
    assert np.abs(in_view(scene, points)).max() < 1
    pole = points[np.argmin(result.anatomy.to_heart(points)[:, 2])]
    apex, base = in_view(scene, np.stack([pole, result.anatomy.frame[:3, 3]]))
    assert apex[1] < base[1] - 0.5
    assert abs(apex[0] - base[0]) < 0.3


def test_error_is_that_of_the_report(scene, result):
    shown = scene.actors["mesh"].mapper.dataset
    faces = shown.compute_cell_sizes().point_data_to_cell_data()
    mean = np.average(faces["error"], weights=faces["Area"])
    assert mean == pytest.approx(result.report.accuracy.reverse_mean, rel=0.15)
    limit = nice_limit(result.report.accuracy.p95)
    assert scene.actors["mesh"].mapper.scalar_range == (0, limit)


@pytest.mark.parametrize(("mask", "edges"), [(True, False), (False, True), (False, False)])
def test_parts_can_be_left_out(result, mask, edges):
    plotter = plot(result, mask=mask, edges=edges, color=None, off_screen=True)
    assert sorted(plotter.actors) == ["edges"] * edges + ["mask"] * mask + ["mesh"]
    plotter.close()


def test_mask_fades_where_the_mesh_fits(scene, result):
    shown = scene.actors["mask"].mapper.dataset
    assert 0 == shown["color"][:, 3].min() < shown["color"][:, 3].max() < 255


def test_unknown_coloring_is_refused(result):
    with pytest.raises(InputError, match=r"'color'.*choose error, quality or region"):
        plot(result, color="color", off_screen=True)


@pytest.mark.parametrize("color", ["error", "quality", "region", None])
def test_picture_shows_the_mesh_on_white(result, tmp_path, color):
    try:
        plot(result, color=color, screenshot=tmp_path / "mesh.png", window_size=SIZE).close()
    except HeartgenError as error:
        pytest.skip(str(error))
    picture = np.asarray(pv.read(tmp_path / "mesh.png").active_scalars).reshape(*SIZE, -1)
    corners = picture[[0, 0, -1, -1], [0, -1, 0, -1], :3]
    assert (corners == 255).all()
    drawn = (picture[..., :3] < 250).any(-1)
    assert 0.2 < drawn.mean() < 0.8
    assert drawn[SIZE[0] // 2, SIZE[1] // 2]


@pytest.mark.slow
def test_without_graphics_library_there_is_a_sentence_and_no_crash(tmp_path):
    """OSMesa is the window VTK falls back on, also where there is no OSMesa."""
    code = (
        "import heartgen, os, sys\n"
        "from heartgen import samples\n"
        "from heartgen.errors import HeartgenError\n"
        "result = heartgen.personalize(samples.lifelike_lv(3.0).mask)\n"
        "try:\n"
        f"    result.plot(screenshot={str(tmp_path / 'mesh.png')!r}, mask=False)\n"
        "except HeartgenError as error:\n"
        "    sys.exit(str(error))\n"
    )
    environment = {"VTK_DEFAULT_OPENGL_WINDOW": "vtkOSOpenGLRenderWindow", "PATH": ""}
    answer = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    if answer.returncode == 0:
        assert (tmp_path / "mesh.png").stat().st_size > 0
    else:
        assert answer.returncode == 1
        assert "pictures of the mesh need a graphics library" in answer.stderr


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="there is a screen elsewhere")
def test_a_window_without_a_screen_is_refused(result, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    for show in (result.plot, result.mesh.plot):
        with pytest.raises(HeartgenError, match=r'plot\(screenshot="mesh.png"\)'):
            show()
