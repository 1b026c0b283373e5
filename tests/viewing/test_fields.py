"""Pictures of fields: what is drawn is what the field says."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.errors import InputError
from heartgen.fields import aha_segment, heart_axes
from heartgen.mesh import MeshField
from heartgen.viewing.fiber_glyphs import plot_fibers
from heartgen.viewing.fields import FIELD_STYLES, plot_field, segment_color
from heartgen.viewing.polydata import mesh_surface, on_surface
from heartgen.viewing.windows import can_render


def test_fields_are_evaluated_where_the_surface_is(result):
    mesh = result.mesh
    places = MeshField("place", mesh.lagrange_points())
    found = on_surface(places, mesh.topology)
    assert np.abs(found - mesh_surface(mesh).points).max() < 1e-4  # single precision
    number = MeshField("number", np.arange(mesh.n_elements))
    elements = on_surface(number, mesh.topology)[:, 0].reshape(len(mesh.topology.external), -1)
    assert (elements == mesh.topology.external[:, :1]).all()


@pytest.mark.parametrize("color", [*FIELD_STYLES, "aha"])
def test_every_field_makes_a_picture(result, color, tmp_path):
    plotter = plot_field(result.mesh, color, window_size=(200, 200))
    if color in FIELD_STYLES:
        assert FIELD_STYLES[color].title in "".join(plotter.scalar_bars.keys())
    if can_render(plotter):
        path = tmp_path / "field.png"
        plot_field(result.mesh, color, screenshot=path, window_size=(200, 200)).close()
        assert path.stat().st_size > 1000
    plotter.close()


def test_fibers_are_tubes_along_the_field(result):
    plotter = plot_fibers(result.mesh)
    assert plotter.shape == (1, 3)
    assert all(len(renderer.actors) >= 2 for renderer in plotter.renderers)
    plotter.close()


def test_unknown_coloring_is_refused(result):
    with pytest.raises(InputError, match="choose transmural, longitudinal"):
        plot_field(result.mesh, "temperature")


def test_neighboring_segments_differ_in_color(result):
    axes = heart_axes(result.mesh)
    level, angle = np.meshgrid(np.linspace(-0.05, 1, 60), np.linspace(-np.pi, np.pi, 240))
    around = np.cos(angle)[..., None] * axes.septal + np.sin(angle)[..., None] * axes.anterior
    points = axes.apex + (level * axes.length)[..., None] * axes.longitudinal + 20 * around
    segment = aha_segment(points.reshape(-1, 3), axes).reshape(level.shape)
    pairs = np.concatenate(
        [
            np.stack([segment[1:].ravel(), segment[:-1].ravel()], -1),
            np.stack([segment[:, 1:].ravel(), segment[:, :-1].ravel()], -1),
        ]
    )
    borders = np.unique(pairs[pairs[:, 0] != pairs[:, 1]], axis=0)
    assert len(np.unique(borders)) == 17
    for one, other in borders.tolist():
        assert segment_color(one) != segment_color(other), (one, other)
