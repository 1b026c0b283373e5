"""In-plane shifts of slices: found where they are clear, and taken back."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.anatomy.short_axis_contours import ShortAxisContours, find_sections
from heartgen.anatomy.slice_alignment import find_shifts, without_shifts
from heartgen.images.mask import Mask
from heartgen.images.stack import stack_of

PIXEL = 1.5
STACK = (PIXEL, PIXEL, 8.0)


def shifted(mask: Mask, pixels: np.ndarray) -> Mask:
    """A mask whose slices with data are moved by whole pixels (n, 2)."""
    voxels = np.pad(mask.voxels, ((12, 12), (12, 12), (0, 0)))
    for plane, move in zip(np.flatnonzero(mask.planes), pixels, strict=True):
        voxels[:, :, plane] = np.roll(voxels[:, :, plane], move, axis=(0, 1))
    affine = mask.affine.copy()
    affine[:3, 3] = mask.to_world(np.array([[-12.0, -12.0, 0.0]]))[0]
    return replace(mask, voxels=voxels, affine=affine)


def sections_of(mask: Mask) -> ShortAxisContours:
    stack = stack_of(mask)
    assert stack is not None
    found = find_sections(stack)
    assert found is not None
    return found


def without_trend(values: np.ndarray) -> np.ndarray:
    along = np.vander(np.arange(len(values)), 2)
    return np.asarray(values - along @ np.linalg.lstsq(along, values, rcond=None)[0])


@pytest.fixture(scope="module", params=["lv", "biv"])
def mask(request: pytest.FixtureRequest) -> Mask:
    make = samples.lifelike_lv if request.param == "lv" else samples.biv
    return make(STACK).mask


@pytest.fixture(scope="module")
def moves(mask: Mask) -> np.ndarray:
    return np.random.default_rng(3).normal(0, 2, (int(mask.planes.sum()), 2)).round().astype(int)


@pytest.mark.slow
def test_shifts_are_found(mask: Mask, moves: np.ndarray) -> None:
    sections = sections_of(shifted(mask, moves))
    found = find_shifts(sections)
    true = moves * PIXEL
    # The basal slice of the lifelike heart shows a part of the wall only, and is left out; where
    # the apex is at the upper end, sections are in the opposite order.
    if sections.stack.affine[2, 2] * mask.affine[2, 2] < 0:
        true = true[::-1]
    true = true[: len(found)]
    left = without_trend(found - true)
    assert np.sqrt(np.mean(left**2)) < 0.5 * np.sqrt(np.mean(without_trend(true) ** 2))


def test_no_shifts_where_there_are_none(mask: Mask) -> None:
    sections = sections_of(mask)
    assert not find_shifts(sections).any()
    assert without_shifts(sections) is sections


@pytest.mark.parametrize("move", [(12, 0), (-4, 11)])
def test_a_step_between_two_slices_is_taken_back_whole(mask: Mask, move: tuple[int, int]) -> None:
    """As between two breath-holds: one half of the slices lies aside of the other."""
    n = int(mask.planes.sum())
    sizes = np.where(np.arange(n)[:, None] < n // 2, 0, move)
    found = find_shifts(sections_of(shifted(mask, sizes)))
    parts = np.linalg.norm(np.diff(found, axis=0), axis=1)
    size = float(np.hypot(*move)) * PIXEL
    assert parts.max() == pytest.approx(size, abs=0.15 * size)
    assert np.sort(parts)[-2] < 0.15 * size


def test_a_single_slice_aside_is_no_step(mask: Mask) -> None:
    n = int(mask.planes.sum())
    sizes = np.where(np.arange(n)[:, None] == n // 2, (12, 0), 0)
    found = np.linalg.norm(find_shifts(sections_of(shifted(mask, sizes))), axis=1)
    assert np.sort(found)[-2] < 0.5 * found.max()


def test_place_and_tilt_are_no_shifts(mask: Mask) -> None:
    n = int(mask.planes.sum())
    tilt = np.stack([np.arange(n), -np.arange(n)], axis=1) - n // 2
    assert not find_shifts(sections_of(shifted(mask, tilt))).any()


def test_mean_and_trend_of_what_is_found_are_zero(mask: Mask, moves: np.ndarray) -> None:
    sections = sections_of(shifted(mask, moves))
    has_both = sections.left.any(axis=(1, 2)).all()
    found = find_shifts(sections)
    assert np.abs(found.mean(0)).max() < 1e-9 or not has_both
    assert np.abs(found).max() > 1


def test_few_slices_tell_nothing(mask: Mask, moves: np.ndarray) -> None:
    sections = sections_of(shifted(mask, moves))
    few = slice(2, 7)
    part = replace(
        sections,
        stack=replace(
            sections.stack,
            pixels=sections.stack.pixels[few],
            heights=sections.stack.heights[few],
        ),
        heart=sections.heart[few],
        left=sections.left[few],
        right=None if sections.right is None else sections.right[few],
        shifts=sections.shifts[few],
    )
    assert not find_shifts(part).any()


@pytest.mark.slow
def test_slices_are_moved_back(mask: Mask, moves: np.ndarray) -> None:
    as_given = shifted(mask, moves)
    straight = analyze(mask)
    off, auto = (analyze(as_given, take_back_shifts=take) for take in (False, True))
    assert auto.slices is not None
    assert off.slices is not None
    assert not off.slices.shifts.any()
    np.testing.assert_allclose(auto.slices.shifts @ auto.slices.normal, 0, atol=1e-12)
    np.testing.assert_allclose(auto.slices.given.points, off.slices.given.points, atol=1e-9)
    assert any(f.check == "slice alignment" and "moved back" in f.message for f in auto.findings)

    # up to place and tilt, the surfaces are again those of the heart without shifts
    def misfit(found: object) -> float:
        points = straight.slices.contours["epi"].points  # type: ignore[union-attr]
        values = found.surfaces["epi"].sample(points)[0]  # type: ignore[attr-defined]
        return float(np.abs(values).mean())

    assert misfit(auto) < 0.8 * misfit(off)


@pytest.mark.slow
def test_contours_and_surfaces_stay_together(mask: Mask, moves: np.ndarray) -> None:
    anatomy = analyze(shifted(mask, moves))
    assert anatomy.slices is not None
    for name, contour in anatomy.slices.contours.items():
        inside = anatomy.base.plane.height(contour.points) < -3
        value, _ = anatomy.surfaces[name].sample(contour.points[inside])
        assert np.abs(value).mean() < 0.15
