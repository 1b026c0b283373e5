"""How near meshes come to true surfaces, of samples and of real cases."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import sample_faces
from heartgen.optimization import FitSettings, fit_target, misfit, settings_for


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
def test_error_falls_with_the_level_of_detail(lifelike: samples.Sample) -> None:
    errors = [heartgen.personalize(lifelike.mask, lod=k).report.accuracy.mean for k in (1, 3, 5)]
    assert errors[1] <= 1.02 * errors[0]
    assert errors[2] <= 1.02 * errors[1]


@pytest.mark.slow
def test_optimization_gains_quality_and_keeps_or_gains_accuracy(lifelike: samples.Sample) -> None:
    for lod in (1, 3):
        paper = heartgen.personalize(lifelike.mask, lod=lod, optimize=False).report
        ours = heartgen.personalize(lifelike.mask, lod=lod).report
        assert ours.accuracy.mean < 1.02 * paper.accuracy.mean
        assert ours.quality.mean > paper.quality.mean - 0.005


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
