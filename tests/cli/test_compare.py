"""`heartgen compare`."""

from __future__ import annotations

import json

import pytest

import heartgen
from benchmarks.solids import ellipsoid
from heartgen.formats import write_mesh

pytestmark = pytest.mark.slow

STATES = {"rest": (22.0, 60.0, 10.0, 20.0), "half": (18.0, 56.0, 12.0, 18.0)}
SQUEEZED = (15.0, 52.0, 14.0, 17.0)


@pytest.fixture(scope="module")
def beat(tmp_path_factory):
    """Two folders as results have them, and a mesh alone."""
    folder = tmp_path_factory.mktemp("beat")
    for name, sizes in STATES.items():
        write_mesh(ellipsoid(*sizes, (1, 8, 4)), folder / name / "mesh.exf")
    write_mesh(ellipsoid(*SQUEEZED, (1, 8, 4)), folder / "squeezed.vtu")
    return [folder / "rest", folder / "half" / "mesh.exf", folder / "squeezed.vtu"]


@pytest.fixture(scope="module")
def expected(beat):
    paths = [beat[0] / "mesh.exf", *beat[1:]]
    return heartgen.compare([heartgen.read_mesh(path) for path in paths])


def test_folders_and_meshes_are_compared_under_their_names(run, beat, expected):
    outcome = run("compare", *beat)
    assert outcome.exit_code == 0, outcome.output
    share = f"{expected.lv_ejection_fraction:.1%}"
    assert f"ejection fraction {share}, from rest to squeezed" in outcome.stdout
    assert "half" in outcome.stdout
    assert f"{expected.strains[2].circumferential:+.1%}" in outcome.stdout


def test_data_are_those_of_python(run, beat, expected, tmp_path):
    outcome = run("compare", *beat, "-o", tmp_path / "beat.json")
    assert outcome.exit_code == 0, outcome.output
    assert str(tmp_path / "beat.json") in outcome.stdout
    read = json.loads((tmp_path / "beat.json").read_text())
    assert read["names"] == ["rest", "half", "squeezed"]
    own = json.loads(expected.to_json())
    assert {**read, "names": own["names"]} == own


def test_page_has_all_of_it(run, beat, expected, tmp_path):
    pytest.importorskip("trame_vtk")
    outcome = run("compare", *beat, "-o", tmp_path / "beat.html")
    assert outcome.exit_code == 0, outcome.output
    text = (tmp_path / "beat.html").read_text()
    assert f"Ejection fraction {expected.lv_ejection_fraction:.1%}" in text
    for name in ("rest", "half", "squeezed"):
        assert f"<th>{name}</th>" in text
    assert "http" not in text.split("srcdoc")[0]


def test_what_cannot_be_compared_is_a_sentence(run, beat, tmp_path, names):
    wrong = {
        (beat[0],): "give at least two meshes",
        (beat[0], beat[0] / "mesh.exf"): "one mesh was given more than once",
        (beat[0], tmp_path): "There is no mesh.exf or mesh.vtu in this folder",
        (beat[0], tmp_path / "no.exf"): "no.exf",
        (*beat, "-o", tmp_path / "beat.pdf"): "end it in .html, .json",
        (*beat, "--septal-direction", "left"): "is not a direction of three numbers",
    }
    for arguments, sentence in wrong.items():
        outcome = run("compare", *arguments)
        assert outcome.exit_code == 1, outcome.output
        assert sentence in " ".join(outcome.stderr.split()), outcome.stderr
    assert names(tmp_path) == []


def test_elements_that_do_not_correspond_are_told(run, beat, tmp_path):
    other = write_mesh(ellipsoid(*SQUEEZED, (1, 8, 5)), tmp_path / "other.exf").files[0]
    outcome = run("compare", beat[0], other)
    assert outcome.exit_code == 0, outcome.output
    assert "other: no strains against rest" in " ".join(outcome.stdout.split())
    assert "strain at" not in outcome.stdout
    assert "radial" not in outcome.stdout
