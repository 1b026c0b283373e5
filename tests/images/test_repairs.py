"""What the reader mends, it mends rightly and says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heartgen import mask_from_array
from heartgen.images.mask import LEFT_BLOOD
from heartgen.images.repairs import keep_largest


def cone(shape: tuple[int, int, int], step: int = 1) -> np.ndarray:
    """Thin rings that widen by more than their thickness from slice to slice: they do not touch."""
    i, j = np.mgrid[: shape[0], : shape[1]] - np.array(shape[:2])[:, None, None] / 2
    r = np.hypot(i, j)
    voxels = np.zeros(shape, dtype=bool)
    for n, k in enumerate(range(2, shape[2] - 2, step)):
        voxels[:, :, k] = (r >= 4 * n) & (r < 4 * n + 2)
    return voxels


def test_the_largest_piece_is_kept(cup):
    spoilt = cup.copy()
    spoilt[1:3, 1:3, 1:4] = 1
    spoilt[21, 19, 17] = 1
    mask = mask_from_array(spoilt, np.eye(4))
    np.testing.assert_array_equal(mask.voxels, cup.astype(bool))
    (finding,) = mask.findings
    assert finding.check == "components"
    assert not finding.fatal
    assert f"3 separate pieces: the largest ({cup.sum()} voxels)" in finding.message
    assert "(12, 1 voxels)" in finding.message


def test_pieces_that_share_a_corner_are_one():
    voxels = np.zeros((12, 12, 12), dtype=bool)
    voxels[2:6, 2:6, 2:6] = voxels[6:10, 6:10, 6:10] = True
    mask = mask_from_array(voxels, np.eye(4))
    assert mask.findings == ()
    assert mask.voxels.sum() == voxels.sum()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("lost", [1, 3])
def test_lost_planes_of_a_dense_heart_are_interpolated(cup, axis, lost):
    middle = cup.shape[axis] // 2
    spoilt = cup.copy()
    np.moveaxis(spoilt, axis, 0)[middle : middle + lost] = 0
    mask = mask_from_array(spoilt, np.eye(4))
    assert [f.check for f in mask.findings] == ["lost planes"]
    assert f"in {lost} plane(s)" in mask.findings[0].message
    assert f"{'ijk'[axis]} {middle}" in mask.findings[0].message
    assert (mask.voxels ^ cup.astype(bool)).sum() < 0.03 * cup.sum() * lost
    assert mask.voxels.sum() > 1.005 * spoilt.sum()


def test_planes_between_a_heart_and_an_island_are_not_filled(cup):
    spoilt = np.pad(cup, 6)
    last = np.flatnonzero(spoilt.any(axis=(0, 1)))[-1]
    spoilt[7:9, 7:9, last + 2] = 1
    mask = mask_from_array(spoilt, np.eye(4))
    assert [f.check for f in mask.findings] == ["components"]
    assert mask.voxels.sum() == cup.sum()


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_slices_of_a_stack_need_not_touch(axis):
    rings = cone((48, 48, 9))
    rings[2, 2, 4] = True
    spacing = np.array([1.5, 1.5, 10.0])
    stack = np.moveaxis(rings, 2, axis)
    affine = np.diag([*np.insert(spacing[:2], axis, spacing[2]), 1.0])
    mask = mask_from_array(stack, affine)
    assert mask.stack_axis == axis
    assert mask.voxels.sum() == rings.sum() - 1
    assert [f.check for f in mask.findings] == ["components"]


def test_slices_of_a_label_map_belong_together_whatever_gap_their_walls_have():
    mask = mask_from_array(cone((48, 48, 9)), np.diag([1.5, 1.5, 10.0, 1.0]))
    i, j = np.mgrid[:48, :48] - 24.0
    blood = np.zeros(mask.voxels.shape, dtype=np.uint8)
    for k in np.flatnonzero(mask.planes):
        wall = mask.voxels[:, :, k]
        blood[:, :, k][(np.hypot(i, j) < np.hypot(i, j)[wall].min()) & ~wall] = LEFT_BLOOD
    voxels = mask.voxels.copy()
    voxels[24, 24:, 4] = False
    slit = replace(mask, voxels=voxels)
    assert keep_largest(slit)[1] is not None
    kept, finding = keep_largest(replace(slit, blood=blood))
    assert finding is None
    np.testing.assert_array_equal(kept.voxels, voxels)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_empty_planes_between_slices_make_a_stack(axis):
    rings = np.moveaxis(cone((48, 48, 40), step=8), 2, axis)
    mask = mask_from_array(rings, np.eye(4))
    assert mask.stack_axis == axis
    assert mask.findings == ()
    np.testing.assert_array_equal(mask.voxels, rings)
    np.testing.assert_array_equal(np.flatnonzero(mask.planes), np.arange(2, 38, 8))


@given(st.lists(st.tuples(st.booleans(), st.booleans()), min_size=3, max_size=3))
def test_padding_leaves_the_heart_where_it_is(touching):
    heart = np.ones((6, 7, 8), dtype=bool)
    heart[2:4, 2:4, 2:5] = False
    margins = [(0 if low else 3, 0 if high else 3) for low, high in touching]
    affine = np.array([[0, -2.0, 0, 5], [1.5, 0, 0, -7], [0, 0, 1.0, 90], [0, 0, 0, 1]])
    voxels = np.pad(heart, margins)
    if voxels.size == heart.size or voxels[np.ix_(*[(0, -1)] * 3)].all():
        return  # inside out, and refused as such
    mask = mask_from_array(voxels, affine)
    before = np.argwhere(voxels) @ affine[:3, :3].T + affine[:3, 3]
    np.testing.assert_allclose(mask.to_world(np.argwhere(mask.voxels).astype(float)), before)
    faces = [np.take(mask.voxels, [0, -1], axis) for axis in range(3)]
    assert not any(face.any() for face in faces)
    assert [f.check for f in mask.findings] == ["border"] * any(map(any, touching))


def test_the_message_names_the_borders(cup):
    mask = mask_from_array(cup[:, :, 3:14], np.eye(4))
    assert "(first k, last k)" in mask.findings[0].message
    assert mask.voxels.shape == (24, 22, 11 + 4)
