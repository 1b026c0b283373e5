from __future__ import annotations

from dataclasses import replace
from threading import Event

import matplotlib
import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen.viewing.stages import STAGES
from heartgen.widgets.colors import COLORINGS, nice_limit
from heartgen.widgets.mesh_scene import (
    LINES,
    MASK_VIEWS,
    SceneView,
    mask_scene,
    mesh_scene,
    prepare,
)
from heartgen.widgets.panels import view
from heartgen.widgets.scene_cuts import CUTS
from heartgen.widgets.view_place import ViewPlace
from heartgen.widgets.viewer import HeartView

VIEW = SceneView()


def colors(scene):
    return np.unique(np.asarray(scene.mesh.point_data["rgba"]), axis=0)


def test_controls_offer_what_the_scene_knows():
    assert tuple((s.title, s.key) for s in STAGES) == view.STAGES
    assert tuple((c.title, key) for key, c in COLORINGS.items()) == view.COLORS
    assert tuple((title, key) for key, title in MASK_VIEWS.items()) == view.MASKS
    assert tuple((title, key) for key, title in CUTS.items()) == view.CUTS
    assert tuple((title, key) for key, title in LINES.items()) == view.LINES


@pytest.mark.slow
@pytest.mark.parametrize("color", COLORINGS)
def test_every_coloring_has_a_key_and_more_than_one_color(finished, color):
    scene = mesh_scene(finished.shown, replace(VIEW, color=color))
    assert len(colors(scene)) > 1
    assert scene.painted.stops or scene.painted.names
    shown = HeartView()
    shown.show(scene)
    assert shown.widget.revision == 1


def test_stages_approach_the_mask(finished):
    anatomy = finished.anatomy
    template = mesh_scene(finished.shown, replace(VIEW, stage="template")).mesh
    registered = mesh_scene(finished.shown, replace(VIEW, stage="registered")).mesh
    optimized = mesh_scene(finished.shown, VIEW).mesh
    errors = []
    for mesh in (template, registered, optimized):
        world = anatomy.to_world(np.asarray(mesh.points, dtype=float))
        errors.append(np.abs(anatomy.myocardium.sample(world)[0]).mean())
    assert errors[1] < errors[0]
    assert errors[2] < errors[0]


def test_scene_is_in_the_frame_of_the_heart_and_normals_point_out(finished):
    mesh = mesh_scene(finished.shown, VIEW).mesh
    points = np.asarray(mesh.points)
    assert points[:, 2].max() < 5
    assert points[:, 2].min() < -50
    base = np.abs(points[:, 2] - points[:, 2].max()) < 0.5
    normals = np.asarray(mesh.point_data["Normals"])
    assert np.median(normals[base, 2]) > 0.9


@pytest.mark.parametrize(("cut", "axis", "sign"), [("x", 0, 1), ("y", 1, -1), ("z", 2, 1)])
def test_cut_keeps_what_lies_behind_and_shows_the_wall(finished, cut, axis, sign):
    whole = mesh_scene(finished.shown, VIEW).mesh
    half = mesh_scene(finished.shown, replace(VIEW, cut=cut)).mesh
    middle = np.mean(np.array(whole.bounds).reshape(3, 2)[axis])
    along = sign * (np.asarray(half.points)[:, axis] - middle)
    assert along.max() < 1e-3
    on_plane = np.abs(along) < 1e-3
    normals = np.asarray(half.point_data["Normals"])[on_plane]
    assert np.sum(normals[:, axis] * sign > 0.99) > 50


def test_depth_is_seen_where_the_wall_is_cut(finished):
    scene = mesh_scene(finished.shown, replace(VIEW, color="transmural", cut="x"))
    on_plane = np.asarray(scene.mesh.point_data["Normals"])[:, 0] > 0.999
    rgb = np.asarray(scene.mesh.point_data["rgba"], dtype=int)[on_plane, :3]
    ends = [matplotlib.colormaps["cividis"](end, bytes=True)[:3] for end in (0.0, 1.0)]
    distances = [np.abs(rgb - np.asarray(end, dtype=int)).max(1).min() for end in ends]
    assert max(distances) < 12  # from the color of the one surface to that of the other
    assert len(np.unique(rgb, axis=0)) > 20


def test_segments_are_those_of_the_elements(finished):
    scene = mesh_scene(finished.shown, replace(VIEW, color="segment"))
    assert {name for _, name in scene.painted.names} <= {str(n) for n in range(1, 18)}
    assert len(scene.painted.names) > 12


def test_fibers_lie_on_the_surface(finished):
    scene = mesh_scene(finished.shown, replace(VIEW, lines="fibers"))
    assert scene.edges.n_points > 0
    far = scene.edges.compute_implicit_distance(scene.mesh.triangulate())["implicit_distance"]
    assert np.percentile(np.abs(far), 95) < 1.0


def test_mask_can_be_hidden_and_edges_too(finished):
    scene = mesh_scene(finished.shown, replace(VIEW, mask="off", lines="off"))
    assert scene.mask.n_points == scene.edges.n_points == 0
    assert mask_scene(finished.anatomy).mask.n_points > 0


def test_meshes_of_a_heart_share_its_mask_and_leave_it_where_it_is(finished):
    shown = finished.shown
    other = replace(shown, run=shown.run + 1)
    prepare(other)
    alone, first, second = (
        mask_scene(shown.result.anatomy),
        mesh_scene(shown, SceneView()),
        mesh_scene(other, SceneView()),
    )
    np.testing.assert_array_equal(first.mask.points, alone.mask.points)
    np.testing.assert_array_equal(second.mask.points, alone.mask.points)
    np.testing.assert_array_equal(colors(first), colors(second))


def test_scenes_go_before_what_is_prepared():
    done = []
    place = ViewPlace(lambda: None, lambda change: change())
    begin = Event()
    place.make(begin.wait, lambda scene: done.append("first"), done.append)
    place.prepare(lambda: done.append("prepared"))
    place.prepare(lambda: 1 / 0)  # harms nobody
    place.make(lambda: None, lambda scene: done.append("second"), done.append)
    begin.set()
    while len(done) < 2:
        place._pool.submit(lambda: None).result()
    assert done == ["second", "prepared"]  # the first was no longer asked for


def test_mask_shows_more_where_the_template_misses_it(finished):
    opacity = [
        np.asarray(mesh_scene(finished.shown, replace(VIEW, stage=s)).mask["rgba"])[:, 3].mean()
        for s in ("template", "optimized")
    ]
    assert opacity[0] > opacity[1]


@pytest.mark.parametrize(("p95", "limit"), [(0.04, 0.1), (0.3, 1.0), (0.25, 0.5), (99.0, 50.0)])
def test_scale_suits_the_error(p95, limit):
    assert nice_limit(p95) == limit
