"""`heartgen fit`: what it writes, what it shows, and that options arrive."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import pyvista as pv

from heartgen import reporting, samples
from heartgen.options import STEPS

pytestmark = pytest.mark.slow


def test_fit_writes_mesh_and_report(names, files, fitted):
    outcome, out = fitted
    assert outcome.exit_code == 0, outcome.output
    assert names(out) == files
    assert "EX Version: 3" in (out / "mesh.exf").read_text()
    assert ET.parse(out / "mesh.vtu").getroot().get("type") == "UnstructuredGrid"
    report = json.loads((out / "report.json").read_text())
    assert report["success"]
    assert report["quality"]["valid"]
    assert report["options"]["elements"] == [1, 12, 6]


def test_fit_shows_what_it_measured(files, fitted):
    outcome, out = fitted
    report = json.loads((out / "report.json").read_text())
    for text in (
        f"{report['accuracy']['mean']:.3f} mm",
        f"{report['accuracy']['by_surface']['epi']:.3f} mm",
        f"{report['quality']['mean']:.3f}",
        f"{report['quality']['scaled_mean']:.3f}",
        f"{report['fairness']['longitudinal_median']:.1f}°",
        "proven",
        "heart.nii.gz: success",
        *STEPS,
    ):
        assert text in outcome.stdout
    for path in files:
        assert str(out / path) in outcome.stdout.split()


def test_fit_shows_the_steps_apart_from_the_results(fitted):
    outcome, _ = fitted
    for step in STEPS:
        assert step in outcome.stderr
    assert outcome.stderr.count("100%") == len(STEPS)


def test_options_arrive(run, mask_file, tmp_path):
    outcome = run(
        "fit", mask_file, "-o", tmp_path, "--lod", 2, "--elements", "2x10x5",
        "--truncate", "7.5", "--no-grading", "--basis", "lagrange",
        "--no-enhance", "--no-optimize", "--quality", 2.0, "--ventricles", "lv",
        "--septal-direction", "-1,0,0.5", "--base", "plane", "--apex", "hole", "--hole-radius", 6.0,
        "--slice-alignment", "off",
        "--insertion", "squared",
    )  # fmt: skip
    assert outcome.exit_code == 0, outcome.output
    options = json.loads((tmp_path / "report.json").read_text())["options"]
    assert options == {
        "lod": 2,
        "elements": [2, 10, 5],
        "truncate": 7.5,
        "enhance": False,
        "optimize": False,
        "quality": 2.0,
        "min_jacobian_ratio": 0.0,
        "ventricles": "lv",
        "transmural_grading": False,
        "basis": "lagrange",
        "septal_direction": [-1.0, 0.0, 0.5],
        "base": "plane",
        "apex": "hole",
        "hole_radius": 6.0,
        "slice_alignment": "off",
        "insertion": "squared",
        "transmural_lines": "straight",
    }


def test_fields_are_written_as_asked(fitted, run, mask_file, tmp_path):
    _, out = fitted
    everything = pv.read(out / "mesh.vtu")
    assert {"transmural", "longitudinal", "circumferential", "fiber"} <= set(everything.point_data)
    assert "aha segment" in everything.cell_data
    outcome = run(
        "fit", mask_file, "-o", tmp_path, "--fields", "fibers", "--fiber-angles", "helix=0/0"
    )  # fmt: skip
    assert outcome.exit_code == 0, outcome.output
    grid = pv.read(tmp_path / "mesh.vtu")
    assert set(grid.point_data) == {"fiber", "sheet", "sheet normal"}
    rising, level = (np.mean(np.abs(g["fiber"][:, 2])) for g in (everything, grid))
    assert level < rising / 2  # around, not up the long axis
    assert np.linalg.norm(grid["fiber"], axis=1) == pytest.approx(1)


def test_indices_are_shown_and_reported(fitted):
    outcome, out = fitted
    indices = json.loads((out / "report.json").read_text())["indices"]
    assert f"{indices['lv_cavity_volume']:.1f} ml" in outcome.stdout
    assert f"apex 17 {indices['wall_thickness']['17']:.1f}" in " ".join(outcome.stdout.split())
    assert "the patient's right and front, assumed" in outcome.stdout


def test_label_selects_the_myocardium(run, save, mask_file, tmp_path, fitted):
    heart = samples.lifelike_lv(2.0).mask.voxels
    halves = np.where(np.indices(heart.shape)[0] < heart.shape[0] // 2, 2, 3) * heart
    halves[1:3, 1:3, 1:3] = 7
    path = save(halves, tmp_path / "labels.nii.gz")
    assert run("fit", path, "-o", tmp_path / "none").exit_code == 1
    outcome = run("fit", path, "-o", tmp_path / "both", "--label", 2, "--label", 3)
    assert outcome.exit_code == 0, outcome.output
    whole, parts = (
        json.loads((out / "report.json").read_text()) for out in (fitted[1], tmp_path / "both")
    )
    assert parts["measurements"] == pytest.approx(whole["measurements"])
    assert parts["accuracy"]["mean"] == pytest.approx(whole["accuracy"]["mean"])


def test_label_map_is_fitted_as_the_mask_it_holds(run, mask_file, label_map, tmp_path, fitted):
    outcome = run("fit", label_map, "-o", tmp_path, "--labels", "acdc")
    assert outcome.exit_code == 0, outcome.output
    whole, labeled = (
        json.loads((out / "report.json").read_text()) for out in (fitted[1], tmp_path)
    )
    assert labeled["measurements"] == pytest.approx(whole["measurements"])
    assert labeled["accuracy"]["mean"] == pytest.approx(whole["accuracy"]["mean"])


def test_valid_mesh_without_success_is_written_and_flagged(
    run, names, files, mask_file, tmp_path, monkeypatch
):
    measure = reporting.assess_quality
    monkeypatch.setattr(reporting, "assess_quality", lambda mesh: replace(measure(mesh), mean=0.2))
    outcome = run("fit", mask_file, "-o", tmp_path)
    assert outcome.exit_code == 0
    assert "quality below the threshold (0.200, not above 0.33)" in outcome.stdout
    assert names(tmp_path) == files


def test_mesh_that_is_not_valid_is_not_written(run, mask_file, tmp_path, monkeypatch):
    measure = reporting.assess_quality
    monkeypatch.setattr(
        reporting,
        "assess_quality",
        lambda mesh: replace(measure(mesh), valid=False, invalid_elements=3),
    )
    outcome = run("fit", mask_file, "-o", tmp_path / "out")
    assert outcome.exit_code == 1
    assert "not valid (3 elements fold), so nothing was written" in outcome.stderr
    assert not (tmp_path / "out").exists()
