"""Results of another heart are replaced on demand alone."""

from __future__ import annotations

import json

import pytest

from heartgen import samples

pytestmark = pytest.mark.slow

QUICK = ("--elements", "1x4x2", "--no-optimize", "--fields", "none")


@pytest.fixture(scope="module")
def other_file(save, tmp_path_factory):
    """Another heart, in a file of the same name."""
    heart = samples.lifelike_lv(2.0, noise=0.1, seed=1).mask
    return save(heart.voxels, tmp_path_factory.mktemp("other") / "heart.nii.gz")


@pytest.fixture
def first(run, mask_file, tmp_path):
    """A folder with a result."""
    outcome = run("fit", mask_file, "-o", tmp_path / "out", *QUICK)
    assert outcome.exit_code == 0, outcome.output
    return tmp_path / "out"


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_another_heart_leaves_the_results_as_they_are(run, other_file, first):
    before = content(first)
    outcome = run("fit", other_file, "-o", first, *QUICK)
    assert outcome.exit_code == 1
    said = " ".join(outcome.stderr.split())
    assert f"{first}: There are results of heart.nii.gz" in said
    assert "--overwrite" in said
    assert "Traceback" not in outcome.output
    assert content(first) == before


def test_another_heart_replaces_them_if_that_is_wanted(run, other_file, first):
    before = json.loads((first / "report.json").read_text())["mask_sha256"]
    outcome = run("fit", other_file, "-o", first, "--overwrite", *QUICK)
    assert outcome.exit_code == 0, outcome.output
    assert json.loads((first / "report.json").read_text())["mask_sha256"] != before


def test_the_same_heart_replaces_them(run, mask_file, first):
    outcome = run("fit", mask_file, "-o", first, "--lod", 2, *QUICK)
    assert outcome.exit_code == 0, outcome.output
    assert json.loads((first / "report.json").read_text())["options"]["lod"] == 2


@pytest.mark.parametrize("report", [None, "{", "[]", '{"name": "x"}'])
def test_a_mesh_of_unknown_origin_is_kept(run, mask_file, tmp_path, report):
    (tmp_path / "mesh.exf").write_text("mine")
    if report is not None:
        (tmp_path / "report.json").write_text(report)
    outcome = run("fit", mask_file, "-o", tmp_path, *QUICK)
    assert outcome.exit_code == 1
    assert "--overwrite" in outcome.stderr
    assert (tmp_path / "mesh.exf").read_text() == "mine"


def test_other_files_of_a_folder_are_in_nobodys_way(run, mask_file, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    outcome = run("fit", mask_file, "-o", tmp_path, *QUICK)
    assert outcome.exit_code == 0, outcome.output


def test_the_demo_asks_as_well(run, first):
    before = content(first)
    outcome = run("demo", "-o", first)
    assert outcome.exit_code == 1
    assert "--overwrite" in outcome.stderr
    assert content(first) == before
