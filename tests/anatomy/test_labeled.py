"""Pools of a stack whose labels tell them: no threshold is asked, whatever the wall looks like."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heartgen.anatomy.interpolation import part_of
from heartgen.anatomy.short_axis_contours import ShortAxisContours, find_sections
from heartgen.errors import AnatomyError
from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD
from heartgen.images.stack import Stack

SHAPE = (100, 110)
LEFT, RIGHT = (40.0, 70.0), (40.0, 40.0)
I, J = np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij")
SLICES = 8


def disc(center: tuple[float, float], radius: float) -> np.ndarray:
    return np.hypot(I - center[0], J - center[1]) < radius


def labeled(right: range, n: int = SLICES) -> Stack:
    """Slices from the apex upwards; the right pool, without any wall, in some of them."""
    walls, blood = [], []
    for k in range(n):
        radius = 8.0 + k
        left = disc(LEFT, radius)
        walls.append(disc(LEFT, radius + 6) & ~left)
        pools = np.where(left, np.uint8(LEFT_BLOOD), np.uint8(0))
        beside = disc(RIGHT, 6.0 + 1.5 * k) & ~disc(LEFT, radius + 6)
        pools[beside & (k in right)] = RIGHT_BLOOD
        blood.append(pools)
    heights = 10.0 * np.arange(n)
    return Stack(np.stack(walls), heights, 10.0, np.diag([1.5, 1.5, 1, 1]), np.stack(blood))


def sections(stack: Stack, ventricles: str = "auto") -> ShortAxisContours:
    found = find_sections(stack, ventricles)
    assert found is not None
    return found


def test_a_right_pool_in_one_slice_is_a_right_ventricle() -> None:
    stack = labeled(range(SLICES - 1, SLICES))
    found = sections(stack)
    assert found.right is not None
    assert stack.blood is not None
    np.testing.assert_array_equal(found.right[-1], stack.blood[-1] == RIGHT_BLOOD)
    np.testing.assert_array_equal(found.left, stack.blood == LEFT_BLOOD)


def test_a_pool_is_where_its_label_is_though_the_wall_has_a_gap() -> None:
    stack = labeled(range(2, SLICES))
    walls = stack.pixels.copy()
    walls[4, :, 70:][np.abs(I[:, 70:] - 40) < 4] = False  # eight pixels of the free wall
    found = sections(replace(stack, pixels=walls))
    assert stack.blood is not None
    np.testing.assert_array_equal(found.left, stack.blood == LEFT_BLOOD)
    assert "gaps" in [f.check for f in found.findings]


def test_slices_above_the_right_ventricle_are_left_out_and_named() -> None:
    found = sections(labeled(range(1, SLICES - 2)))
    assert len(found.heart) == SLICES - 2
    assert found.right is not None
    assert found.right[-1].any()
    (told,) = [f.message for f in found.findings if f.check == "slices"]
    assert f"{SLICES - 1}, {SLICES} of {SLICES}" in told


def test_order_of_the_slices_does_not_matter() -> None:
    stack = labeled(range(1, SLICES))
    one, other = sections(stack), sections(stack.reversed())
    np.testing.assert_array_equal(one.left, other.left)


def test_the_right_ventricle_tells_where_the_apex_is_of_a_heart_wider_there() -> None:
    # An aneurysm: the left pool is widest in the lowest slice, which is the last that was scanned.
    stack = labeled(range(2, SLICES))
    assert stack.blood is not None
    left = stack.blood == LEFT_BLOOD
    blood = np.where(stack.blood == RIGHT_BLOOD, stack.blood, np.uint8(0))
    blood[left[::-1]] = LEFT_BLOOD
    walls = stack.pixels[::-1] & (blood == 0)
    found = sections(replace(stack, pixels=walls, blood=blood))
    assert found.stack.heights[0] == 0
    assert found.left[0].sum() > found.left[-1].sum()


@pytest.mark.parametrize(("right", "asked"), [(range(2, SLICES), "lv"), (range(0), "biv")])
def test_what_is_asked_for_must_be_there(right: range, asked: str) -> None:
    with pytest.raises(AnatomyError, match="blood pool"):
        find_sections(labeled(right), asked)


def test_a_narrow_slanted_pool_goes_on_between_slices_that_it_leaves() -> None:
    shapes = np.stack([disc((30.0 + 12 * k, 50.0), 5.0) for k in range(4)])
    part = part_of(shapes, 10.0 * np.arange(4), np.ones(2), 10.0)
    between = part.at(np.array([5.0, 15.0, 25.0]))
    for k, level in enumerate(between):
        inside = np.argwhere(level < 0)
        assert np.pi * 4**2 < len(inside) < np.pi * 6**2
        assert np.abs(inside.mean(0) - (36.0 + 12 * k, 50.0)).max() < 2.0
    # In the slices themselves it is what they show.
    for shape, level in zip(shapes, part.at(10.0 * np.arange(4)), strict=True):
        assert (shape != (level < 0)).sum() <= 0.1 * shape.sum()
