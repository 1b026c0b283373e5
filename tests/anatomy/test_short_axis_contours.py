"""Parts of the heart in the slices of a stack, told apart whatever their walls look like."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.short_axis_contours import ShortAxisContours, find_sections
from heartgen.anatomy.slice_tracking import without_slits
from heartgen.errors import AnatomyError
from heartgen.images.stack import Stack

SHAPE = (100, 110)
LEFT, RIGHT = (40.0, 70.0), (40.0, 38.0)
I, J = np.meshgrid(*(np.arange(n) for n in SHAPE), indexing="ij")


def disc(center: tuple[float, float], radius: float) -> np.ndarray:
    return np.hypot(I - center[0], J - center[1]) < radius


def slices(n: int = 8, both: bool = True, drift: float = 0.0, thick: float = 6.0) -> np.ndarray:
    """Slices from a closed apex upwards: a thick ring, and beside it a thin one."""
    out = [disc(LEFT, 10.0)]
    for k in range(1, n):
        left = (LEFT[0] + drift * k, LEFT[1])
        radius = 5.0 + 2 * k
        wall = disc(left, radius + thick) & ~disc(left, radius)
        if both and k > 1:
            right = (RIGHT[0] + drift * k, RIGHT[1])
            outer, inner = disc(right, radius + 3), disc(right, radius)
            wall |= outer & ~inner & ~disc(left, radius + thick)
        out.append(wall)
    return np.stack(out)


def stack(pixels: np.ndarray, pixel: float = 1.5) -> Stack:
    heights = 10.0 * np.arange(len(pixels))
    return Stack(pixels, heights, 10.0, np.diag([pixel, pixel, 1.0, 1.0]))


def sections(pixels: np.ndarray, ventricles: str = "auto") -> ShortAxisContours:
    found = find_sections(stack(pixels), ventricles)
    assert found is not None
    return found


@pytest.mark.parametrize("drift", [0.0, 3.0])
def test_pools_are_told_apart(drift: float) -> None:
    found = sections(slices(drift=drift))
    assert found.right is not None
    for k in range(1, 8):
        assert found.left[k, int(LEFT[0] + drift * k), int(LEFT[1])]
        if k > 1:
            assert found.right[k, int(RIGHT[0] + drift * k), int(RIGHT[1]) - 4]
    assert not found.left[0].any()
    assert not (found.left & found.right).any()
    assert not ((found.left | found.right) & ~found.heart).any()


@pytest.mark.slow
def test_of_two_walls_of_one_thickness_the_round_pool_is_the_left_one() -> None:
    found = sections(slices(thick=3.0))
    assert found.right is not None
    assert found.left[-1, int(LEFT[0]), int(LEFT[1])]
    mirrored = sections(slices(thick=3.0)[:, :, ::-1])
    assert mirrored.left[-1, int(LEFT[0]), SHAPE[1] - 1 - int(LEFT[1])]


def test_one_ventricle() -> None:
    found = sections(slices(both=False))
    assert found.right is None
    assert found.findings == ()


@pytest.mark.slow
def test_order_of_the_slices_does_not_matter() -> None:
    pixels = slices()
    up, down = sections(pixels), sections(pixels[::-1])
    np.testing.assert_array_equal(up.left, down.left)
    np.testing.assert_array_equal(up.heart, down.heart)
    np.testing.assert_allclose(down.stack.normal, -up.stack.normal)


def test_gap_in_the_wall_is_closed() -> None:
    pixels = slices(both=False)
    pixels[4, 37:43, 70:] = False  # a slot of nine mm
    found = sections(pixels)
    whole = sections(slices(both=False))
    assert "gaps" in [f.check for f in found.findings]
    assert (found.left[4] ^ whole.left[4]).sum() < 60


def test_gap_in_the_septum_keeps_the_pools_apart() -> None:
    pixels = slices()
    pixels[6, 38:42, 45:60] = False
    found = sections(pixels)
    assert found.right is not None
    assert found.left[6, 40, 75]
    assert found.right[6, 40, 34]


@pytest.mark.slow
def test_islands_and_holes_are_not_taken_for_anatomy() -> None:
    pixels = slices(both=False)
    pixels[3, 5:8, 5:8] = True  # an island outside
    pixels[5, 40:43, 69:72] = True  # one in the pool
    pixels[6, 40, 91] = False  # a hole in the wall
    found, whole = sections(pixels), sections(slices(both=False))
    np.testing.assert_array_equal(found.left, whole.left)
    np.testing.assert_array_equal(found.heart, whole.heart)


def test_slice_with_an_open_wall_is_left_out() -> None:
    pixels = slices(both=False)
    pixels[4, :, :72] = False  # half a ring
    found = sections(pixels)
    assert len(found.heart) == 7
    assert "slices" in [f.check for f in found.findings]


def test_slices_along_the_axis_are_not_short_axis() -> None:
    cup = (
        (np.hypot(I - 40.0, (J - 10) / 2) < 30) & ~(np.hypot(I - 40.0, (J - 10) / 2) < 22) & (J > 9)
    )
    assert find_sections(stack(np.stack([cup] * 5))) is None


def test_a_mask_without_pool_is_not_short_axis() -> None:
    assert find_sections(stack(np.stack([disc(LEFT, 9.0)] * 5))) is None


@pytest.mark.parametrize(("both", "asked"), [(True, "lv"), (False, "biv")])
def test_what_is_asked_for_must_be_there(both: bool, asked: str) -> None:
    with pytest.raises(AnatomyError, match="blood pool"):
        sections(slices(both=both), asked)


@pytest.mark.slow
def test_valves_above_the_base_are_left_out() -> None:
    pixels = slices(9)
    pixels[7] &= J > 62  # a part of the wall, whose gap closes over a smaller pool
    pixels[8] = disc((30.0, 55.0), 3.0)
    found, whole = sections(pixels), sections(slices(7))
    np.testing.assert_array_equal(found.left[:7], whole.left)
    assert len(found.heart) <= 8
    assert found.stack.heights[0] == 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_a_wall_of_one_pixel_with_gaps_is_seen(seed: int) -> None:
    pixels = slices()
    chance = np.random.default_rng(seed)
    for k in range(2, len(pixels)):
        radius = 5.0 + 2 * k
        thin = disc(RIGHT, radius + 1) & ~disc(LEFT, radius + 6)
        pixels[k] &= disc(LEFT, radius + 6) | thin
        pixels[k] &= disc(LEFT, radius + 6) | (chance.random(SHAPE) > 0.2)
    found, whole = sections(pixels), sections(slices())
    assert found.right is not None
    assert whole.right is not None
    for mine, theirs in ((found.left, whole.left), (found.right, whole.right)):
        assert (mine ^ theirs).sum() < 0.1 * theirs.sum()


def test_an_apex_with_a_hole_is_no_base() -> None:
    pixels = slices(both=False)
    pixels[0] &= ~disc((LEFT[0] - 7, LEFT[1]), 3.5)  # a notch
    pixels[1] = False
    found = sections(np.delete(pixels, 1, axis=0))
    assert found.stack.heights[0] == 0
    pixels[0] = disc(LEFT, 10.0) & ~disc(LEFT, 1.5)  # a hole too small to be a pool
    found = sections(np.delete(pixels, 1, axis=0))
    assert found.stack.heights[0] == 0


@pytest.mark.slow
def test_a_right_ventricle_seen_in_one_slice_is_told_by_its_thin_wall() -> None:
    pixels = slices(8, both=False)
    pixels[7] = slices(8)[7]
    found = sections(pixels)
    assert found.right is not None
    assert found.right[-1].any()


def test_a_muscle_that_parts_the_left_pool_makes_no_right_ventricle() -> None:
    pixels = slices(8, both=False)
    pixels[7] |= disc(LEFT, 20.0) & (np.abs(J - LEFT[1] - 3) < 2)
    assert sections(pixels).right is None


def test_a_filled_base_is_no_apex() -> None:
    pixels = np.concatenate([slices(8, both=False)[1:], [disc(LEFT, 26.0)]])
    found = sections(pixels)
    assert len(found.heart) == 7
    assert found.left[0].sum() < found.left[-1].sum()
    (told,) = [f.message for f in found.findings if f.check == "slices"]
    assert "8 of 8" in told


def rings(radii: NDArray[np.float64], wall: float = 7.0) -> NDArray[np.bool_]:
    """Slices (n, nx, ny) of a left ventricle of some radii, with a wall, pixels."""
    return np.stack([disc(LEFT, r + wall) & ~disc(LEFT, r) for r in radii])


def test_a_cap_below_a_wide_aneurysm_is_its_apex() -> None:
    aneurysm = rings(np.linspace(16, 14.5, 7))
    found = sections(np.concatenate([[disc(LEFT, 18.0)], aneurysm]))
    assert len(found.heart) == 8
    assert not found.left[0].any()
    assert found.left[1].sum() > found.left[-1].sum()
    assert found.findings == ()


@pytest.mark.parametrize("apex_first", [False, True])
def test_a_right_pool_that_is_not_taken_tells_the_base(apex_first: bool) -> None:
    tube = stack(rings(np.array([15, 15.5, 16, 16, 15.5, 15, 14.8])))
    right = np.array([0, 0, 80, 200, 300, 400, 450])
    upward = 1 if apex_first else -1
    found = find_sections(replace(tube, beside=right[::upward]))
    assert found is not None
    assert found.stack.normal[2] == upward
    assert found.findings == ()


@pytest.mark.parametrize("turned", [False, True])
def test_a_heart_as_wide_at_both_ends_is_told(turned: bool) -> None:
    tube = rings(np.array([15, 15.5, 16, 16, 15.5, 15, 14.8]))
    (told,) = sections(tube[::-1] if turned else tube).findings
    assert told.serious
    assert f"the {'first' if turned else 'last'} slice" in told.message


def test_the_apex_is_where_the_heart_narrows() -> None:
    radii = np.array([12.0, 14, 16, 17, 16, 14, 11.5])  # of the pool, which is no help
    heart = np.stack(
        [disc(LEFT, r + w) & ~disc(LEFT, r) for r, w in zip(radii, range(4, 11), strict=True)]
    )
    found = sections(heart[::-1])
    assert found.heart[0].sum() < found.heart[-1].sum()
    assert found.findings == ()


@pytest.mark.parametrize("width", [1, 2])
def test_slits_through_the_wall_are_closed_and_the_rest_stays(width: int) -> None:
    whole = slices(both=False, thick=14.0)
    slit = whole.copy()
    slit[3::2, int(LEFT[0]) : int(LEFT[0]) + width, : int(LEFT[1])] = False
    assert slit.sum() < whole.sum()
    closed, meant = sections(slit).heart, sections(whole).heart
    assert not (closed & ~meant).any()
    assert (meant & ~closed).sum(axis=(1, 2)).max() <= width  # its mouth stays open


def test_corners_between_two_ventricles_are_no_slits() -> None:
    for pixels in slices():
        filled = ndi.binary_fill_holes(pixels)
        np.testing.assert_array_equal(without_slits(filled, filled & ~pixels), filled)
