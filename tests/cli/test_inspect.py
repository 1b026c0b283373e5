"""`heartgen inspect`: what is in a mask."""

from __future__ import annotations

import numpy as np
import pytest
import SimpleITK

from heartgen import samples


@pytest.mark.slow
def test_inspect_shows_image_anatomy_and_picture(run, names, mask_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = run("inspect", mask_file)
    assert outcome.exit_code == 0, outcome.output
    for text in ("2 × 2 × 2 mm", "length of the cavity", "superior", "truncation", "inspect.png"):
        assert text in outcome.stdout
    assert names(tmp_path) == ["inspect.png"]
    assert (tmp_path / "inspect.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_inspect_tells_findings(run, save, tmp_path):
    heart = samples.lifelike_lv(2.0).mask.voxels.copy()
    heart[:3, :3, :3] = True
    outcome = run("inspect", save(heart, tmp_path / "two.nii.gz"), "-o", tmp_path / "two.svg")
    assert outcome.exit_code == 0, outcome.output
    assert "components" in outcome.stdout
    assert "2 separate pieces" in " ".join(outcome.stdout.split())
    assert "<svg" in (tmp_path / "two.svg").read_text()


@pytest.mark.slow
@pytest.mark.parametrize(
    "labels", ["auto", "ACDC", "lv_myocardium=2,lv_pool=3", "lv_pool=3,lv_myocardium=2"]
)
def test_inspect_reads_label_maps(run, labels, label_map, tmp_path):
    outcome = run("inspect", label_map, "--labels", labels, "-o", tmp_path / "a.png")
    assert outcome.exit_code == 0, outcome.output
    assert "length of the cavity" in outcome.stdout
    assert ("read by the scheme acdc" in " ".join(outcome.stdout.split())) == (labels == "auto")


def test_inspect_builds_the_wall_that_was_asked_for(run, save, label_map, tmp_path):
    image = SimpleITK.ReadImage(str(label_map))
    labels = SimpleITK.GetArrayFromImage(image).transpose(2, 1, 0)
    beside = np.zeros_like(labels)
    beside[:-20] = labels[20:]
    path = save(np.where((beside > 0) & (labels == 0), 1, labels), tmp_path / "both.nii.gz")
    outcome = run("inspect", path, "--labels", "acdc", "--rv-wall", "4.5", "-o", tmp_path / "a.png")
    assert "one of 4.5 mm was built" in " ".join(outcome.stdout.split())


@pytest.mark.slow
def test_inspect_knows_where_the_heart_points(run, save, tmp_path):
    """Turned upside down, the base is below the apex."""
    heart = samples.lifelike_lv(2.0, rotation=np.diag([1.0, -1.0, -1.0])).mask
    outcome = run("inspect", save(heart.voxels, tmp_path / "down.nii.gz"), "-o", tmp_path / "a.png")
    row = next(line for line in outcome.stdout.splitlines() if "from apex to base" in line)
    assert "inferior" in row
    assert "superior" not in row


@pytest.mark.slow
def test_inspect_chooses_a_frame(run, tmp_path):
    heart = samples.lifelike_lv(2.0).mask
    frames = [heart.voxels, np.roll(heart.voxels, 1, axis=0)]
    images = [SimpleITK.GetImageFromArray(f.T.astype(np.uint8)) for f in frames]
    cine = SimpleITK.JoinSeries(images)
    cine.SetSpacing([2.0, 2.0, 2.0, 1.0])
    SimpleITK.WriteImage(cine, str(tmp_path / "cine.mha"))
    outcome = run("inspect", tmp_path / "cine.mha", "-o", tmp_path / "a.png")
    assert outcome.exit_code == 1
    assert "2 frames" in outcome.stderr
    assert "--frame" in outcome.stderr
    outcome = run("inspect", tmp_path / "cine.mha", "--frame", "ED", "-o", tmp_path / "a.png")
    assert outcome.exit_code == 0, outcome.output
    assert "Frame 1 of 2 was read" in " ".join(outcome.stdout.split())
