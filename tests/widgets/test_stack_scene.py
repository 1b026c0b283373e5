"""A stack in the 3-D view: its contours, and where its slices were before they were moved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("pyvista")
pytest.importorskip("ipywidgets")

from heartgen import samples
from heartgen.anatomy import Anatomy, analyze, with_views
from heartgen.images import Mask
from heartgen.viewing.contours import _along
from heartgen.widgets.mesh_scene import WHOLE_OPACITY, mask_scene
from heartgen.widgets.panels.view import ViewPanel
from heartgen.widgets.scene_lines import GIVEN
from heartgen.widgets.session import Session

SPACING = (1.5, 1.5, 8.0)


def stack(move: int) -> Mask:
    """A stack every second of whose slices is moved by so many pixels."""
    mask = samples.lifelike_lv(SPACING).mask
    voxels = np.pad(mask.voxels, ((9, 9), (9, 9), (0, 0)))
    voxels[:, :, ::2] = np.roll(voxels[:, :, ::2], (move, -move), axis=(0, 1))
    affine = mask.affine.copy()
    affine[:3, 3] = mask.to_world(np.array([[-9.0, -9.0, 0.0]]))[0]
    return replace(mask, voxels=voxels, affine=affine)


@pytest.fixture(scope="module", params=[0, 3])
def anatomy(request: pytest.FixtureRequest) -> Anatomy:
    return analyze(stack(request.param))


def test_contours_lie_in_the_slices(anatomy: Anatomy) -> None:
    assert anatomy.slices is not None
    scene = mask_scene(anatomy)
    world = anatomy.to_world(np.asarray(scene.edges.points, dtype=float))
    assert anatomy.slices.away(world).max() < 0.1 * SPACING[2]
    assert np.asarray(scene.mask.point_data["rgba"])[0, 3] == round(255 * WHOLE_OPACITY)


def test_moved_slices_are_seen_where_they_were(anatomy: Anatomy) -> None:
    assert anatomy.slices is not None
    colors = np.asarray(mask_scene(anatomy).edges.point_data["rgba"])
    gray = np.array([int(GIVEN[k : k + 2], 16) for k in (1, 3, 5)])
    given = np.all(colors[:, :3] == gray, axis=1)
    told = any(finding.check == "slice alignment" for finding in anatomy.findings)
    assert given.any() == told == bool(anatomy.slices.shifts.any())


@pytest.mark.slow
def test_only_the_moved_stack_is_mended() -> None:
    assert not np.any(analyze(stack(0)).slices.shifts)
    back = np.linalg.norm(np.diff(analyze(stack(3)).slices.shifts, axis=0), axis=1)
    np.testing.assert_allclose(np.median(back), 3 * np.sqrt(2) * SPACING[0], rtol=0.15)


def test_contours_are_offered_where_there_are_slices() -> None:
    session = Session()
    panel = ViewPanel(session)
    offered = []
    for mask in (stack(0), samples.lifelike_lv(3.0).mask):
        session.anatomy = analyze(mask)
        offered.append([key for _, key in panel.mask.options])
        assert panel.mask.value == ("slices" if len(offered) == 1 else "misfit")
    assert "slices" in offered[0]
    assert "slices" not in offered[1]
    session.close()


def test_contours_of_views_run_along_their_slices() -> None:
    dense = samples.lifelike_lv(1.9).mask  # no pixel lies in a slice of the stack
    middle = int(np.argwhere(dense.voxels).mean(0)[0])
    voxels = np.zeros_like(dense.voxels)
    voxels[middle] = dense.voxels[middle]
    view = replace(dense, voxels=voxels)
    alone = analyze(samples.lifelike_lv((2.0, 2.0, 10.0)).mask)
    slices = with_views(alone, [view]).slices
    assert slices is not None
    assert alone.slices is not None
    along = _along(slices.outline, slices)
    added = along[len(alone.slices.outline.points) :]
    normal = dense.affine[:3, 0] / np.linalg.norm(dense.affine[:3, 0])
    assert len(added) > 50
    assert np.abs(added @ normal).max() < 1e-6
    np.testing.assert_allclose(np.linalg.norm(along, axis=1), 1)
    assert np.abs(added @ slices.normal).mean() > 0.6  # mostly from apex to base
