"""Pictures for print."""

from __future__ import annotations

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.anatomy import analyze_under
from heartgen.errors import HeartgenError, InputError
from heartgen.options import Options
from heartgen.report import options_beside

pytest.importorskip("pyvista")

import pyvista as pv

from heartgen.viewing.rendering import COLORS, FIBERS, GREEN, RED, VIEWS, render

pytestmark = pytest.mark.slow

PANEL = 200


def actors(plotter, row=0, column=0):
    """What is drawn in a panel, by name."""
    plotter.subplot(row, column)
    return plotter.renderer.actors


@pytest.mark.parametrize("color", COLORS)
def test_every_coloring_is_drawn_with_every_need(result, color):
    plotter = render(
        result.mesh, colors=[color], mask=result.mask, other=result.warped, panel=PANEL
    )
    assert ("edges" in actors(plotter)) == (color not in FIBERS)
    assert len(actors(plotter)) >= 2
    plotter.close()


def test_rows_are_colorings_and_columns_are_views(result):
    plotter = render(
        result.mesh, colors=["region", "quality"], views=["septal", "basal", "apical"], panel=PANEL
    )
    assert plotter.shape == (2, 3)
    assert plotter.window_size == [3 * PANEL, 2 * PANEL]
    assert len(plotter.scalar_bars) == 1, "one key a row"
    plotter.close()


@pytest.mark.parametrize("view", VIEWS)
def test_the_whole_mesh_is_in_view_and_upright(result, view):
    plotter = render(result.mesh, views=[view], panel=PANEL)
    points = result.mesh.lagrange_points().reshape(-1, 3)
    camera = plotter.camera
    matrix = pv.array_from_vtkmatrix(camera.GetCompositeProjectionTransformMatrix(1, 0, 1))
    places = np.c_[points, np.ones(len(points))] @ matrix.T
    assert np.abs(places[:, :2] / places[:, 3:]).max() < 1
    towards = np.array(camera.focal_point) - np.array(camera.position)
    towards /= np.linalg.norm(towards)
    along = result.anatomy.frame[:3, 2]  # from apex to base, as the shape analysis has it
    if view in ("basal", "apical"):
        assert towards @ along * (-1 if view == "basal" else 1) > 0.95
    else:
        assert np.array(camera.up) @ along > 0.8
    plotter.close()


def test_error_is_the_distance_to_the_mask(result):
    plotter = render(result.mesh, colors=["error"], mask=result.mask, panel=PANEL)
    shown = actors(plotter)["mesh"].mapper.dataset
    mean = float(np.mean(shown["error"]))
    assert mean == pytest.approx(result.report.accuracy.reverse_mean, abs=0.3)
    plotter.close()


def test_error_of_a_stack_is_that_to_its_contours_and_not_to_its_thick_voxels(stack):
    plotter = render(stack.mesh, colors=["error"], mask=stack.mask, panel=PANEL)
    shown = actors(plotter)["mesh"].mapper.dataset
    slices, error = stack.anatomy.slices, shown.point_data_to_cell_data()["error"]
    area = shown.compute_cell_sizes()["Area"]
    near = slices.away(shown.cell_centers().points) < slices.distance / 4
    mean = np.average(error[near], weights=area[near])
    assert mean == pytest.approx(stack.report.accuracy.mean, rel=0.15)
    assert np.percentile(error, 95) < slices.distance / 8
    plotter.close()


def test_error_is_to_the_surface_fitted_under_the_options_beside_the_mesh(tmp_path):
    cut = heartgen.personalize(samples.lifelike_lv(3.0).mask, truncate=12.0)
    written = cut.write(tmp_path, ("exf",), fields=())[0]
    anatomy = analyze_under(cut.mask, options_beside(written))
    base = list(cut.mesh.topology.surfaces).index("base")
    errors = []
    for mask in (anatomy, cut.mask):
        plotter = render(cut.mesh, colors=["error"], mask=mask, panel=PANEL)
        shown = actors(plotter)["mesh"].mapper.dataset
        cells = shown.point_data_to_cell_data()
        errors.append(cells["error"][shown["region"] == base].mean())
        plotter.close()
    assert errors[0] < 0.5 < 2 < errors[1], "the mask goes on beyond the base of the mesh"
    assert options_beside(tmp_path / "elsewhere" / "mesh.exf") == Options()
    (tmp_path / "report.json").write_text("[]", encoding="utf-8")
    with pytest.raises(InputError, match="does not say what the mesh beside it was made under"):
        options_beside(written)


@pytest.mark.parametrize("color", ["overlay", "change"])
def test_picture_shows_both_where_they_are(result, tmp_path, color):
    path = tmp_path / "heart.png"
    try:
        render(
            result.mesh, path, colors=[color], mask=result.mask, other=result.warped, panel=PANEL
        ).close()
    except HeartgenError as error:
        pytest.skip(str(error))
    picture = np.asarray(pv.read(path).active_scalars)[:, :3].astype(float)
    assert picture.shape[0] == PANEL * PANEL
    for shade in (RED, GREEN) if color == "change" else (RED,):
        wanted = np.array(pv.Color(shade).float_rgb)
        lengths = np.linalg.norm(picture, axis=1) * np.linalg.norm(wanted)
        like = picture @ wanted > 0.99 * np.maximum(lengths, 1)
        assert like.mean() > 0.01


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"colors": ["rainbow"]}, "coloring 'rainbow' is not known: choose among plain"),
        ({"views": ["above"]}, "view 'above' is not known: choose among oblique"),
        ({"colors": []}, "no coloring was asked for"),
        ({"views": []}, "no view was asked for"),
        ({"colors": ["error"]}, "error needs the mask"),
        ({"colors": ["overlay"]}, "overlay needs the mask"),
        ({"colors": ["change"]}, "change needs another mesh"),
    ],
)
def test_what_cannot_be_drawn_is_a_sentence(result, options, sentence):
    with pytest.raises(InputError, match=sentence):
        render(result.mesh, **options)
