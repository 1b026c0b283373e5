"""Slices and 3-D view are linked, and the fit is drawn and told in the slices."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen.viewing.slice_fit import SliceFit
from heartgen.viewing.slice_views import SLICES, slice_view
from heartgen.viewing.stages import STAGES
from heartgen.widgets.panels.slices import MESHES, OFF, SlicesPanel
from heartgen.widgets.panels.view import ViewPanel
from heartgen.widgets.session import Session

pytestmark = pytest.mark.slow


@pytest.fixture
def session(finished):
    made = Session(outcomes=finished.outcomes)
    made.show(finished.shown)
    yield made
    made.close()


@pytest.fixture
def panel(session):
    made = SlicesPanel(session)
    made._pool.submit(lambda: None).result()
    return made


def area(triangles):
    one, two = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    return np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]).sum() / 2


def test_every_stage_is_offered():
    stages = [(stage.title, stage.key) for stage in STAGES]
    assert {key for _, key in MESHES} == {key for _, key in stages} | {OFF}


def test_section_fills_the_wall_and_its_outline_is_near_the_mask(finished):
    result = finished.shown.result
    view = slice_view(result.mask, result.anatomy)
    section = SliceFit(result).section(view, SLICES[2], view.center[2])
    radius = result.anatomy.radius
    wall = result.anatomy.wall_thickness
    ring = np.pi * ((radius + wall) ** 2 - radius**2)
    assert abs(area(section.triangles) / ring - 1) < 0.35
    assert np.median(section.error) < result.report.voxel_diagonal
    assert section.element.max() < result.mesh.n_elements
    assert len(SliceFit(result).section(view, SLICES[2], 500.0).outline) == 0


def test_template_is_farther_from_the_mask_than_the_result(finished):
    result = finished.shown.result
    view = slice_view(result.mask, result.anatomy)
    errors = {
        stage: SliceFit(result, stage).section(view, SLICES[0], view.center[1]).error.mean()
        for stage in ("template", "registered", "optimized")
    }
    assert errors["template"] > errors["registered"] > errors["optimized"] / 2


def test_fit_is_drawn_in_the_slices(panel):
    drawn = panel.images[0].picture
    assert panel.images[0].triangles
    assert "surface of the mesh" in panel.key.value
    panel.mesh.value = OFF
    assert panel.images[0].picture != drawn
    assert not panel.images[0].triangles


def test_a_click_moves_the_other_slices_and_the_mark_in_3d(session, panel):
    beside = ViewPanel(session)
    panel.images[0].pointed = [10.0, -30.0]  # x and z of the heart
    np.testing.assert_allclose([s.value for s in panel.sliders[1:]], [10.0, -30.0], atol=1e-6)
    np.testing.assert_allclose(panel.images[2].cross[0], 10.0, atol=1e-6)
    before = panel.images[2].picture
    beside._pointed(session.anatomy.to_world(np.array([[0.0, 5.0, -40.0]]))[0])
    values = [slider.value for slider in panel.sliders]
    np.testing.assert_allclose(values, [5.0, 0.0, -40.0], atol=1e-6)
    assert panel.images[2].picture != before


def test_an_image_lies_behind_the_mesh(session, panel, tmp_path):
    nibabel = pytest.importorskip("nibabel")
    mask = session.case.mask
    gray = np.random.default_rng(0).random(mask.voxels.shape) + 3 * mask.voxels
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ mask.affine
    nibabel.save(nibabel.Nifti1Image(gray.astype(np.float32), ras), tmp_path / "gray.nii.gz")
    before = panel.images[0].picture
    panel._read_image(tmp_path / "gray.nii.gz")
    assert panel.said.value == ""
    assert panel.images[0].picture != before
    assert "mask" not in panel.key.value
    panel._drop_image()
    assert panel.images[0].picture == before
    (tmp_path / "no.nii.gz").write_text("no image")
    panel._read_image(tmp_path / "no.nii.gz")
    assert "no.nii.gz" in panel.said.value
