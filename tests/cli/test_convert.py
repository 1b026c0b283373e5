"""`heartgen convert`."""

from __future__ import annotations

import pytest

import heartgen
from heartgen.mesh.bases import deviation


@pytest.mark.slow
def test_a_result_is_converted_there_and_back(run, fitted, tmp_path):
    source = fitted[1] / "mesh.exf"
    for target in ("mesh.exelem", "mesh.vtk", "mesh.msh", "mesh.mesh", "mesh.vtu"):
        outcome = run("convert", source, tmp_path / target)
        assert outcome.exit_code == 0, outcome.output
        assert str(tmp_path / target) in outcome.stdout.splitlines()
    outcome = run("convert", tmp_path / "mesh.exelem", tmp_path / "again.exf")
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "again.exf").read_bytes() == source.read_bytes()


def test_lower_orders_say_their_error(run, fitted, tmp_path):
    source, target = fitted[1] / "mesh.vtu", tmp_path / "mesh.vtu"
    outcome = run("convert", source, target, "--basis", "lagrange", "--order", 1)
    assert outcome.exit_code == 0, outcome.output
    moved = deviation(heartgen.read_mesh(source), heartgen.read_mesh(target))
    assert f"elements of order 1 lie up to {moved:.3g} mm from the mesh" in outcome.stderr


@pytest.mark.slow
def test_fieldml_says_what_it_does_not_hold(run, fitted, tmp_path):
    pytest.importorskip("cmlibs.zinc.context")
    outcome = run("convert", fitted[1] / "mesh.exf", tmp_path / "mesh.fieldml")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.stdout.split() == [str(tmp_path / "mesh.fieldml")]
    assert "mesh.fieldml does not hold the" in outcome.stderr


def test_what_cannot_be_done_is_a_sentence(run, fitted, tmp_path, names):
    source = fitted[1] / "mesh.exf"
    wrong = {
        ("absent.exf", "out.vtu"): "absent.exf: The file cannot be read",
        (source, "out.docx"): "cannot be written in this format",
        ("mesh.stl", "out.vtu"): "cannot be read in this format",
        (source, "out.vtu", "--format", "exf"): "end the name in .exf",
        (source, "out.vtu", "--basis", "linear"): "choose hermite or lagrange",
        (source, "out.vtu", "--order", "1"): "add --basis lagrange",
    }
    for (first, second, *options), sentence in wrong.items():
        outcome = run("convert", tmp_path / first, tmp_path / second, *options)
        assert outcome.exit_code == 1
        assert sentence in " ".join(outcome.stderr.split())
    assert names(tmp_path) == []
