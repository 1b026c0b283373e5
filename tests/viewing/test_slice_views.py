from __future__ import annotations

import io

import numpy as np
import pytest

from heartgen import samples
from heartgen.anatomy import analyze

pytest.importorskip("matplotlib")

from matplotlib.colors import same_color
from matplotlib.image import imread

from heartgen.viewing import draw_slices
from heartgen.viewing.slice_views import BASE, SLICES


def slice_of(figure, panel):
    """Voxels shown in a panel, and the area of one of their pixels in mm^2."""
    image = figure.axes[panel].images[0]
    left, right, bottom, top = image.get_extent()
    voxels = np.asarray(image.get_array())
    return voxels, (right - left) * (top - bottom) / voxels.size


@pytest.fixture(scope="module")
def figure(result):
    return draw_slices(result.mask, result.anatomy)


def test_picture_is_not_empty(figure):
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=50)
    buffer.seek(0)
    picture = imread(buffer)[..., :3]
    assert len(np.unique(picture.reshape(-1, 3), axis=0)) > 50
    assert 0.1 < (picture < 0.95).any(-1).mean() < 0.6


def test_there_are_three_slices_named_and_measured(figure, result):
    assert [axes.get_title() for axes in figure.axes] == [s.title for s in SLICES]
    assert result.mask.name in figure.get_suptitle()
    assert f"{result.anatomy.length:.3g} mm" in figure.get_suptitle()


@pytest.mark.parametrize("panel", range(3))
def test_surfaces_are_drawn_on_the_mask(figure, panel, result):
    """Voxels lie between endocardium and epicardium, to within the voxel that contours cut."""
    axes = figure.axes[panel]
    voxels, _ = slice_of(figure, panel)
    left, right, bottom, top = axes.images[0].get_extent()
    sides = [c for c in axes.collections if not same_color(c.get_edgecolor(), BASE)]
    contours = [c.get_paths() for c in sides]
    assert len(contours) == 2
    edge = np.concatenate([p.vertices for paths in contours for p in paths])
    column = (edge[:, 0] - left) / (right - left) * (voxels.shape[1] - 1)
    row = (edge[:, 1] - bottom) / (top - bottom) * (voxels.shape[0] - 1)
    reach = int(np.ceil(2 * result.anatomy.voxel / (right - left) * voxels.shape[1]))
    mixed = [
        0 < voxels[max(r - reach, 0) : r + reach, max(c - reach, 0) : c + reach].mean() < 1
        for r, c in zip(row.astype(int), column.astype(int), strict=True)
    ]
    assert np.mean(mixed) > 0.99


@pytest.mark.parametrize("panel", [0, 1])
def test_base_is_drawn_where_the_mesh_ends(figure, panel):
    contours = figure.axes[panel].collections
    (base,) = [c for c in contours if same_color(c.get_edgecolor(), BASE)]
    heights = np.concatenate([path.vertices for path in base.get_paths()])[:, 1]
    assert np.abs(heights).max() < 1e-6


@pytest.mark.slow
def test_slices_follow_the_heart_not_the_image():
    areas = []
    for turn in (None, 3):
        mask = samples.lifelike_lv(2.0, rotation=turn).mask
        figure = draw_slices(mask, analyze(mask))
        areas.append(
            [voxels.sum() * pixel for voxels, pixel in map(slice_of, [figure] * 3, range(3))]
        )
    assert areas[1] == pytest.approx(areas[0], rel=0.06)
