"""Bad masks and wrong requests: a sentence, and nothing written."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest


def bad_masks():
    place = np.indices((32, 32, 32)) - 16.0
    radius = np.linalg.norm(place, axis=0)
    return {
        "empty": (radius < 0, "empty"),
        "full": (radius > -1, "no background"),
        "flat": ((radius < 12) & (np.abs(place[2]) < 1), "flat"),
        "solid": (radius < 12, "no cavity"),
        "closed": ((radius < 14) & (radius > 9), "no opening"),
        "labels": (np.where(radius < 12, 1, 0) + np.where(radius < 9, 1, 0), "label"),
    }


@pytest.mark.parametrize("name", bad_masks())
@pytest.mark.parametrize("command", ["fit", "inspect"])
def test_bad_mask_is_told_in_a_sentence(run, save, names, name, command, tmp_path):
    voxels, reason = bad_masks()[name]
    path = save(voxels, tmp_path / "bad.nii.gz")
    outcome = run(command, path, "-o", tmp_path / ("out.png" if command == "inspect" else "out"))
    assert outcome.exit_code == 1
    sentence = outcome.stderr.strip().splitlines()[-1]
    assert reason in sentence
    assert ":" in sentence
    assert "Traceback" not in outcome.output
    assert names(tmp_path) == ["bad.nii.gz"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["fit", "absent.nii", "-o", "out"], "no such file"),
        (["fit", "text.nii", "-o", "out"], "text.nii"),
        (["fit", "text.nii", "-o", "text.nii"], "a file, not a folder"),
        (["fit", "text.nii", "-o", "text.nii/deeper"], "a file, not a folder"),
        (["fit", "text.nii", "-o", "out", "--lod", "6"], "level of detail 6 does not exist"),
        (["fit", "text.nii", "-o", "out", "--elements", "12x6"], "for example 1x12x6"),
        (["fit", "text.nii", "-o", "out", "--elements", "0x12x6"], "not three positive numbers"),
        (["fit", "text.nii", "-o", "out", "--truncate", "some"], "a distance in mm, auto or off"),
        (
            ["fit", "text.nii", "-o", "out", "--transmural-lines", "bent"],
            "choose straight or curved",
        ),
        (["fit", "text.nii", "-o", "out", "--basis", "linear"], "choose hermite or lagrange"),
        (["fit", "text.nii", "-o", "out", "--septal-direction", "left"], "is not a direction"),
        (["fit", "text.nii", "-o", "out", "--septal-direction", "0,0,0"], "is not a direction"),
        (["fit", "text.nii", "-o", "out", "--septal-direction", "nan,0,1"], "is not a direction"),
        (["fit", "text.nii", "-o", "out", "--fields", "fibrils"], "choose among coordinates, aha"),
        (["fit", "text.nii", "-o", "out", "--fiber-angles", "helix=60"], "cannot be read"),
        (["fit", "text.nii", "-o", "out", "--fiber-angles", "spiral=1/2"], "give helix, right"),
        (["fit", "text.nii", "-o", "out", "--fiber-angles", "helix=999/0"], "not two angles"),
        (["fit", "absent.nii", "-o", "out", "--labels", "acdc"], "no such file"),
        (["fit", "text.nii", "-o", "out", "--labels", "lv_myocardium="], "write them like"),
        (["fit", "text.nii", "-o", "out", "--labels", "acdc", "--label", "2"], "both given"),
        (["fit", "text.nii", "-o", "out", "--rv-wall", "3"], "--rv-wall needs a label map"),
        (["inspect", "text.nii", "--labels", "acdc", "--rv-wall", "-1"], "-1 mm is not possible"),
        (["inspect", "absent.nii"], "no such file"),
        (["inspect", "text.nii", "--truncate", "some"], "a distance in mm, auto or off"),
        (["inspect", "text.nii", "--base", "flat"], "choose rim or plane"),
        (["inspect", "text.nii", "-o", "picture.xyz"], "end the name in"),
        (["demo", "-o", "out", "--sample", "nobody"], "choose one of"),
    ],
)
def test_wrong_request_is_told_in_a_sentence(run, names, arguments, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.nii").write_text("this is no image\n" * 50)
    outcome = run(*arguments)
    assert outcome.exit_code == 1
    assert reason in outcome.stderr
    assert "Traceback" not in outcome.output
    assert names(tmp_path) == ["text.nii"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="this user may write anywhere")
def test_folder_without_permission_is_refused_before_the_work(run, mask_file, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    outcome = run("fit", mask_file, "-o", tmp_path / "locked" / "out")
    assert outcome.exit_code == 1
    assert "You may not write there" in outcome.stderr
    assert "registration" not in outcome.stderr


@pytest.mark.slow
def test_missing_extra_is_told_with_its_remedy(names, tmp_path):
    code = "import sys; sys.modules['matplotlib'] = None; from heartgen.cli import main; main()"
    answer = subprocess.run(
        [sys.executable, "-c", code, "inspect", "x"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 1
    assert "need the package matplotlib" in answer.stderr
    assert "pip install 'heartgen[plot]'" in answer.stderr
    assert names(tmp_path) == []


def test_label_map_without_a_word_about_its_labels_is_pointed_to_the_option(
    run, label_map, tmp_path
):
    outcome = run("inspect", label_map, "-o", tmp_path / "a.png")
    assert outcome.exit_code == 1
    assert "--labels" in outcome.stderr


def test_a_view_of_a_heart_that_is_no_stack_is_refused(run, mask_file, tmp_path):
    outcome = run("fit", mask_file, "-o", tmp_path / "out", "--view", mask_file)
    assert outcome.exit_code == 1
    assert "no stack of slices" in outcome.stderr.replace("\n", " ")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "words",
    [
        ("inspect", "{long}.nii.gz"),
        ("fit", "{mask}", "-o", "{long}"),
        ("fit", "{mask}", "-o", "{long}/deep"),
        ("demo", "-o", "{long}"),
        ("batch", "{long}", "-o", "out"),
        ("batch", "{mask}", "-o", "{long}"),
        ("compare", "{long}", "{long}"),
        ("report", "{long}"),
    ],
)
def test_names_too_long_for_the_system(run, names, mask_file, words, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = run(*(word.format(long="n" * 300, mask=mask_file) for word in words))
    assert outcome.exit_code == 1
    assert "name too long" in outcome.stderr
    assert "failed" not in outcome.stderr
    assert names(tmp_path) == []


def test_what_was_seen_before_is_told_first(run, save, tmp_path):
    radius = np.linalg.norm(np.indices((32, 32, 32)) - 16.0, axis=0)
    solid = radius < 12
    solid[1, 1, 1] = True
    outcome = run("fit", save(solid, tmp_path / "two.nii.gz"), "-o", tmp_path / "out")
    first, last = outcome.stderr.strip().splitlines()[-2:]
    assert "Seen before: The mask is in 2 separate pieces" in first
    assert "no cavity" in last
