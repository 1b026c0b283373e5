"""Pieces of the dashboard in a notebook's cell."""

from __future__ import annotations

from dataclasses import replace

import pytest

pytest.importorskip("trame_vtk")

from heartgen.errors import InputError
from heartgen.widgets import compare, show_3d, view

pytestmark = pytest.mark.slow


def test_a_result_can_be_looked_at(finished):
    result = finished.shown.result
    widget = view(result)
    assert widget.session.shown.result is result
    assert widget.session.anatomy is result.anatomy
    widget.session.close()


def test_a_click_on_a_level_shows_its_mesh(finished):
    low = finished.shown.result
    high = replace(low, options=replace(low.options, lod=2))
    widget = compare([low, high])
    plot = widget.children[1].children[0]
    assert [point["id"] for point in plot.points] == [1, 2]
    assert plot.selected == 1
    plot.selected = 2
    assert widget.session.shown.result is high
    widget.session.close()


def test_what_cannot_be_compared_is_told(finished):
    result = finished.shown.result
    for results in ([], [result, result]):
        with pytest.raises(InputError, match="different levels"):
            compare(results)


def test_a_scene_stays_in_the_cell(finished):
    scene = show_3d(finished.shown.result.plot(off_screen=True), height=300)
    shown = scene._repr_html_()
    assert shown.startswith("<iframe srcdoc=")
    assert "height: 300px" in shown
    assert "vtk" in scene.page
