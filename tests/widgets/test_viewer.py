"""The 3-D view without a browser: what it is told, and that it is told again until it says so."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

pytest.importorskip("trame_vtk")

from heartgen.widgets import scene_widget
from heartgen.widgets.keeping.store import LEFT_SECONDS
from heartgen.widgets.mesh_scene import SceneView, mask_scene, mesh_scene, stages_moving
from heartgen.widgets.viewer import HeartView

pytestmark = pytest.mark.slow


@pytest.fixture
def view():
    made = HeartView()
    yield made
    made.close()


def points(part):
    return np.frombuffer(part["points"], np.float32).reshape(-1, 3)


def test_who_opens_the_view_late_is_told_all(finished, view):
    view.show(mask_scene(finished.anatomy))
    scene = mesh_scene(finished.shown, SceneView())
    view.show(scene)
    state = view.widget.get_state()
    assert state["revision"] == 2
    np.testing.assert_allclose(points(state["mesh"]), scene.mesh.points)
    corners = np.frombuffer(state["mesh"]["corners"], np.uint32)
    assert corners.max() < scene.mesh.n_points
    assert len(state["mesh_colors"]) == 3 * scene.mesh.n_points
    assert len(state["mask_colors"]) == 4 * scene.mask.n_points


def test_what_no_browser_confirms_is_sent_again(finished, view, monkeypatch):
    monkeypatch.setattr(scene_widget, "CONFIRM", (0.01, 0.01, 0.01))
    sent = []
    monkeypatch.setattr(view.widget, "send_state", lambda key=None: key or sent.append(1))

    async def shown():
        view.show(mask_scene(finished.anatomy))
        sent.clear()  # what was sent at first is lost
        await asyncio.sleep(0.1)
        lost = len(sent)
        view.widget.shown = view.widget.revision
        view.show(mask_scene(finished.anatomy))
        sent.clear()
        view.widget.shown = view.widget.revision
        await asyncio.sleep(0.1)
        return lost, len(sent)

    # A thread of its own: tests with a browser leave an event loop running in this one.
    with ThreadPoolExecutor(1) as thread:
        assert thread.submit(asyncio.run, shown()).result() == (3, 0)


def test_what_is_sent_again_does_not_keep_the_kernel_of_a_closed_page():
    assert sum(scene_widget.CONFIRM) < LEFT_SECONDS


def test_a_view_that_opens_with_something_old_is_told_anew(finished, view, monkeypatch):
    view.show(mask_scene(finished.anatomy))
    sent = []
    monkeypatch.setattr(view.widget, "send_state", lambda key=None: sent.append(1))
    view.widget._hear(None, {"kind": "mounted", "revision": 1}, [])
    assert not sent
    view.widget._hear(None, {"kind": "mounted", "revision": 0}, [])
    assert sent


def test_camera_stays_unless_it_is_reset(finished, view):
    view.show(mesh_scene(finished.shown, SceneView()), reset=True)
    placed = view.widget.camera
    view.show(mesh_scene(finished.shown, SceneView(color="quality")))
    assert view.widget.camera == placed
    view.reset()
    assert view.widget.camera["revision"] == placed["revision"] + 1


def test_point_that_is_clicked_is_told_in_the_world(finished):
    told = []
    view = HeartView(pointed=told.append)
    scene = mesh_scene(finished.shown, SceneView())
    view.show(scene)
    view.widget.cursor = [1.0, 2.0, -3.0]
    np.testing.assert_allclose(told[0], finished.anatomy.to_world(np.array([[1.0, 2.0, -3.0]]))[0])
    view.mark(told[0])
    np.testing.assert_allclose(view.widget.cursor, [1.0, 2.0, -3.0])
    assert len(told) == 1
    view.close()


def test_error_and_thickness_are_told_of_every_point(finished):
    scene = mesh_scene(finished.shown, SceneView())
    probe = scene.probe
    assert len(probe.element) == scene.mesh.n_points
    assert probe.element.max() < finished.shown.result.mesh.n_elements == len(probe.quality)
    assert np.median(probe.values["error"]) < 1
    assert 5 < np.median(probe.values["thickness"]) < 20
    cut = mesh_scene(finished.shown, SceneView(cut="free", normal=(1.0, 1.0, 0.2)))
    missing = np.isnan(cut.probe.values["error"])
    assert 0 < missing.sum() < len(missing)  # where the wall is cut
    assert len(missing) == cut.mesh.n_points


def test_named_sides_are_across_the_long_axis_and_differ(finished):
    views = mesh_scene(finished.shown, SceneView()).views
    towards = {name: np.array(direction) for name, (direction, _) in views.items()}
    assert {"Oblique", "Septal", "Anterior", "Lateral", "Inferior", "Apical"} < set(towards)
    assert towards["Septal"] @ towards["Lateral"] < -0.99
    assert abs(towards["Septal"] @ towards["Anterior"]) < 0.01
    assert towards["Apical"][2] < -0.9
    assert set(mask_scene(finished.anatomy).views) == {"Oblique", "Basal", "Apical"}


def test_mesh_moves_through_its_stages_with_the_same_points(finished, view):
    scene = mesh_scene(finished.shown, SceneView())
    states = stages_moving(finished.shown)
    assert [name for name, _, _ in states][::4] == ["Template", "Optimized"]
    for _, mesh, edges in states:
        assert mesh.shape == scene.mesh.points.shape
        assert edges.shape == scene.edges.points.shape
    np.testing.assert_allclose(states[-1][1], scene.mesh.points)
    view.move(states)
    assert len(view.widget.motion) == len(states)


def test_fibers_inside_the_wall_lie_on_a_sheet(finished):
    whole = mesh_scene(finished.shown, SceneView()).mesh
    scene = mesh_scene(finished.shown, SceneView(lines="depth", depth=0.5))
    assert scene.painted.title.startswith("helix angle")
    assert scene.mesh.area < whole.area / 1.5  # one sheet, not both sides of the wall
    outer = mesh_scene(finished.shown, SceneView(lines="depth", depth=1.0)).mesh
    assert outer.area > scene.mesh.area
