"""The right ventricular wall has the thickness asked for, is closed, and is open at the base."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.ndimage as ndi
from scipy.spatial.transform import Rotation

from heartgen.images.rv_wall import Parts, build_rv_wall

FINE = np.array([0.5, 0.5, 0.5])  # mm, to measure true volumes on
TURN = Rotation.from_euler("xyz", [25, 40, 10], degrees=True).as_matrix()


def parts_of(labels):
    return Parts(*(labels == label for label in (2, 3, 1, 7)))


def true_volume(heart, thickness, planes=None):
    """Volume of the wall, mm^3; of one that is built in planes at given heights, mm^2."""
    at = heart.image(FINE)[1]
    if planes is not None:
        at = at[:, :, :1].repeat(len(planes), axis=2)
        at[..., 2] = planes
    far = heart.distance(at, in_plane=planes is not None)
    left = np.linalg.norm(at, axis=-1) <= heart.lv_wall
    shell = (far > 0) & (far <= thickness) & ~left & (at[..., 2] <= 0)
    return shell.sum() * np.prod(FINE[: 3 if planes is None else 2])


def bare(labels, wall):
    """Voxels of background that share a face with the right pool."""
    return ndi.binary_dilation(labels == 1) & (labels == 0) & ~wall


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spacing", "thickness", "rotation", "tolerance"),
    [
        ([1.0, 1.0, 1.0], 3.0, None, 0.03),
        ([0.8, 0.8, 0.8], 5.0, TURN, 0.03),
        ([1.4, 1.4, 1.4], 3.0, TURN, 0.05),
        ([1.9, 1.9, 1.9], 3.0, TURN, 0.06),
        ([1.3, 1.3, 2.5], 3.0, None, 0.06),
        ([1.2, 2.0, 1.6], 4.0, TURN, 0.06),
    ],
)
def test_wall_is_as_thick_as_asked_closed_and_open_at_the_base(
    heart, spacing, thickness, rotation, tolerance
):
    affine, at = heart.image(np.array(spacing), rotation)
    labels = heart.labels(at)
    wall, findings = build_rv_wall(parts_of(labels), affine, thickness)
    volume = wall.sum() * np.prod(spacing)
    assert volume == pytest.approx(true_volume(heart, thickness), rel=tolerance)
    assert heart.distance(at)[wall].max() < thickness + np.linalg.norm(spacing) / 2
    assert not wall[labels > 0].any()
    height = at[..., 2]
    assert height[wall].max() <= 0
    assert height[bare(labels, wall)].min() > -1.5 * max(spacing)  # at the base, nowhere else
    assert (height[bare(labels, wall)] > 0).mean() > 0.9
    assert [f.check for f in findings] == ["rv wall"]
    assert f"one of {thickness:g} mm was built around its blood pool, open at the base" in (
        findings[0].message
    )
    assert ndi.label(wall | (labels == 2), np.ones((3, 3, 3)))[1] == 1


@pytest.mark.parametrize("pixel", [0.8, 1.2, 1.5, 1.9])
@pytest.mark.parametrize("flipped", [False, True])
def test_in_slices_far_apart_each_outline_gets_its_wall(heart, pixel, flipped):
    affine, at = heart.image(np.array([pixel, pixel, 8.0]))
    labels = heart.labels(at)[:, :, :: -1 if flipped else 1]
    wall, findings = build_rv_wall(parts_of(labels), affine, 3.0)
    wall, labels = (a[:, :, :: -1 if flipped else 1] for a in (wall, labels))
    planes = at[0, 0, (labels == 1).any(axis=(0, 1)), 2]
    assert wall.sum() * pixel**2 == pytest.approx(true_volume(heart, 3.0, planes), rel=0.04)
    np.testing.assert_array_equal(wall.any(axis=(0, 1)), (labels == 1).any(axis=(0, 1)))
    in_plane = np.zeros((3, 3, 3), dtype=bool)
    in_plane[:, 1, 1] = in_plane[1, :, 1] = True
    uncovered = ndi.binary_dilation(labels == 1, in_plane) & (labels == 0) & ~wall
    assert not uncovered.any()
    lowest = (labels == 1)[:, :, (labels == 1).any(axis=(0, 1)).argmax()]
    area = lowest.sum() * pixel**2
    assert f"left open at its lower end, over {area:.0f} mm²" in findings[1].message


@pytest.mark.parametrize("flipped", [False, True])
def test_the_lower_end_is_closed_if_the_stack_and_the_wall_reach_the_next_slice(heart, flipped):
    affine, at = heart.image(np.array([1.4, 1.4, 5.0]))
    labels = heart.labels(at)
    last = int((labels == 1).any(axis=(0, 1)).argmax()) + 1
    labels[..., last - 1][labels[..., last - 1] == 1] = 0

    def built(labels, thickness):
        turned = labels[:, :, :: -1 if flipped else 1]
        wall, findings = build_rv_wall(parts_of(turned), affine, thickness)
        return wall[:, :, :: -1 if flipped else 1], findings

    wall, findings = built(labels, 3.0)
    assert len(findings) == 1
    open_end = (labels[..., last] == 1) & ~wall[..., last - 1] & (labels[..., last - 1] == 0)
    assert not open_end.any()
    assert wall[..., last - 1].any()
    wall, findings = built(labels, 2.0)
    assert "the wall does not reach the next slice" in findings[1].message
    wall, findings = built(labels[:, :, last:], 3.0)
    assert "the stack ends" in findings[1].message
    labels[..., :last] = 0  # the image goes on, and shows nothing more
    wall, findings = built(labels, 3.0)
    assert "the stack ends" in findings[1].message
    assert not wall[..., :last].any()


@pytest.mark.parametrize("flipped", [False, True])
@pytest.mark.parametrize("apex", ["closed", "cut off"])
@pytest.mark.parametrize("step", [1, 2])
def test_a_basal_slice_that_is_filled_is_no_apex(heart, flipped, apex, step):
    affine, at = heart.image(np.array([1.4, 1.4, 5.0]))
    labels = heart.labels(at)
    if apex == "cut off":  # where the left pool is wide, and the right one half of what it is above
        labels[at[..., 2] < -18] = 0
        labels[(labels == 1) & (at[..., 2] < -10) & (at[..., 1] > 0)] = 0
    labels[..., [k for k in range(labels.shape[2]) if k % step]] = 0
    top = int(np.flatnonzero((labels == 3).any(axis=(0, 1)))[-1])
    labels[..., top][labels[..., top] == 3] = 2
    turned = labels[:, :, :: -1 if flipped else 1]
    wall, findings = build_rv_wall(parts_of(turned), affine, 3.0)
    wall = wall[:, :, :: -1 if flipped else 1]
    assert not wall[..., top + 1 :].any()
    lowest = (labels == 1)[..., (labels == 1).any(axis=(0, 1)).argmax()]
    assert f"lower end, over {lowest.sum() * 1.4**2:.0f} mm²" in findings[1].message


@pytest.mark.parametrize("flipped", [False, True])
def test_slices_at_uneven_distances_have_a_lower_end(heart, flipped):
    affine, at = heart.image(np.array([1.4, 1.4, 5.0]))
    labels = heart.labels(at)
    labels = labels[:, :, (labels > 0).any(axis=(0, 1)).argmax() :]
    labels[..., 0][labels[..., 0] == 1] = 0
    labels[..., 2::2] = 0  # the first two are neighbors
    wall, findings = build_rv_wall(parts_of(labels[:, :, :: -1 if flipped else 1]), affine, 3.0)
    assert wall.any()
    assert "lower end" in findings[1].message


def test_a_pool_of_the_next_slice_puts_no_wall_beside_that_of_this_one(heart):
    affine, at = heart.image(np.array([1.4, 1.4, 5.0]))
    labels = heart.labels(at)
    wall, _ = build_rv_wall(parts_of(labels), affine, 3.0)
    for k in np.flatnonzero((labels == 1).any(axis=(0, 1)))[1:-1]:
        away = ndi.distance_transform_edt(labels[..., k] != 1, 1.4)
        assert away[wall[..., k]].max() < 3.0 + 1.4


@pytest.mark.parametrize("spacing", [[1.4, 1.4, 1.4], [1.4, 1.4, 8.0]])
def test_order_and_direction_of_the_axes_do_not_matter(heart, spacing):
    affine, at = heart.image(np.array(spacing))
    labels = heart.labels(at)
    wall, _ = build_rv_wall(parts_of(labels), affine, 3.0)
    for axes in [(2, 0, 1), (1, 2, 0), (0, 2, 1)]:
        turned = affine[:, [*axes, 3]]
        other, _ = build_rv_wall(parts_of(labels.transpose(axes)[::-1, :, ::-1]), turned, 3.0)
        different = other[::-1, :, ::-1] ^ wall.transpose(axes)
        assert different.sum() < 0.005 * wall.sum()


@pytest.mark.slow
@pytest.mark.parametrize("spacing", [[1.0, 1.0, 1.0], [1.4, 1.4, 8.0]])
def test_unlabeled_left_pool_makes_no_difference(heart, spacing):
    affine, at = heart.image(np.array(spacing))
    labels = heart.labels(at)
    wall, _ = build_rv_wall(parts_of(labels), affine, 3.0)
    labels[labels == 3] = 0
    other, _ = build_rv_wall(parts_of(labels), affine, 3.0)
    np.testing.assert_array_equal(other, wall)


@pytest.mark.parametrize("spacing", [[1.0, 1.0, 1.0], [1.5, 1.5, 4.0]])
def test_wall_rises_no_higher_than_the_left_ventricle(heart, spacing):
    affine, at = heart.image(np.array(spacing))
    labels = heart.labels(at, rv_top=12.0)
    wall, findings = build_rv_wall(parts_of(labels), affine, 3.0)
    assert at[..., 2][wall].max() <= 0
    assert "the left ventricle's wall" in findings[0].message
    labels = heart.labels(at, rv_top=-8.0)
    wall, _ = build_rv_wall(parts_of(labels), affine, 3.0)
    assert at[..., 2][wall].max() <= -8
    assert at[..., 2][wall].max() > -8 - max(spacing)


@pytest.mark.parametrize("gap", [0.0, 1.0])
def test_wall_is_open_where_the_pool_meets_the_atrium_alone(heart, gap):
    affine, at = heart.image(np.array([1.0, 1.0, 1.0]))
    labels = heart.labels(at)
    x, y, z = np.moveaxis(at, -1, 0)
    beside = np.hypot(x + 36, y)
    labels[(beside < 10) & (z > gap) & (z < 13)] = 7
    wall, findings = build_rv_wall(parts_of(labels), affine, 3.0)
    assert "open to the right atrium" in findings[0].message
    uncovered = bare(np.where(labels == 7, 0, labels), wall)
    assert (beside[uncovered] < 13).all()
    over = (z == 1) & (heart.distance(at - [0, 0, 1]) < 0)
    assert uncovered[over & (beside < 9)].all()
    assert wall[over & (beside > 14)].all()


def test_far_atrium_does_not_count(heart):
    affine, at = heart.image(np.array([1.5, 1.5, 1.5]))
    labels = heart.labels(at)
    wall, _ = build_rv_wall(parts_of(labels), affine, 3.0)
    labels[at[..., 2] > 10] = 7
    other, findings = build_rv_wall(parts_of(labels), affine, 3.0)
    np.testing.assert_array_equal(other, wall)
    assert "open at the base" in findings[0].message


def test_wall_thinner_than_a_voxel_is_one_voxel(heart):
    affine, at = heart.image(np.array([2.5, 2.5, 2.5]))
    labels = heart.labels(at)
    wall, findings = build_rv_wall(parts_of(labels), affine, 1.0)
    assert "1 mm, one voxel where voxels are larger (2.5 mm)" in findings[0].message
    assert at[..., 2][bare(labels, wall)].min() > -2.5
    assert heart.distance(at)[wall].max() < 2.5 * np.sqrt(3)


def test_pool_that_is_a_thread_gets_no_wall(heart):
    affine, at = heart.image(np.array([1.5, 1.5, 1.5]))
    parts = parts_of(heart.labels(at))
    thread = np.zeros_like(parts.rv_pool)
    thread[5, 5:40, 10] = True
    _, findings = build_rv_wall(replace(parts, rv_pool=thread), affine, 3.0)
    assert findings[0].fatal
    assert "too thin for a wall (35 voxels)" in findings[0].message
