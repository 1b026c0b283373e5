from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from heartgen import samples


@pytest.mark.slow
def test_lifelike_wall_tapers_from_base_to_apex(loaded):
    truth = loaded["lifelike"].truth
    endo, _ = truth.surface(4000, "endo")
    thickness = truth.distance(endo, "epi")
    height = endo[:, 2]
    assert 9 < thickness[height > 10].mean() < 11
    assert 4.5 < thickness[height < -55].mean() < 6
    assert thickness.min() > 4


def test_basal_plane_and_apex_are_where_the_mask_has_them(loaded):
    for name in ("ideal", "lifelike", "tilted"):
        truth = loaded[name].truth
        center, normal = truth.basal_plane
        base, _ = truth.surface(500, "base")
        assert np.abs((base - center) @ normal).max() < 0.05
        assert (truth.apex - center) @ normal < -75
        assert truth.distance(truth.apex[None], "endo")[0] < 1e-9
    tilt = np.degrees(np.arccos(loaded["lifelike"].truth.basal_plane[1][2]))
    assert 5 < tilt < 12


def test_irregular_rim_rises_and_falls_by_six_millimeters(loaded):
    truth = loaded["valves"].truth
    center, normal = truth.basal_plane
    base, weights = truth.surface(4000, "base")
    height = (base - center) @ normal
    assert 5 < height.max() < 6.5
    assert -6.5 < height.min() < -5
    assert abs(weights @ height / weights.sum()) < 0.5


def test_papillary_muscles_stand_free_above_and_merge_below(loaded):
    plain = samples.lifelike_lv().mask
    muscled = samples.lifelike_lv(papillary=True).mask
    assert (muscled.voxels | ~plain.voxels).all(), "the wall itself is untouched"
    muscle = muscled.voxels & ~plain.voxels
    assert ndimage.label(muscle)[1] == 2
    assert ndimage.label(muscled.voxels)[1] == 1

    def pieces(height):
        level = int(np.round(muscled.to_index(np.array([[0.0, 0.0, height]]))[0, 2]))
        return ndimage.label(muscled.voxels[:, :, level])[1]

    assert [pieces(z) for z in (5, -15, -38)] == [1, 3, 1]
    level = int(np.round(muscled.to_index(np.array([[0.0, 0.0, -15.0]]))[0, 2]))
    diameter = 2 * np.sqrt(muscle[:, :, level].sum() / 2 / np.pi)
    assert 7 < diameter < 9.5


def test_trabeculae_are_many_small_ridges_on_the_apical_endocardium(loaded):
    plain = samples.lifelike_lv()
    rough = samples.lifelike_lv(trabeculae=True)
    added = rough.mask.voxels & ~plain.mask.voxels
    assert (rough.mask.voxels | ~plain.mask.voxels).all()
    world = rough.mask.to_world(np.argwhere(added).astype(float))
    assert world[:, 2].max() < -15
    assert rough.truth.distance(world, "endo").max() < 3
    level = added[:, :, int(np.round(rough.mask.to_index(np.array([[0.0, 0.0, -42.0]]))[0, 2]))]
    assert ndimage.label(level, np.ones((3, 3)))[1] >= 8
    assert ndimage.label(rough.mask.voxels)[1] == 1


def test_noise_alone_separates_noisy_from_lifelike(loaded):
    assert loaded["noisy"].truth.shape == loaded["lifelike"].truth.shape
