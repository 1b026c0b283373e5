from __future__ import annotations

import itertools
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from heartgen import samples

SIGNED_PERMUTATIONS = [
    np.diag(signs)[:, order]
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1.0, -1.0), repeat=3)
]


def wall_points(sample):
    """World coordinates of the voxels of the mask, sorted."""
    points = sample.mask.to_world(np.argwhere(sample.mask.voxels).astype(float))
    return np.unique(np.round(points, 6) + 0.0, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize("make", [samples.lifelike_lv, samples.biv])
@given(seed=st.integers(0, 1000), scale=st.sampled_from([0.1, 0.3, 1.0, 1.2]))
@settings(max_examples=8)
def test_truth_moves_with_the_heart(make, seed, scale):
    rotation = Rotation.random(None, np.random.default_rng(seed)).as_matrix()
    shift = np.array([10.0, -20.0, 30.0])
    still = make(5.0).truth
    moved = make(5.0 * scale, rotation=rotation, translation=shift, scale=scale).truth
    points, weights = still.surface(300)
    there, there_weights = moved.surface(300)
    assert_allclose(there, scale * points @ rotation.T + shift, atol=1e-9)
    assert_allclose(there_weights, scale**2 * weights)
    assert_allclose(moved.wall_volume, scale**3 * still.wall_volume)
    assert_allclose(moved.cavity_volume, scale**3 * still.cavity_volume)
    probe = np.random.default_rng(seed).uniform(-50, 50, (50, 3))
    assert_allclose(
        moved.distance(scale * probe @ rotation.T + shift), scale * still.distance(probe), atol=1e-6
    )
    (center, normal), (there_center, there_normal) = still.basal_plane, moved.basal_plane
    assert_allclose(there_center, scale * rotation @ center + shift)
    assert_allclose(there_normal, rotation @ normal)
    assert_allclose(moved.apex, scale * rotation @ still.apex + shift)
    assert_allclose(moved.long_axis, rotation @ still.long_axis)
    if make is samples.biv:
        assert_allclose(moved.rv.cavity_volume, scale**3 * still.rv.cavity_volume)
        for size in ("wall", "septum", "apex_level"):
            assert_allclose(getattr(moved.rv, size), scale * getattr(still.rv, size))
        for point in ("apex", "centroid", "left_centroid", "insertions", "grooves"):
            there = scale * getattr(still.rv, point) @ rotation.T + shift
            assert_allclose(getattr(moved.rv, point), there)
        assert_allclose(moved.rv.towards, rotation @ still.rv.towards)
        assert_allclose(moved.rv.insertion_angles, still.rv.insertion_angles)


@pytest.mark.slow
@pytest.mark.parametrize("direction", SIGNED_PERMUTATIONS[::5])
@pytest.mark.parametrize("make", [partial(samples.lifelike_lv, papillary=True), samples.biv])
def test_order_and_sign_of_the_image_axes_do_not_change_the_heart(make, direction):
    spacing = np.array([2.0, 2.5, 3.0])
    placed = {"rotation": 3, "translation": (5.0, 0.7, -3.0)}
    straight = make(spacing, **placed)
    turned = make(np.abs(direction.T) @ spacing, direction=direction, **placed)
    assert_allclose(turned.mask.affine[:3, :3] / turned.mask.spacing, direction)
    assert_array_equal(wall_points(turned), wall_points(straight))


@pytest.mark.slow
@pytest.mark.parametrize("make", [samples.lifelike_lv, samples.biv])
def test_scaled_heart_on_a_scaled_grid_has_the_same_voxels(make):
    """Human in mm and in cm."""
    small = make(0.2, scale=0.1)
    assert_array_equal(small.mask.voxels, make(2.0).mask.voxels)
    assert_allclose(small.mask.spacing, 0.2)
