"""The steps in a row: what each does, what is reported, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.enhancement import enhance
from heartgen.errors import AnatomyError, Cancelled, InputError
from heartgen.mesh.surface_faces import sample_faces
from heartgen.options import OPTIMIZED_PASSES, OPTIMIZED_PASSES_OF_ONE, STEPS
from heartgen.result import Personalization
from heartgen.warping import warp


@pytest.mark.slow
def test_result_is_valid_good_and_described(
    lifelike: samples.Sample, fitted: Personalization
) -> None:
    report = fitted.report
    assert report.quality.valid
    assert report.success
    assert report.quality.mean > 0.5
    assert report.quality.scaled_mean > 0.9
    assert report.accuracy.mean < 0.25 * lifelike.mask.spacing.max()
    assert report.fold_bound > 0
    assert set(report.seconds) == set(STEPS)
    again = json.loads(report.to_json())
    assert again["accuracy"]["mean"] == report.accuracy.mean
    assert again["success"] is True
    assert report.name in str(report)


@pytest.mark.slow
def test_truncation_by_a_distance(lifelike: samples.Sample, fitted: Personalization) -> None:
    voxel = float(lifelike.mask.spacing.max())
    cut = heartgen.personalize(lifelike.mask, truncate=10.0)
    assert cut.anatomy.length == pytest.approx(fitted.anatomy.length - 10, abs=voxel)
    rim, _, _ = sample_faces(cut.mesh, cut.mesh.topology.surfaces["base"], 4)
    assert np.abs(cut.anatomy.base.plane.height(rim)).max() < voxel


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
def test_without_optimization_the_mesh_is_the_enhanced_one(lifelike: samples.Sample) -> None:
    result = heartgen.personalize(lifelike.mask, optimize=False)
    assert result.mesh is result.enhanced
    assert result.report.success


@pytest.mark.slow
def test_a_left_ventricle_can_be_asked_for() -> None:
    with pytest.raises(AnatomyError, match="two blood pools"):
        heartgen.personalize(samples.load("biv").mask, ventricles="lv")
    with pytest.raises(InputError, match="choose auto, lv or biv"):
        heartgen.personalize(samples.load("biv").mask, ventricles="both")


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


@pytest.mark.slow
@pytest.mark.parametrize("elements", [(2, 8, 4), (1, 16, 10), (3, 12, 6)])
def test_elements_are_free(lifelike: samples.Sample, elements: tuple[int, int, int]) -> None:
    result = heartgen.personalize(lifelike.mask, elements=elements)
    assert result.mesh.n_elements == np.prod(elements)
    assert result.report.quality.valid
    assert result.report.success


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
