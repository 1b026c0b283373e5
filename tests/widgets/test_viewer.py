"""The 3-D view without a browser: which form it takes, and what it shows."""

from __future__ import annotations

import asyncio
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

pytest.importorskip("trame_vtk")

from heartgen.widgets.mesh_scene import SceneView, mask_scene, mesh_scene
from heartgen.widgets.viewer import PROXY_VARIABLES, HeartView, has_proxy

pytestmark = pytest.mark.slow


@pytest.fixture
def alone(monkeypatch):
    """No proxy leads to the kernel."""
    for name in PROXY_VARIABLES:
        monkeypatch.delenv(name, raising=False)


def test_without_a_proxy_the_view_is_a_page_of_its_own(finished, alone):
    view = HeartView()
    view.show(mask_scene(finished.anatomy))
    # A thread of its own: tests with a browser leave an event loop running in this one.
    with ThreadPoolExecutor(1) as thread:
        thread.submit(asyncio.run, view.start()).result()
    assert view.backend == "html"
    first = view.widget.children[0].value
    assert 'srcdoc="' in first
    view.show(mesh_scene(finished.shown, SceneView()))
    assert view.widget.children[0].value != first
    view.close()


def test_port_is_used_only_where_it_can_be_reached(alone, monkeypatch):
    assert not has_proxy()
    monkeypatch.setenv(PROXY_VARIABLES[0], "/proxy/")
    assert has_proxy()
    monkeypatch.setenv("HEARTGEN_VIEW", "html")
    assert not has_proxy()


def test_camera_stays_unless_it_is_reset(finished, alone):
    view = HeartView()
    view.show(mesh_scene(finished.shown, SceneView()), reset=True)
    camera = view._plotter.camera
    placed = np.array(camera.position)
    camera.position = placed + 10
    view.show(mesh_scene(finished.shown, SceneView(color="quality")))
    np.testing.assert_allclose(camera.position, placed + 10)
    view.reset()
    np.testing.assert_allclose(camera.position, placed)
    view.close()
