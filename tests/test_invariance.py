"""The same heart gives the same mesh: elsewhere, in other units, and again."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import heartgen
from heartgen import samples
from heartgen.images import Mask
from heartgen.mesh.bases import deviation
from heartgen.result import Personalization
from heartgen.warping import warp


def moved(mask: Mask, rotation: np.ndarray, shift: np.ndarray, scale: float = 1.0) -> Mask:
    """The same voxels elsewhere in the world."""
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = scale * rotation, shift
    return Mask(mask.voxels, affine @ mask.affine, mask.name)


@pytest.mark.slow
@pytest.mark.parametrize("scale", [1.0, 0.1, 0.3])
def test_equivariance_under_motion_and_units(
    lifelike: samples.Sample, fitted: Personalization, scale: float
) -> None:
    rotation = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    shift = np.array([40.0, -10.0, 5.0])
    other = heartgen.personalize(moved(lifelike.mask, rotation, shift, scale))
    xi = np.random.default_rng(0).uniform(size=(20, 3))
    expected = scale * fitted.mesh.evaluate(xi) @ rotation.T + shift
    assert np.abs(other.mesh.evaluate(xi) - expected).max() < 0.05 * scale
    assert other.report.quality.mean == pytest.approx(fitted.report.quality.mean, abs=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("order", "flips"), [((2, 0, 1), ()), ((0, 1, 2), (0, 2)), ((1, 0, 2), (1,))]
)
def test_equivariance_under_the_order_of_image_axes(
    lifelike: samples.Sample,
    fitted: Personalization,
    order: tuple[int, int, int],
    flips: tuple[int, ...],
) -> None:
    mask = lifelike.mask
    voxels = mask.voxels.transpose(order)
    index = np.zeros((4, 4))
    for new, old in enumerate(order):
        index[old, new] = 1
    index[3, 3] = 1
    for axis in flips:
        voxels = np.flip(voxels, axis)
        turn = np.eye(4)
        turn[axis, axis], turn[axis, 3] = -1, voxels.shape[axis] - 1
        index = index @ turn
    same = Mask(np.ascontiguousarray(voxels), mask.affine @ index, mask.name)
    assert np.allclose(
        np.sort(same.to_world(np.argwhere(same.voxels).astype(float)), axis=0),
        np.sort(mask.to_world(np.argwhere(mask.voxels).astype(float)), axis=0),
    )
    xi = np.random.default_rng(0).uniform(size=(20, 3))
    other = heartgen.personalize(same)
    assert np.abs(other.mesh.evaluate(xi) - fitted.mesh.evaluate(xi)).max() < 0.05


@pytest.mark.slow
def test_two_runs_agree_bit_for_bit(lifelike: samples.Sample, fitted: Personalization) -> None:
    again = heartgen.personalize(lifelike.mask)
    assert np.array_equal(again.mesh.dofs, fitted.mesh.dofs)


@pytest.mark.slow
def test_several_levels_at_once_give_the_same_meshes(lifelike: samples.Sample) -> None:
    both = heartgen.personalize_levels(lifelike.mask, (1, 2))
    for lod, result in zip((1, 2), both, strict=True):
        alone = heartgen.personalize(lifelike.mask, lod=lod)
        assert np.array_equal(result.mesh.dofs, alone.mesh.dofs)
        assert result.options == alone.options


@pytest.mark.slow
def test_the_lagrange_basis_is_the_same_mesh(
    lifelike: samples.Sample, fitted: Personalization
) -> None:
    lagrange = heartgen.personalize(lifelike.mask, basis="lagrange")
    assert lagrange.mesh.topology.basis == "lagrange"
    assert deviation(lagrange.mesh, fitted.mesh) < 1e-9
    assert lagrange.report.quality.valid


def test_warp_of_an_affine_map_is_exact(fitted: Personalization) -> None:
    affine = np.eye(4)
    affine[:3] = np.random.default_rng(2).standard_normal((3, 4))
    carried = warp(fitted.template, lambda p: p @ affine[:3, :3].T + affine[:3, 3])
    expected = fitted.template.transformed(affine)
    assert np.abs(carried.control - expected.control).max() < 1e-8
