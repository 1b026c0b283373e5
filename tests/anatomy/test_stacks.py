"""Shape analysis of stacks: interpolation between slices, and what it measures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.ndimage as ndi

from heartgen import samples
from heartgen.anatomy import Anatomy, analyze
from heartgen.anatomy.interpolation import end_depth, part_of
from heartgen.errors import AnatomyError
from heartgen.images.mask import Mask

STACK = (1.5, 1.5, 8.0)


@pytest.fixture(scope="module")
def sample() -> samples.Sample:
    return samples.lifelike_lv(STACK)


@pytest.fixture(scope="module")
def anatomy(sample: samples.Sample) -> Anatomy:
    return analyze(sample.mask)


def without(mask: Mask, planes: list[int]) -> Mask:
    """A mask without some of its slices with data."""
    voxels = mask.voxels.copy()
    voxels[:, :, np.flatnonzero(mask.planes)[planes]] = False
    return replace(mask, voxels=voxels)


@pytest.mark.parametrize("phase", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("length", [40.0, 70.0])
def test_end_of_an_ellipsoid(phase: float, length: float) -> None:
    z = 10.0 * (np.arange(4) + phase)
    areas = 1200 * (1 - ((length - z) / length) ** 2)
    depth, roundness = end_depth(z, areas, 10.0)
    assert depth == pytest.approx(10.0 * phase, rel=1e-6)
    assert 0 < roundness < 1


def test_slices_are_kept_as_they_are_and_a_cone_between_them() -> None:
    i, j = np.meshgrid(np.arange(50), np.arange(50), indexing="ij")
    away = np.hypot(i - 25, j - 25)
    radii = np.array([6.0, 10.0, 14.0, 18.0])
    part = part_of(away < radii[:, None, None], 10.0 * np.arange(4), np.ones(2), 10.0)
    level = part.at(np.array([15.0, 20.0, 28.0]))
    for values, radius in zip(level, (12.0, 14.0, 17.2), strict=True):
        assert np.sqrt((values < 0).sum() / np.pi) == pytest.approx(radius, abs=0.25)
    assert -10 < part.heights[0] < 0


def test_sizes_are_those_of_the_dense_mask(anatomy: Anatomy) -> None:
    dense = analyze(samples.lifelike_lv(2.0).mask)
    assert anatomy.slices is not None
    assert anatomy.length == pytest.approx(dense.length, abs=5.0)  # slices end where they end
    assert anatomy.radius == pytest.approx(dense.radius, abs=0.6)
    assert anatomy.wall_thickness == pytest.approx(dense.wall_thickness, abs=0.6)
    assert anatomy.frame[:3, 2] @ dense.frame[:3, 2] > np.cos(np.radians(8))


def test_first_axis_is_the_normal_of_the_slices(sample: samples.Sample, anatomy: Anatomy) -> None:
    np.testing.assert_allclose(
        np.abs(sample.mask.affine[:3, 2] / 8 @ anatomy.frame[:3, 2]), 1, atol=1e-9
    )


def test_surfaces_meet_the_contours(anatomy: Anatomy) -> None:
    assert anatomy.slices is not None
    for name, points in anatomy.slices.contours.items():
        inside = anatomy.base.plane.height(points.points) < -3
        value, _ = anatomy.surfaces[name].sample(points.points[inside])
        assert np.abs(value).mean() < 0.1


def test_missing_middle_slice(sample: samples.Sample, anatomy: Anatomy) -> None:
    found = analyze(without(sample.mask, [4]))
    assert found.slices is not None
    assert len(found.slices.heights) == len(anatomy.slices.heights) - 1  # type: ignore[union-attr]
    assert found.pool_volume == pytest.approx(anatomy.pool_volume, rel=0.03)


def test_missing_basal_slices(sample: samples.Sample, anatomy: Anatomy) -> None:
    # The uppermost slice shows only a part of the wall and is left out anyway.
    found = analyze(without(sample.mask, [-1, -2, -3]))
    assert found.length == pytest.approx(anatomy.length - 16, abs=0.5)


@pytest.mark.slow
def test_both_ventricles() -> None:
    dense, stack = (analyze(samples.biv(s).mask) for s in (2.0, STACK))
    assert dense.rv is not None
    assert stack.rv is not None
    assert stack.rv.septal_thickness == pytest.approx(dense.rv.septal_thickness, abs=1.0)
    assert stack.rv.pool_volume == pytest.approx(dense.rv.pool_volume, rel=0.15)
    assert np.degrees(np.abs(stack.rv.insertion - dense.rv.insertion)).max() < 12


def test_walls_that_enclose_nothing_are_refused(sample: samples.Sample) -> None:
    voxels = sample.mask.voxels.copy()
    half = voxels.copy()
    half[: len(voxels) // 2] = False
    filled = np.stack(
        [ndi.binary_fill_holes(voxels[:, :, k]) for k in range(voxels.shape[2])], axis=2
    )
    for spoiled in (half, filled):
        with pytest.raises(AnatomyError, match="do not show a blood pool"):
            analyze(replace(sample.mask, voxels=spoiled))


def test_too_few_slices(sample: samples.Sample) -> None:
    shown = len(np.flatnonzero(sample.mask.planes))
    with pytest.raises(AnatomyError, match="too few"):
        analyze(without(sample.mask, [k for k in range(shown) if k not in (5, 6)]))
