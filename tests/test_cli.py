from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
import SimpleITK
from numpy.testing import assert_allclose, assert_array_equal
from scipy.ndimage import binary_fill_holes as fill
from typer.testing import CliRunner

import heartgen
from heartgen import pipeline, samples
from heartgen.cli.commands import app
from heartgen.errors import Cancelled

FILES = ["mesh.exf", "mesh.vtu", "report.json"]
PATIENCE = 120
"""Seconds after which a process that should have ended is given up."""


def run(*arguments):
    """Outcome of a command."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def save(voxels, path, spacing=2.0):
    """Write an image with any values."""
    image = SimpleITK.GetImageFromArray(np.asarray(voxels, dtype=np.uint8).transpose(2, 1, 0))
    image.SetSpacing([spacing] * 3)
    SimpleITK.WriteImage(image, str(path))
    return path


def names(folder):
    """Names of all files and folders in a folder, hidden ones as well."""
    return sorted(path.name for path in folder.iterdir())


@pytest.fixture(scope="module")
def mask_file(tmp_path_factory):
    heart = samples.lifelike_lv(2.0).mask
    return save(heart.voxels, tmp_path_factory.mktemp("mask") / "heart.nii.gz")


@pytest.fixture(scope="module")
def label_map(tmp_path_factory):
    """The same heart as in the challenge ACDC, with a blood pool that fills its cavity."""
    wall = samples.lifelike_lv(2.0).mask.voxels
    filled = np.stack([fill(plane) for plane in np.moveaxis(wall, 2, 0)], axis=2)
    labels = 2 * wall + 3 * (filled & ~wall)
    return save(labels, tmp_path_factory.mktemp("labels") / "labels.nii.gz")


@pytest.fixture(scope="module")
def fitted(mask_file, tmp_path_factory):
    out = tmp_path_factory.mktemp("fit") / "new" / "folder"
    return run("fit", mask_file, "-o", out), out


# --- fit -----------------------------------------------------------------------------------------


def test_fit_writes_mesh_and_report(fitted):
    outcome, out = fitted
    assert outcome.exit_code == 0, outcome.output
    assert names(out) == FILES
    assert "EX Version: 3" in (out / "mesh.exf").read_text()
    assert ET.parse(out / "mesh.vtu").getroot().get("type") == "UnstructuredGrid"
    report = json.loads((out / "report.json").read_text())
    assert report["success"]
    assert report["quality"]["valid"]
    assert report["options"]["elements"] == [1, 12, 6]


def test_fit_shows_what_it_measured(fitted):
    outcome, out = fitted
    report = json.loads((out / "report.json").read_text())
    for text in (
        f"{report['accuracy']['mean']:.3f} mm",
        f"{report['accuracy']['by_surface']['epi']:.3f} mm",
        f"{report['quality']['mean']:.3f}",
        f"{report['quality']['scaled_mean']:.3f}",
        "proven",
        "heart.nii.gz: success",
        *pipeline.STEPS,
    ):
        assert text in outcome.stdout
    for path in FILES:
        assert str(out / path) in outcome.stdout.split()


def test_fit_shows_the_steps_apart_from_the_results(fitted):
    outcome, _ = fitted
    for step in pipeline.STEPS:
        assert step in outcome.stderr
    assert outcome.stderr.count("100%") == len(pipeline.STEPS)


def test_options_arrive(mask_file, tmp_path):
    outcome = run(
        "fit", mask_file, "-o", tmp_path, "--lod", 2, "--elements", "2x10x5",
        "--truncate", "7.5", "--depth", "linear", "--basis", "lagrange",
        "--no-enhance", "--no-refine", "--quality", 2.0, "--ventricles", "lv",
    )  # fmt: skip
    assert outcome.exit_code == 0, outcome.output
    options = json.loads((tmp_path / "report.json").read_text())["options"]
    assert options == {
        "lod": 2,
        "elements": [2, 10, 5],
        "truncate": 7.5,
        "enhance": False,
        "refine": False,
        "quality": 2.0,
        "ventricles": "lv",
        "depth": "linear",
        "basis": "lagrange",
    }


def test_label_selects_the_myocardium(mask_file, tmp_path, fitted):
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


def test_label_map_is_fitted_as_the_mask_it_holds(mask_file, label_map, tmp_path, fitted):
    outcome = run("fit", label_map, "-o", tmp_path, "--labels", "acdc")
    assert outcome.exit_code == 0, outcome.output
    whole, labelled = (
        json.loads((out / "report.json").read_text()) for out in (fitted[1], tmp_path)
    )
    assert labelled["measurements"] == pytest.approx(whole["measurements"])
    assert labelled["accuracy"]["mean"] == pytest.approx(whole["accuracy"]["mean"])


def test_valid_mesh_without_success_is_written_and_flagged(mask_file, tmp_path, monkeypatch):
    measure = pipeline.assess_quality
    monkeypatch.setattr(pipeline, "assess_quality", lambda mesh: replace(measure(mesh), mean=0.2))
    outcome = run("fit", mask_file, "-o", tmp_path)
    assert outcome.exit_code == 0
    assert "not a success: the mean quality, 0.200, is not above 0.33" in outcome.stdout
    assert names(tmp_path) == FILES


def test_mesh_that_is_not_valid_is_not_written(mask_file, tmp_path, monkeypatch):
    measure = pipeline.assess_quality
    monkeypatch.setattr(
        pipeline,
        "assess_quality",
        lambda mesh: replace(measure(mesh), valid=False, invalid_elements=3),
    )
    outcome = run("fit", mask_file, "-o", tmp_path / "out")
    assert outcome.exit_code == 1
    assert "not valid in 3 of 72 elements, so nothing was written" in outcome.stderr
    assert not (tmp_path / "out").exists()


# --- what goes wrong -----------------------------------------------------------------------------


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
def test_bad_mask_is_told_in_a_sentence(name, command, tmp_path):
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
        (["fit", "text.nii", "-o", "out", "--elements", "12x6"], "for example 1x12x6"),
        (["fit", "text.nii", "-o", "out", "--elements", "0x12x6"], "not three positive numbers"),
        (["fit", "text.nii", "-o", "out", "--truncate", "some"], "a distance in mm, auto or off"),
        (["fit", "text.nii", "-o", "out", "--depth", "deep"], "choose graded or linear"),
        (["fit", "text.nii", "-o", "out", "--basis", "linear"], "choose hermite or lagrange"),
        (["fit", "absent.nii", "-o", "out", "--labels", "acdc"], "no such file"),
        (["fit", "text.nii", "-o", "out", "--labels", "lv_myocardium="], "write them like"),
        (["fit", "text.nii", "-o", "out", "--labels", "acdc", "--label", "2"], "both given"),
        (["fit", "text.nii", "-o", "out", "--rv-wall", "3"], "--rv-wall needs a label map"),
        (["inspect", "text.nii", "--labels", "acdc", "--rv-wall", "-1"], "-1 mm is not possible"),
        (["inspect", "absent.nii"], "no such file"),
        (["inspect", "text.nii", "--truncate", "some"], "a distance in mm, auto or off"),
        (["inspect", "text.nii", "-o", "picture.xyz"], "end the name in"),
        (["demo", "-o", "out", "--sample", "nobody"], "choose one of"),
    ],
)
def test_wrong_request_is_told_in_a_sentence(arguments, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "text.nii").write_text("this is no image\n" * 50)
    outcome = run(*arguments)
    assert outcome.exit_code == 1
    assert reason in outcome.stderr
    assert "Traceback" not in outcome.output
    assert names(tmp_path) == ["text.nii"]


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="this user may write anywhere")
def test_folder_without_permission_is_refused_before_the_work(mask_file, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    outcome = run("fit", mask_file, "-o", tmp_path / "locked" / "out")
    assert outcome.exit_code == 1
    assert "You may not write there" in outcome.stderr
    assert "registration" not in outcome.stderr


def test_level_of_detail_beyond_five_is_a_usage_error(mask_file, tmp_path):
    outcome = run("fit", mask_file, "-o", tmp_path, "--lod", 6)
    assert outcome.exit_code == 2
    assert "--lod" in outcome.stderr


@pytest.mark.parametrize("debug", [False, True])
def test_error_in_heartgen_itself_asks_for_a_report(mask_file, tmp_path, monkeypatch, debug):
    def fail(*_, **__):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(pipeline, "register", fail)
    outcome = run("fit", mask_file, "-o", tmp_path / "out", *(["--debug"] * debug))
    assert outcome.exit_code == 70
    assert "ZeroDivisionError: division by zero" in outcome.stderr
    assert "report" in outcome.stderr
    assert ("Traceback" in outcome.stderr) == debug
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("failure", "code"), [(KeyboardInterrupt, 130), (Cancelled, 130), (OSError, 1), (KeyError, 70)]
)
def test_failure_between_two_files_leaves_the_folder_as_it_was(
    fitted, mask_file, tmp_path, monkeypatch, failure, code
):
    before = {name: (fitted[1] / name).read_bytes() for name in FILES}
    for name, content in before.items():
        (tmp_path / name).write_bytes(content[::-1])

    def fail(*_):
        raise failure

    monkeypatch.setattr(pipeline, "write_text", fail)  # the report comes after the meshes
    outcome = run("fit", mask_file, "-o", tmp_path)
    assert outcome.exit_code == code
    assert "Traceback" not in outcome.output
    assert names(tmp_path) == FILES
    assert all((tmp_path / name).read_bytes() == before[name][::-1] for name in FILES)


@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_interrupt_during_registration_writes_nothing(mask_file, tmp_path):
    """A process that registers again and again, so that the signal cannot come too late."""
    code = (
        "import sys\n"
        "from heartgen import pipeline\n"
        "from heartgen.cli import main\n"
        "register = pipeline.register\n"
        "def again(*arguments):\n"
        "    while True:\n"
        "        register(*arguments)\n"
        "        print('registering', flush=True)\n"
        "pipeline.register = again\n"
        "main()\n"
    )
    out = tmp_path / "out"
    with subprocess.Popen(
        [sys.executable, "-c", code, "fit", str(mask_file), "-o", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == "registering\n"
        process.send_signal(signal.SIGINT)
        _, answer = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "cancelled, nothing written" in answer
    assert "Traceback" not in answer
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("missing", "arguments"),
    [("pyvista", ["demo"]), ("trame_vtk", ["demo"]), ("matplotlib", ["inspect", "x"])],
)
def test_missing_extra_is_told_with_its_remedy(missing, arguments, tmp_path):
    code = f"import sys; sys.modules[{missing!r}] = None; from heartgen.cli import main; main()"
    answer = subprocess.run(
        [sys.executable, "-c", code, *arguments],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 1
    assert f"need the package {missing}" in answer.stderr
    assert "pip install 'heartgen[plot]'" in answer.stderr
    assert names(tmp_path) == []


# --- inspect, demo, help -------------------------------------------------------------------------


def test_inspect_shows_image_anatomy_and_picture(mask_file, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = run("inspect", mask_file)
    assert outcome.exit_code == 0, outcome.output
    for text in ("2 × 2 × 2 mm", "length of the cavity", "superior", "truncation", "inspect.png"):
        assert text in outcome.stdout
    assert names(tmp_path) == ["inspect.png"]
    assert (tmp_path / "inspect.png").read_bytes().startswith(b"\x89PNG")


def test_inspect_tells_findings(tmp_path):
    heart = samples.lifelike_lv(2.0).mask.voxels.copy()
    heart[:3, :3, :3] = True
    outcome = run("inspect", save(heart, tmp_path / "two.nii.gz"), "-o", tmp_path / "two.svg")
    assert outcome.exit_code == 0, outcome.output
    assert "components" in outcome.stdout
    assert "2 separate pieces" in " ".join(outcome.stdout.split())
    assert "<svg" in (tmp_path / "two.svg").read_text()


@pytest.mark.parametrize(
    "labels", ["auto", "ACDC", "lv_myocardium=2,lv_pool=3", "lv_pool=3,lv_myocardium=2"]
)
def test_inspect_reads_label_maps(labels, label_map, tmp_path):
    outcome = run("inspect", label_map, "--labels", labels, "-o", tmp_path / "a.png")
    assert outcome.exit_code == 0, outcome.output
    assert "length of the cavity" in outcome.stdout
    assert ("read by the scheme acdc" in " ".join(outcome.stdout.split())) == (labels == "auto")


def test_inspect_builds_the_wall_that_was_asked_for(label_map, tmp_path):
    image = SimpleITK.ReadImage(str(label_map))
    labels = SimpleITK.GetArrayFromImage(image).transpose(2, 1, 0)
    beside = np.zeros_like(labels)
    beside[:-20] = labels[20:]
    path = save(np.where((beside > 0) & (labels == 0), 1, labels), tmp_path / "both.nii.gz")
    outcome = run("inspect", path, "--labels", "acdc", "--rv-wall", "4.5", "-o", tmp_path / "a.png")
    assert "one of 4.5 mm was built" in " ".join(outcome.stdout.split())


def test_label_map_without_a_word_about_its_labels_is_pointed_to_the_option(label_map, tmp_path):
    outcome = run("inspect", label_map, "-o", tmp_path / "a.png")
    assert outcome.exit_code == 1
    assert "--labels" in outcome.stderr


def test_inspect_knows_where_the_heart_points(tmp_path):
    """Turned upside down, the base is below the apex."""
    heart = samples.lifelike_lv(2.0, rotation=np.diag([1.0, -1.0, -1.0])).mask
    outcome = run("inspect", save(heart.voxels, tmp_path / "down.nii.gz"), "-o", tmp_path / "a.png")
    row = next(line for line in outcome.stdout.splitlines() if "from apex to base" in line)
    assert "inferior" in row
    assert "superior" not in row


def test_demo_makes_everything(tmp_path):
    nibabel = pytest.importorskip("nibabel")
    pytest.importorskip("trame_vtk")
    out = tmp_path / "demo"
    outcome = run("demo", "-o", out, "--sample", "tilted")
    assert outcome.exit_code == 0, outcome.output
    assert names(out) == ["index.html", "mask.nii.gz", *FILES]
    assert str(out / "index.html") in outcome.stdout
    image, mask = nibabel.load(out / "mask.nii.gz"), samples.load("tilted").mask
    assert_array_equal(np.asarray(image.dataobj) > 0, mask.voxels)
    assert_allclose(np.diag([-1, -1, 1, 1]) @ image.affine, mask.affine, atol=1e-4)
    again = heartgen.read_mask(out / "mask.nii.gz")
    assert_array_equal(again.voxels, mask.voxels)
    assert_allclose(again.affine, mask.affine, atol=1e-4)


def test_version_is_that_of_the_package():
    outcome = run("--version")
    assert outcome.exit_code == 0
    assert outcome.stdout == f"heartgen {heartgen.__version__}\n"


def test_help_names_the_commands_and_loads_nothing_heavy():
    code = (
        "import atexit, json, sys\n"
        "from heartgen.cli import main\n"
        "atexit.register(lambda: print(json.dumps(sorted(sys.modules)), file=sys.stderr))\n"
        "main()\n"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=True
    )
    for command in ("fit", "inspect", "demo"):
        assert command in answer.stdout
    loaded = {name.partition(".")[0] for name in json.loads(answer.stderr)}
    assert not loaded & {"SimpleITK", "matplotlib", "numba", "numpy", "pyvista", "scipy", "skimage"}
