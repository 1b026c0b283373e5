"""From mask to mesh: truth, invariance, repeatability."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import heartgen
from heartgen import samples
from heartgen.enhancement import enhance
from heartgen.errors import AnatomyError, Cancelled, InputError
from heartgen.images import Mask
from heartgen.mesh.bases import deviation
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import sample_faces
from heartgen.optimization import FitSettings, fit_target, misfit, settings_for
from heartgen.options import OPTIMIZED_PASSES, OPTIMIZED_PASSES_OF_ONE, STEPS
from heartgen.result import Personalization
from heartgen.warping import warp

COARSE = 2.0
"""Voxel size that keeps the tests quick, mm."""


@pytest.fixture(scope="module")
def lifelike() -> samples.Sample:
    """A real-looking ventricle at coarse voxels."""
    return samples.lifelike_lv(COARSE, noise=0.1, seed=4)


@pytest.fixture(scope="module")
def fitted(lifelike: samples.Sample) -> Personalization:
    """Its mesh at the first level of detail."""
    return heartgen.personalize(lifelike.mask)


def test_result_is_valid_good_and_described(fitted: Personalization) -> None:
    report = fitted.report
    assert report.quality.valid
    assert report.success
    assert report.quality.mean > 0.5
    assert report.quality.scaled_mean > 0.9
    assert report.accuracy.mean < 0.25 * COARSE
    assert report.fold_bound > 0
    assert set(report.seconds) == set(STEPS)
    again = json.loads(report.to_json())
    assert again["accuracy"]["mean"] == report.accuracy.mean
    assert again["success"] is True
    assert report.name in str(report)


@pytest.mark.slow
def test_quality_does_not_cost_accuracy_unless_asked(
    lifelike: samples.Sample, monkeypatch: pytest.MonkeyPatch
) -> None:
    def much_too_much(*which: Any) -> FitSettings:
        settings = settings_for(*which)
        return replace(settings, even=10 * settings.even)

    monkeypatch.setattr("heartgen.pipeline.settings_for", much_too_much)
    kept = heartgen.personalize(lifelike.mask, lod=4)
    asked = heartgen.personalize(lifelike.mask, lod=4, quality=1.01)
    target = fit_target(kept.anatomy)
    allowed = misfit(kept.enhanced, target)
    assert 0.9 * allowed < misfit(kept.mesh, target) <= allowed
    assert misfit(asked.mesh, target) > allowed
    assert asked.report.quality.mean > kept.report.quality.mean


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_smooth_phantom_in_any_orientation_against_its_true_surface(seed: int) -> None:
    sample = samples.ideal_cup(1.0, rotation=seed)
    result = heartgen.personalize(sample.mask, lod=2)
    mesh, truth = result.mesh, sample.truth
    points, _, weights = sample_faces(mesh, mesh.topology.external, 8)
    assert np.average(truth.distance(points), weights=weights) < 0.12
    assert volume(mesh) == pytest.approx(truth.wall_volume, rel=0.01)
    endo, normals, area = sample_faces(mesh, mesh.topology.surfaces["lv_endo"], 8)
    # Divergence theorem with the cone from the center of the base: the flat lid adds nothing.
    lid = truth.basal_plane[0]
    cavity = float(np.einsum("nx,nx,n->", endo - lid, -normals, area)) / 3
    assert cavity == pytest.approx(truth.cavity_volume, rel=0.01)


@pytest.mark.slow
def test_mesh_follows_the_wall_not_the_papillary_muscles() -> None:
    sample = samples.load("papillary")
    result = heartgen.personalize(sample.mask, lod=1)
    mesh = result.mesh
    assert "papillary muscles" in {f.check for f in result.report.findings}
    points, _, weights = sample_faces(mesh, mesh.topology.surfaces["lv_endo"], 8)
    error = np.average(sample.truth.distance(points, "endo"), weights=weights)
    assert error < 0.5


@pytest.mark.slow
def test_valve_anatomy_is_truncated_and_the_wall_below_it_fitted() -> None:
    sample = samples.load("valves")
    result = heartgen.personalize(sample.mask)
    assert result.anatomy.base.truncation is not None
    assert result.report.success
    for name, truth in (("lv_endo", "endo"), ("epi", "epi")):
        points, _, weights = sample_faces(result.mesh, result.mesh.topology.surfaces[name], 6)
        assert np.average(sample.truth.distance(points, truth), weights=weights) < 0.3
    off = heartgen.personalize(sample.mask, truncate="off")
    assert off.anatomy.base.truncation is None


@pytest.mark.slow
def test_truncation_by_a_distance(lifelike: samples.Sample, fitted: Personalization) -> None:
    cut = heartgen.personalize(lifelike.mask, truncate=10.0)
    assert cut.anatomy.length == pytest.approx(fitted.anatomy.length - 10, abs=COARSE)
    rim, _, _ = sample_faces(cut.mesh, cut.mesh.topology.surfaces["base"], 4)
    assert np.abs(cut.anatomy.base.plane.height(rim)).max() < COARSE


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
def test_a_level_is_the_state_after_that_many_passes(lifelike: samples.Sample) -> None:
    three = heartgen.personalize(lifelike.mask, lod=3, optimize=False)
    two = heartgen.personalize(lifelike.mask, lod=2, optimize=False)
    assert len(three.deformations) == 3
    mesh = enhance(warp(three.template, three.deformations[1]))
    assert np.array_equal(mesh.dofs, two.mesh.dofs)


@pytest.mark.slow
def test_before_an_optimization_registration_stops_early(lifelike: samples.Sample) -> None:
    five = heartgen.personalize(lifelike.mask, lod=5)
    assert len(five.deformations) == OPTIMIZED_PASSES_OF_ONE
    assert five.options.passes(5, whole_lv=False) == OPTIMIZED_PASSES
    assert not any(f.check == "level of detail" for f in five.report.findings)


@pytest.mark.slow
def test_several_levels_at_once_give_the_same_meshes(lifelike: samples.Sample) -> None:
    both = heartgen.personalize_levels(lifelike.mask, (1, 2))
    for lod, result in zip((1, 2), both, strict=True):
        alone = heartgen.personalize(lifelike.mask, lod=lod)
        assert np.array_equal(result.mesh.dofs, alone.mesh.dofs)
        assert result.options == alone.options


@pytest.mark.slow
def test_without_optimization_the_mesh_is_the_enhanced_one(lifelike: samples.Sample) -> None:
    result = heartgen.personalize(lifelike.mask, optimize=False)
    assert result.mesh is result.enhanced
    assert result.report.success


@pytest.mark.slow
def test_optimization_gains_quality_and_keeps_or_gains_accuracy(lifelike: samples.Sample) -> None:
    for lod in (1, 3):
        paper = heartgen.personalize(lifelike.mask, lod=lod, optimize=False).report
        ours = heartgen.personalize(lifelike.mask, lod=lod).report
        assert ours.accuracy.mean < 1.02 * paper.accuracy.mean
        assert ours.quality.mean > paper.quality.mean - 0.005


@pytest.mark.slow
def test_both_ventricles_against_their_true_surfaces() -> None:
    sample = samples.load("biv")
    result = heartgen.personalize(sample.mask, lod=3)
    assert result.report.success
    assert result.report.quality.valid
    assert result.options.elements == (2, 12, 8)
    for name in ("lv_endo", "rv_endo", "epi"):
        points, _, weights = sample_faces(result.mesh, result.mesh.topology.surfaces[name], 6)
        error = np.average(sample.truth.distance(points, name), weights=weights)
        assert error < 0.35, name


@pytest.mark.slow
def test_a_left_ventricle_can_be_asked_for() -> None:
    with pytest.raises(AnatomyError, match="two blood pools"):
        heartgen.personalize(samples.load("biv").mask, ventricles="lv")
    with pytest.raises(InputError, match="choose auto, lv or biv"):
        heartgen.personalize(samples.load("biv").mask, ventricles="both")


@pytest.mark.slow
def test_error_falls_with_the_level_of_detail(lifelike: samples.Sample) -> None:
    errors = [heartgen.personalize(lifelike.mask, lod=k).report.accuracy.mean for k in (1, 3, 5)]
    assert errors[1] <= 1.02 * errors[0]
    assert errors[2] <= 1.02 * errors[1]


def test_enhancement_leaves_endo_and_epicardium_bit_equal(fitted: Personalization) -> None:
    raw, straight = fitted.warped, fitted.enhanced
    assert not np.array_equal(raw.dofs, straight.dofs)
    for name in ("lv_endo", "epi"):
        faces = raw.topology.surfaces[name]
        a, b = (sample_faces(m, faces, 3)[0] for m in (raw, straight))
        assert np.array_equal(a, b)
    assert fitted.report.quality.mean > fitted.report.unenhanced_quality


def test_enhanced_lines_across_the_wall_are_straight(fitted: Personalization) -> None:
    depth = np.linspace(0, 1, 6)
    xi = np.stack([np.full(6, 0.3), np.full(6, 0.6), depth], -1)
    lines = fitted.mesh.evaluate(xi)
    chord = lines[:, -1] - lines[:, 0]
    offset = lines - lines[:, :1]
    aside = np.linalg.norm(np.cross(offset, chord[:, None]), axis=-1)
    assert (aside / np.sum(chord**2, axis=1)[:, None]).max() < 1e-10


@pytest.mark.slow
def test_linear_depth_puts_the_middle_of_the_wall_in_the_middle(lifelike: samples.Sample) -> None:
    result = heartgen.personalize(lifelike.mask, transmural_grading=False)
    at = np.array([[0.4, 0.5, 0.0], [0.4, 0.5, 0.5], [0.4, 0.5, 1.0]])
    endo, middle, epi = np.moveaxis(result.mesh.evaluate(at), 1, 0)
    assert np.abs(middle - (endo + epi) / 2).max() < 1e-10
    assert result.report.quality.mean < heartgen.personalize(lifelike.mask).report.quality.mean


def test_warp_of_an_affine_map_is_exact(fitted: Personalization) -> None:
    affine = np.eye(4)
    affine[:3] = np.random.default_rng(2).standard_normal((3, 4))
    carried = warp(fitted.template, lambda p: p @ affine[:3, :3].T + affine[:3, 3])
    expected = fitted.template.transformed(affine)
    assert np.abs(carried.control - expected.control).max() < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("elements", [(2, 8, 4), (1, 16, 10), (3, 12, 6)])
def test_elements_are_free(lifelike: samples.Sample, elements: tuple[int, int, int]) -> None:
    result = heartgen.personalize(lifelike.mask, elements=elements)
    assert result.mesh.n_elements == np.prod(elements)
    assert result.report.quality.valid
    assert result.report.success


@pytest.mark.slow
def test_the_lagrange_basis_is_the_same_mesh(
    lifelike: samples.Sample, fitted: Personalization
) -> None:
    lagrange = heartgen.personalize(lifelike.mask, basis="lagrange")
    assert lagrange.mesh.topology.basis == "lagrange"
    assert deviation(lagrange.mesh, fitted.mesh) < 1e-9
    assert lagrange.report.quality.valid


@pytest.mark.slow
def test_progress_names_every_step_and_can_cancel(lifelike: samples.Sample) -> None:
    seen: list[tuple[str, float]] = []
    heartgen.personalize(lifelike.mask, progress=lambda s, d: seen.append((s, d)))
    assert list(dict.fromkeys(s for s, _ in seen)) == list(STEPS)
    assert all(0 <= d <= 1 for _, d in seen)

    def stop(step: str, done: float) -> None:
        if step == "registration" and done > 0:
            raise Cancelled("stopped by the test")

    with pytest.raises(Cancelled):
        heartgen.personalize(lifelike.mask, lod=3, progress=stop)


@pytest.mark.slow
def test_slices_that_are_shifted_are_moved_back_and_reported() -> None:
    mask = samples.lifelike_lv((1.5, 1.5, 8.0)).mask
    moves = np.random.default_rng(3).normal(0, 2, (mask.voxels.shape[2], 2)).round().astype(int)
    voxels = np.pad(mask.voxels, ((12, 12), (12, 12), (0, 0)))
    for plane, move in enumerate(moves):
        voxels[:, :, plane] = np.roll(voxels[:, :, plane], move, axis=(0, 1))
    shifted = replace(mask, voxels=voxels)
    off, auto = (heartgen.personalize(shifted, slice_alignment=s).report for s in ("off", "auto"))
    sizes = [np.linalg.norm(s.shift) for s in auto.slices]
    assert max(sizes) > 1.5
    assert not any(any(s.shift) for s in off.slices)
    assert off.accuracy.as_given is None
    assert auto.accuracy.as_given is not None
    assert auto.accuracy.as_given > 2 * auto.accuracy.mean
    assert auto.accuracy.mean < off.accuracy.mean
    assert auto.quality.valid


@pytest.mark.parametrize(
    ("formats", "made"),
    [((), []), (("stl", "cheart"), []), (("pts", "stl"), ["fibers"]), (("pts", "vtu"), "all")],
)
def test_fields_are_made_for_formats_that_hold_them(fitted, tmp_path, monkeypatch, formats, made):
    asked = []
    monkeypatch.setattr(
        "heartgen.result.make_fields", lambda mesh, names, **_: asked.append(list(names)) or ()
    )
    fitted.write(tmp_path, formats)
    assert asked == [list(heartgen.fields.FIELDS) if made == "all" else made]


def test_an_invalid_mesh_whose_fields_cannot_be_made_has_a_report(fitted, tmp_path):
    broken = replace(fitted, mesh=fitted.mesh.with_dofs(np.full_like(fitted.mesh.dofs, np.nan)))
    assert [path.name for path in broken.write(tmp_path, ())] == ["report.json"]
    with pytest.raises(InputError, match="'fiber' is not known"):
        broken.write(tmp_path, (), fields=["fiber"])


def test_write_gives_three_files(fitted: Personalization, tmp_path: Path) -> None:
    paths = fitted.write(tmp_path / "out")
    assert [p.name for p in paths] == ["mesh.exf", "mesh.vtu", "report.json"]
    assert all(p.stat().st_size > 0 for p in paths)


@pytest.mark.parametrize(
    ("choice", "words"),
    [
        ({"lod": 6}, "level of detail 6"),
        ({"elements": (1, 12)}, "elements"),
        ({"elements": (1, 0, 6)}, "elements"),
        ({"truncate": "maybe"}, "truncation"),
        ({"truncate": 500.0}, "truncation"),
        ({"transmural_lines": "bent"}, "transmural lines 'bent'"),
        ({"basis": "linear"}, "basis 'linear' is not known"),
        ({"slice_alignment": "on"}, "slice alignment 'on' is not known"),
    ],
)
def test_bad_choices_get_a_sentence(
    lifelike: samples.Sample, choice: dict[str, object], words: str
) -> None:
    with pytest.raises((InputError, AnatomyError), match=words):
        heartgen.personalize(lifelike.mask, **choice)


@pytest.mark.slow
@pytest.mark.parametrize("name", samples.names())
def test_every_sample_is_fitted(name: str) -> None:
    report = heartgen.personalize(samples.load(name).mask).report
    assert report.quality.valid
    assert report.success


@pytest.mark.slow
def test_real_cases_succeed(shared_data: Path) -> None:
    cases = sorted((shared_data / "lv").glob("*.nii.gz"))[::40]
    tilted = sorted((shared_data / "sampled" / "tilted").glob("*.nii.gz"))[::12]
    assert cases
    assert tilted
    for case in cases + tilted:
        report = heartgen.personalize(heartgen.read_mask(case)).report
        assert report.success, case.name
        assert report.quality.valid, case.name
