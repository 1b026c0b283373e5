"""The shape analysis finds both ventricles of a phantom, or says what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.errors import AnatomyError
from heartgen.images import Mask, read_mask

LEFT, WALL = np.array([24.0, 24.0, 70.0]), 10.0
"""Semi-axes of the left pool, and its wall, mm."""

RIGHT, THIN, CENTER = np.array([30.0, 34.0, 58.0]), 4.0, np.array([32.0, 0.0, 0.0])
"""Semi-axes of the right ventricle's ellipsoid, its wall, mm, and where it lies."""


def within(points: np.ndarray, axes: np.ndarray, center: np.ndarray | float = 0.0) -> np.ndarray:
    """Whether points lie in an ellipsoid."""
    return np.asarray((((points - center) / axes) ** 2).sum(-1) < 1)


def pools(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether points of the heart's frame lie in the left and in the right pool."""
    right = within(points, RIGHT, CENTER) & ~within(points, LEFT + WALL)
    return within(points, LEFT), right


def heart(points: np.ndarray, right_scale: float = 1.0) -> np.ndarray:
    """Whether points of the heart's frame lie in the myocardium."""
    outer = within(points, LEFT + WALL)
    free = within(points, RIGHT * right_scale + THIN, CENTER)
    hollow = within(points, RIGHT * right_scale, CENTER) & ~outer
    wall = (outer | free) & ~within(points, LEFT) & ~hollow
    return np.asarray(wall & (points[..., 2] < 0))


def image(
    rotation: np.ndarray | None = None,
    spacing: tuple[float, float, float] = (2.0, 2.0, 2.0),
    scale: float = 1.0,
    right_scale: float = 1.0,
) -> Mask:
    """Voxelize the phantom: world = rotation times scale times heart."""
    turn = np.eye(3) if rotation is None else rotation
    count = np.ceil(220 * scale / np.array(spacing)).astype(int)
    affine = np.diag([*spacing, 1.0])
    affine[:3, 3] = turn @ [15 * scale, 0, -35 * scale] - 110 * scale
    index = np.stack(np.meshgrid(*[np.arange(n) for n in count], indexing="ij"), -1)
    world = index * np.diag(affine)[:3] + affine[:3, 3]
    return Mask(heart(world @ turn / scale, right_scale), affine)


def grid(step: float = 0.25) -> np.ndarray:
    """Points of the half plane y = 0."""
    x, z = np.meshgrid(np.arange(0, 70, step), np.arange(-80, 0, step), indexing="ij")
    return np.stack([x, np.zeros_like(x), z], -1)


def expected_insertion(height: float) -> np.ndarray:
    """Angles of the right pool's extent seen from the axis at one height."""
    x, y = np.meshgrid(np.arange(-70, 70, 0.1), np.arange(-70, 70, 0.1), indexing="ij")
    points = np.stack([x, y, np.full_like(x, height)], -1)
    _, right = pools(points)
    angle = np.arctan2(y, x)[right]
    return np.array([angle.min(), angle.max()])


def check(mask: Mask, axes: np.ndarray, scale: float = 1.0) -> None:
    """Compare everything that is measured with the phantom's truth."""
    voxel = float(np.prod(mask.spacing) ** (1 / 3))
    found = analyze(mask)
    right = found.rv
    assert right is not None
    assert np.degrees(np.arccos(min(1.0, found.frame[:3, 2] @ axes[:, 2]))) < 1.5
    assert np.degrees(np.arccos(min(1.0, found.frame[:3, 0] @ axes[:, 0]))) < 1.5
    assert np.linalg.det(found.frame[:3, :3]) == pytest.approx(1)
    assert np.linalg.norm(found.frame[:3, 3]) < voxel
    assert found.wall_thickness == pytest.approx(
        WALL * scale, abs=0.4 * voxel + 0.05 * WALL * scale
    )
    assert right.septal_thickness == pytest.approx(
        WALL * scale, abs=0.4 * voxel + 0.05 * WALL * scale
    )
    assert right.wall_thickness == pytest.approx(THIN * scale, abs=0.4 * voxel)
    assert found.length == pytest.approx(70 * scale, abs=1.6 * mask.spacing.max())
    _, inside = pools(grid())
    lowest = float(grid()[inside][:, 2].min())
    assert right.apex_level == pytest.approx(lowest * scale, abs=1.6 * mask.spacing.max())
    insertion = expected_insertion(right.apex_level / scale / 2)
    # The pool ends in edges; what is narrower than two voxels there cannot be seen.
    edge = 2 * voxel / (LEFT[0] + WALL) / scale
    assert right.insertion == pytest.approx(insertion, abs=edge)
    width = 0.25 * inside.sum(0).max()
    assert right.width == pytest.approx(width * scale, abs=1.5 * voxel)
    assert list(found.surfaces) == ["lv_endo", "rv_endo", "epi", "base"]
    assert found.base.truncation is None


@pytest.mark.slow
@settings(max_examples=3)
@given(seed=st.integers(0, 1000))
def test_both_ventricles_in_any_orientation(seed: int) -> None:
    turn = Rotation.random(random_state=seed).as_matrix()
    check(image(turn), turn)


@pytest.mark.slow
@pytest.mark.parametrize("spacing", [(1.0, 1.0, 2.5), (2.0, 1.2, 1.2)])
def test_voxels_may_be_anisotropic(spacing: tuple[float, float, float]) -> None:
    check(image(spacing=spacing), np.eye(3))


@pytest.mark.slow
def test_hearts_may_be_small() -> None:
    check(image(spacing=(0.4, 0.4, 0.4), scale=0.2), np.eye(3), scale=0.2)


@pytest.mark.slow
@pytest.mark.parametrize("order", [(1, 2, 0), (2, 1, 0)])
@pytest.mark.parametrize("flip", [None, 0, 2])
def test_order_and_direction_of_image_axes_do_not_matter(
    order: tuple[int, int, int], flip: int | None
) -> None:
    turn = Rotation.random(random_state=3).as_matrix()
    mask = image(turn)
    voxels, affine = mask.voxels.transpose(order), mask.affine[:, [*order, 3]].copy()
    if flip is not None:
        affine[:3, 3] += (voxels.shape[flip] - 1) * affine[:3, flip]
        affine[:3, flip] *= -1
        voxels = np.flip(voxels, flip)
    one, other = analyze(mask), analyze(Mask(np.ascontiguousarray(voxels), affine))
    assert one.rv is not None
    assert other.rv is not None
    assert np.abs(one.frame - other.frame).max() < 0.005 * 2.0
    assert one.rv.wall_thickness == pytest.approx(other.rv.wall_thickness, abs=0.02)
    assert one.rv.insertion == pytest.approx(other.rv.insertion, abs=0.01)


@pytest.mark.slow
def test_mirrored_heart_has_mirrored_insertions() -> None:
    turn = Rotation.from_euler("xyz", [20, 10, 0], degrees=True).as_matrix()
    mask = image(turn)
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    one, other = analyze(mask), analyze(Mask(mask.voxels, mirror @ mask.affine))
    assert one.rv is not None
    assert other.rv is not None
    assert other.rv.insertion == pytest.approx(-one.rv.insertion[::-1], abs=0.02)


@pytest.mark.slow
def test_right_ventricle_may_be_large_or_small() -> None:
    for scale in (0.75, 1.3):
        found = analyze(image(right_scale=scale))
        assert found.rv is not None
        assert found.wall_thickness == pytest.approx(WALL, abs=0.8 + 0.05 * WALL)
        assert found.frame[0, 0] > 0.99


@pytest.mark.slow
@pytest.mark.parametrize("spacing", [1.5, 2.0])
def test_right_pool_reaches_into_the_corners(spacing: float) -> None:
    mask = image(spacing=(spacing,) * 3)
    found = analyze(mask)
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    _, right = pools(world)
    inside = right & ~mask.voxels.ravel() & (world[:, 2] < -3 * spacing)
    depth = found.surfaces["rv_endo"].sample(world[inside])[0]
    assert depth.max() < 0.7 * spacing


@pytest.mark.slow
def test_thin_walls_are_kept_apart() -> None:
    mask = image(spacing=(1.5, 1.5, 1.5))
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    hole = (np.abs(world[:, 1]) < 1) & (np.abs(world[:, 2] + 30) < 1) & (world[:, 0] > 0)
    voxels = mask.voxels & ~(hole & (world[:, 0] < 50)).reshape(mask.voxels.shape)
    found = analyze(Mask(voxels, mask.affine))
    left, right = found.surfaces["lv_endo"].values, found.surfaces["rv_endo"].values
    assert not ((left < 0) & (right < 0)).any()
    assert (left + right).min() > 1.49
    assert found.length == pytest.approx(70, abs=2)


@pytest.mark.slow
def test_merged_pools_are_named() -> None:
    mask = image()
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    hole = (np.hypot(world[:, 1], world[:, 2] + 32) < 9) & (world[:, 0] > 0) & (world[:, 0] < 45)
    with pytest.raises(AnatomyError, match="hole in the septum"):
        analyze(Mask(mask.voxels & ~hole.reshape(mask.voxels.shape), mask.affine))


@pytest.mark.slow
def test_closed_right_ventricle_is_named() -> None:
    mask = image()
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    lid = heart_filled(world) & (np.abs(world[:, 2] + 2) < 2.5) & ~within(world, LEFT)
    with pytest.raises(AnatomyError, match="right ventricle has no opening"):
        analyze(Mask(mask.voxels | lid.reshape(mask.voxels.shape), mask.affine))


def heart_filled(points: np.ndarray) -> np.ndarray:
    """Whether points lie in the wall or in a pool."""
    outer = within(points, LEFT + WALL) | within(points, RIGHT + THIN, CENTER)
    return np.asarray(outer & (points[..., 2] < 0))


@pytest.mark.slow
def test_ventricles_can_be_demanded() -> None:
    both, left = image(), samples.ideal_cup(2.0).mask
    assert analyze(both, ventricles="biv").rv is not None
    assert analyze(left, ventricles="lv").rv is None
    with pytest.raises(AnatomyError, match="two blood pools found"):
        analyze(both, ventricles="lv")
    with pytest.raises(AnatomyError, match="one blood pool found"):
        analyze(left, ventricles="biv")
    with pytest.raises(AnatomyError, match="auto, lv or biv"):
        analyze(left, ventricles="rv")


@pytest.mark.slow
def test_base_with_valves_is_truncated_and_measures_like_the_plain_one(shared_data: Path) -> None:
    found = analyze(read_mask(shared_data / "biv" / "bivme_patient1_f00_valves.nii.gz"))
    plain = analyze(read_mask(shared_data / "biv_cycle" / "bivme_patient1_f00.nii.gz"))
    assert found.base.truncation is not None
    assert found.rv is not None
    assert plain.rv is not None
    # The plain mask was cut across the image's axis, not along the valves.
    assert found.frame[:3, 2] @ plain.frame[:3, 2] > np.cos(np.radians(20))
    assert found.wall_thickness == pytest.approx(plain.wall_thickness, abs=0.5)
    assert found.rv.wall_thickness == pytest.approx(plain.rv.wall_thickness, abs=0.3)


@pytest.mark.slow
def test_tilted_heart_measures_like_the_upright_one(shared_data: Path) -> None:
    upright = analyze(read_mask(shared_data / "biv" / "cobiveco_geo1.nii.gz"))
    native = analyze(read_mask(shared_data / "biv" / "cobiveco_geo1_native.nii.gz"))
    assert upright.rv is not None
    assert native.rv is not None
    for one, other in ((upright, native), (upright.rv, native.rv)):
        assert one.wall_thickness == pytest.approx(other.wall_thickness, abs=0.2)
    assert upright.radius == pytest.approx(native.radius, abs=0.5)
    assert upright.rv.septal_thickness == pytest.approx(native.rv.septal_thickness, abs=0.2)
    assert np.degrees(upright.rv.insertion - native.rv.insertion) == pytest.approx(0, abs=4)


@pytest.mark.slow
def test_rabbit_heart(shared_data: Path) -> None:
    found = analyze(read_mask(shared_data / "animal" / "UCSD_heart.nii.gz"))
    assert found.rv is not None
    assert found.wall_thickness > 1.5 * found.rv.wall_thickness
    assert 20 < found.length < 35
