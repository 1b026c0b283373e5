from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy import ndimage

from heartgen import samples


@pytest.mark.slow
@pytest.mark.parametrize("make", [samples.ideal_cup, samples.lifelike_lv, samples.biv])
def test_voxel_volume_converges_to_the_truth(make):
    error = []
    for spacing in (4.0, 2.0, 1.0):
        poses = [make(spacing, rotation=seed, translation=(0.3, seed, 0.1)) for seed in range(4)]
        ratio = [s.mask.volume / s.truth.wall_volume for s in poses]
        error.append(np.sqrt(np.mean(np.square(np.array(ratio) - 1))))
    assert error[-1] < 5e-4
    assert error[0] / error[-1] > 4, "at least first order in the spacing"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ideal", "lifelike", "valves", "tilted", *samples.names(2)])
def test_named_masks_have_the_true_volume(name, loaded):
    """Also where the base is parallel to the voxel planes: it must fall between two of them."""
    assert_allclose(loaded[name].mask.volume, loaded[name].truth.wall_volume, rtol=1.5e-3)


@pytest.mark.parametrize("name", ["ideal", "lifelike", "tilted", *samples.names(2)])
def test_cavity_volume_is_that_of_the_voxels_the_wall_and_the_base_enclose(name, loaded):
    mask, truth = loaded[name].mask, loaded[name].truth
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    center, normal = truth.basal_plane
    above = ((world - center) @ normal > 0).reshape(mask.voxels.shape)
    rooms, _ = ndimage.label(~(mask.voxels | above))
    middle = np.round(mask.to_index(((center + truth.apex) / 2)[None]))[0].astype(int)
    cavity = rooms == rooms[tuple(middle)]
    assert_allclose(cavity.sum() * np.prod(mask.spacing), truth.cavity_volume, rtol=2e-3)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["ideal", "lifelike", "valves", "tilted", *samples.names(2)])
def test_edge_of_the_mask_lies_at_the_true_surface(name, loaded):
    sample = loaded[name]
    voxels = sample.mask.voxels
    assert not voxels[[0, -1]].any()
    assert not voxels[:, [0, -1]].any()
    assert not voxels[:, :, [0, -1]].any()
    edge = voxels & ~ndimage.binary_erosion(voxels)
    world = sample.mask.to_world(np.argwhere(edge).astype(float))
    assert sample.truth.distance(world).max() < sample.mask.spacing.max() + 1e-6


@pytest.mark.slow
def test_noise_flips_the_asked_share_of_boundary_voxels_only():
    clean = samples.lifelike_lv(2.0)
    noisy = samples.lifelike_lv(2.0, noise=0.3, seed=5)
    boundary = ndimage.binary_dilation(clean.mask.voxels) & ~ndimage.binary_erosion(
        clean.mask.voxels
    )
    flipped = clean.mask.voxels ^ noisy.mask.voxels
    assert not (flipped & ~boundary).any()
    assert_allclose(flipped.sum() / boundary.sum(), 0.3, atol=0.03)
    assert (noisy.mask.voxels != samples.lifelike_lv(2.0, noise=0.3, seed=6).mask.voxels).any()
    probe, _ = clean.truth.surface(50)
    assert noisy.truth.distance(probe).max() < 1e-6
