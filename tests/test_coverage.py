"""Coverage: what a mesh leaves out of the image is no success, however small the mean error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.ndimage as ndi

import heartgen
from benchmarks.sparse import short_axis
from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.coverage import MOST_ABOVE, assess_coverage
from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD, Mask
from heartgen.result import Personalization
from heartgen.templates import lv_template

COARSE = 2.5
"""Voxel size that keeps the tests quick, mm."""


@pytest.fixture(scope="module")
def fitted() -> Personalization:
    return heartgen.personalize(samples.lifelike_lv(COARSE).mask, lod=1)


def test_a_fitted_mesh_covers_its_heart(fitted: Personalization) -> None:
    coverage = fitted.report.coverage
    assert coverage.wall == pytest.approx(1.0, abs=1e-3)
    assert coverage.contour > 0.99
    assert coverage.missed < 0.1
    assert coverage.finding is None
    assert fitted.report.success


def test_a_second_ventricle_that_is_not_meshed_is_told() -> None:
    both = samples.biv(COARSE).mask
    anatomy = analyze(both)
    left_alone = lv_template(anatomy, (1, 12, 6))
    coverage = assess_coverage(left_alone, both, anatomy)
    assert coverage.wall < 0.9
    assert coverage.missed > 10
    assert coverage.finding is not None
    assert coverage.finding.serious


def test_a_mesh_of_the_lower_half_is_told(fitted: Personalization) -> None:
    mask, anatomy = fitted.mask, fitted.anatomy
    low = analyze(mask, truncate=anatomy.length / 2.2)
    coverage = assess_coverage(fitted.mesh, mask, low)
    assert coverage.above > MOST_ABOVE
    assert coverage.finding is not None


def test_slices_above_the_base_count_if_they_show_a_pool() -> None:
    stack = short_axis(samples.lifelike_lv(COARSE).mask, 8.0)
    result = heartgen.personalize(stack, lod=1, optimize=False)
    low = analyze(stack, truncate=result.anatomy.length / 2.2)
    assert assess_coverage(result.mesh, stack, low).above > MOST_ABOVE
    above = low.base.surface.height(_centers(stack)).reshape(stack.voxels.shape) > 0
    filled = [ndi.binary_fill_holes(plane) for plane in np.moveaxis(stack.voxels, 2, 0)]
    solid = np.where(above, np.moveaxis(filled, 0, 2), stack.voxels)
    assert assess_coverage(result.mesh, replace(stack, voxels=solid), low).above < 0.01


@pytest.mark.parametrize("code", [LEFT_BLOOD, RIGHT_BLOOD])
def test_labeled_blood_in_the_wall_of_the_mesh_is_told(fitted: Personalization, code: int) -> None:
    mask, anatomy = fitted.mask, fitted.anatomy
    pool = np.zeros(mask.voxels.shape, dtype=np.uint8)
    pool[anatomy.surfaces["lv_endo"].sample(_centers(mask))[0].reshape(pool.shape) < 0] = code
    right = replace(mask, blood=pool)
    assert assess_coverage(fitted.mesh, right, anatomy).blood < 0.02
    # The same heart whose pool reaches half a wall farther than the mesh has it.
    wider = anatomy.surfaces["lv_endo"].sample(_centers(mask))[0].reshape(pool.shape) < 8
    coverage = assess_coverage(fitted.mesh, replace(mask, blood=wider * np.uint8(code)), anatomy)
    assert coverage.blood > 0.06
    assert coverage.finding is not None


@pytest.mark.slow
@pytest.mark.parametrize("slices", [1, 3])
def test_adjacent_slices_whose_pool_the_wall_fills_are_told(slices: int) -> None:
    stack = short_axis(samples.lifelike_lv(COARSE).mask, 8.0)
    result = heartgen.personalize(stack, lod=1)
    assert result.report.coverage.filled == 0
    centers = _centers(stack)
    endo, epi = (
        result.anatomy.surfaces[name].sample(centers)[0].reshape(stack.voxels.shape)
        for name in ("lv_endo", "epi")
    )
    middle = np.unravel_index(
        np.argmax(np.where(stack.voxels, np.minimum(endo, -epi), 0)), endo.shape
    )
    # A pool of its own, 4 mm around the middle of the wall, in some slices.
    axis = stack.stack_axis
    assert axis is not None
    away = stack.to_world(np.array([middle], dtype=float)) - centers
    away -= np.outer(away @ _across(stack), _across(stack))
    tube = np.linalg.norm(away, axis=1).reshape(endo.shape) < 4
    number = np.arange(endo.shape[axis]).reshape([-1 if a == axis else 1 for a in range(3)])
    tube &= np.abs(number - middle[axis]) <= slices // 2
    blood = np.where(tube, RIGHT_BLOOD, np.where(endo < 0, LEFT_BLOOD, 0)).astype(np.uint8)
    coverage = assess_coverage(result.mesh, replace(stack, blood=blood), result.anatomy)
    assert coverage.filled == slices
    told = coverage.finding is not None and "adjacent slices" in coverage.finding.message
    assert told == (slices > 1)


@pytest.mark.slow
def test_one_slice_that_the_mesh_does_not_follow_is_told() -> None:
    stack = short_axis(samples.lifelike_lv(COARSE).mask, 8.0)
    result = heartgen.personalize(stack, lod=1)
    assert result.report.coverage.slice_contour > 0.96
    slices = result.anatomy.slices
    assert slices is not None
    # A quarter of the outer contour of one slice, moved 10 mm off.
    epi = slices.contours["epi"]
    points = epi.points.copy()
    middle = len(slices.heights) // 2
    (inside,) = np.nonzero(np.abs(points @ slices.normal - slices.heights[middle]) < 1)
    side = np.cross(slices.normal, [1, 0, 0])
    far = inside[np.argsort(points[inside] @ side)[-len(inside) // 4 :]]
    points[far] += 10 * side / np.linalg.norm(side)
    contours = {**slices.contours, "epi": replace(epi, points=points)}
    anatomy = replace(result.anatomy, slices=replace(slices, contours=contours))
    coverage = assess_coverage(result.mesh, stack, anatomy)
    assert coverage.contour > 0.98
    lost = epi.weights[far].sum() / sum(
        c.weights[np.abs(c.points @ slices.normal - slices.heights[middle]) < 1].sum()
        for c in slices.contours.values()
    )
    assert coverage.slice_contour == pytest.approx(1 - lost, abs=0.02)
    assert coverage.finding is not None
    assert "of the outline of one slice" in coverage.finding.message


@pytest.mark.slow
@pytest.mark.parametrize("slices", [1, 2])
def test_a_wall_where_slices_have_none_is_told(slices: int) -> None:
    stack = short_axis(samples.lifelike_lv(COARSE).mask, 8.0)
    result = heartgen.personalize(stack, lod=1)
    assert result.report.coverage.stray < 0.006
    axis = stack.stack_axis
    assert axis is not None
    # Slices that show the heart 10 mm beside where the mesh is.
    voxels = np.moveaxis(stack.voxels.copy(), axis, 0)
    middle = len(voxels) // 2
    moved = slice(middle, middle + slices)
    voxels[moved] = np.roll(voxels[moved], round(10 / stack.pixel), axis=1)
    spoiled = replace(stack, voxels=np.moveaxis(voxels, 0, axis))
    anatomy = analyze(spoiled, take_back_shifts=False)
    coverage = assess_coverage(result.mesh, spoiled, anatomy)
    assert coverage.stray > 0.05
    assert (coverage.stray_on > 0.05) == (slices == 2)
    assert coverage.finding is not None
    assert "in one slice are farther than three pixels" in coverage.finding.message


@pytest.mark.slow
def test_a_gap_that_was_closed_is_no_stray_wall() -> None:
    stack = short_axis(samples.lifelike_lv(COARSE).mask, 8.0)
    axis = stack.stack_axis
    assert axis is not None
    pool = analyze(stack).surfaces["lv_endo"].sample(_centers(stack))[0] < 0
    blood = (pool.reshape(stack.voxels.shape) & ~stack.voxels) * np.uint8(LEFT_BLOOD)
    voxels = np.moveaxis(stack.voxels.copy(), axis, 0)
    plane = voxels[len(voxels) // 2]
    i, j = np.indices(plane.shape) - np.argwhere(plane).mean(0)[:, None, None]
    plane[(i > 0) & (np.abs(j) < i)] = False
    opened = replace(stack, voxels=np.moveaxis(voxels, 0, axis), blood=blood)
    result = heartgen.personalize(opened, lod=1)
    assert any(finding.check == "gaps" for finding in result.report.findings)
    assert result.report.coverage.stray < 0.005


@pytest.mark.parametrize(
    ("one", "two", "words"),
    [(0.04, 0.0, "one slice"), (0.019, 0.01, "two adjacent slices"), (0.019, 0.006, None)],
)
def test_less_of_a_wall_is_told_where_it_goes_on(
    fitted: Personalization, one: float, two: float, words: str | None
) -> None:
    finding = replace(fitted.report.coverage, stray=one, stray_on=two).finding
    assert (finding is None) == (words is None)
    assert words is None or (finding is not None and words in finding.message)


def _across(stack: Mask) -> np.ndarray:
    normal = stack.affine[:3, stack.stack_axis]
    return np.asarray(normal / np.linalg.norm(normal))


def _centers(mask: Mask) -> np.ndarray:
    return mask.to_world(np.argwhere(np.ones(mask.voxels.shape, dtype=bool)).astype(float))


def test_verdicts_by_our_rule_and_by_the_papers(fitted: Personalization) -> None:
    report = fitted.report
    assert report.status.startswith("success: ")
    far = replace(report, pixel_diagonal=report.accuracy.mean / 2)
    assert far.paper_success
    assert not far.success
    assert "a success by the paper's rule" in far.status
    folded = replace(report, quality=replace(report.quality, valid=False, invalid_elements=2))
    assert folded.paper_success
    assert not folded.success
    assert "2 elements fold" in folded.status
    told = far.to_dict()
    assert (told["success"], told["paper_success"]) == (False, True)


def test_the_limit_of_a_stack_is_in_the_plane_of_its_slices() -> None:
    voxels = np.zeros((20, 20, 20), dtype=bool)
    voxels[5:15, 5:15, 5:15] = True
    mask = Mask(voxels, np.diag([1.5, 1.5, 10.0, 1.0]))
    assert mask.pixel_diagonal == pytest.approx(1.5 * np.sqrt(2))
    assert mask.voxel_diagonal > 10
