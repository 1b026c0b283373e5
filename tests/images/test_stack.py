"""Slices of a stack: where they are in the world, and their smooth contours."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen import samples
from heartgen.images.contours import contour, planar_distance
from heartgen.images.mask import Mask
from heartgen.images.stack import stack_of

RADIUS = 9.3


def disc(radius: float, spacing: tuple[float, float]) -> np.ndarray:
    i, j = np.meshgrid(np.arange(40), np.arange(60), indexing="ij")
    return np.hypot((i - 19.4) * spacing[0], (j - 30.2) * spacing[1]) < radius


def test_an_isotropic_mask_is_no_stack() -> None:
    assert stack_of(samples.ideal_cup(3.0).mask) is None


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("empty", [0, 6])
def test_slices_keep_their_place_in_the_world(axis: int, empty: int) -> None:
    mask = samples.lifelike_lv((1.5, 1.5, 8.0), rotation=3).mask
    voxels, affine = mask.voxels, mask.affine
    if empty:  # empty planes between slices instead of long voxels
        wide = np.zeros((*voxels.shape[:2], voxels.shape[2] * (empty + 1)), dtype=bool)
        wide[..., :: empty + 1] = voxels
        voxels = wide
        affine = affine @ np.diag([1.0, 1.0, 1 / (empty + 1), 1.0])
    order = np.roll([0, 1, 2], axis + 1)
    moved = Mask(voxels.transpose(order), affine[:, [*order, 3]])
    stack = stack_of(moved)
    assert stack is not None
    assert stack.distance == pytest.approx(8.0)
    np.testing.assert_allclose(stack.spacing, 1.5)
    for one in (stack, stack.reversed()):
        n, i, j = np.nonzero(one.pixels)
        world = one.to_world(np.stack([i, j, one.heights[n]], -1).astype(float))
        expected = mask.to_world(np.argwhere(mask.voxels).astype(float))
        assert (np.diff(one.heights) > 0).all()
        np.testing.assert_allclose(
            world[np.lexsort(world.round(6).T)], expected[np.lexsort(expected.round(6).T)]
        )


@pytest.mark.parametrize("spacing", [(1.0, 1.0), (0.8, 0.8)])
def test_contour_of_a_disc(spacing: tuple[float, float]) -> None:
    sizes = np.array(spacing)
    found = contour(disc(RADIUS, spacing), sizes)
    offset = (found.points - [19.4, 30.2]) * sizes
    radius = np.linalg.norm(offset, axis=1)
    assert found.lengths.sum() == pytest.approx(2 * np.pi * RADIUS, rel=0.02)
    assert np.average(radius, weights=found.lengths) == pytest.approx(RADIUS, abs=0.1)
    assert (np.sum(found.normals * offset, axis=1) / radius).min() > 0.9


def test_planar_distance_of_a_shape_that_is_moved() -> None:
    spacing = np.array([1.2, 1.5])
    shape = disc(RADIUS, (1.2, 1.5))
    moved = planar_distance(shape, spacing, (2 * 1.2, -3 * 1.5))
    np.testing.assert_allclose(moved[2:, :-3], planar_distance(shape, spacing)[:-2, 3:], atol=1e-9)
    half = planar_distance(shape, spacing, (0.6, 0.0))
    i, j = np.meshgrid(np.arange(40), np.arange(60), indexing="ij")
    exact = np.hypot((i - 19.4) * 1.2 - 0.6, (j - 30.2) * 1.5) - RADIUS
    assert np.abs(np.mean(half - exact)) < 0.1


def test_planar_distance_of_a_disc() -> None:
    spacing = np.array([1.2, 1.2])
    found = planar_distance(disc(RADIUS, (1.2, 1.2)), spacing)
    i, j = np.meshgrid(np.arange(40), np.arange(60), indexing="ij")
    exact = np.hypot(i - 19.4, j - 30.2) * 1.2 - RADIUS
    assert np.abs(found - exact).max() < 0.6  # half a pixel
    assert np.abs(np.mean(found - exact)) < 0.1
