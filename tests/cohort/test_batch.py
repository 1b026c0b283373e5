"""Batches on processes of their own: what they leave, and what of it stays."""

from __future__ import annotations

import json
import shutil

import pandas as pd
import pytest
from filelock import FileLock
from typer.testing import CliRunner

import heartgen
from heartgen.cli.cohort import app
from heartgen.cohort import Workers, batch, read_results
from heartgen.errors import HeartgenError, InputError

pytestmark = pytest.mark.slow

FILES = ["mesh.exf", "mesh.vtu", "report.json", "rows.json"]


@pytest.fixture(scope="module")
def two(hearts, tmp_path_factory):
    """Folder of a batch on two processes, its table, and what it told on the way."""
    out, told = tmp_path_factory.mktemp("two"), []
    table = batch(hearts, out, workers=Workers(2), progress=lambda *news: told.append(news))
    return out, table, told


def names(folder):
    return sorted(file.name for file in folder.iterdir())


def status_of(table, case):
    return table.set_index("case")["status"][case]


def test_every_case_has_a_row_and_a_folder(two):
    out, table, _ = two
    assert list(table["case"]) == ["a", "b", "odd/block", "odd/slice", "odd/text"]
    assert list(table["success"]) == [True, True, False, False, False]
    assert names(out / "cases" / "a") == names(out / "cases" / "b") == FILES
    assert names(out) == [".lock", "cases", "results.csv", "results.parquet"]
    report = json.loads((out / "cases" / "a" / "report.json").read_text())
    row = table.iloc[0]
    assert row["error_mean"] == report["accuracy"]["mean"]
    assert row["q_mean"] == report["quality"]["mean"]
    assert row["fair_normal_mean"] == report["fairness"]["normal_mean"]
    before = report["unoptimized_fairness"]["longitudinal_median"]
    assert row["fair_unoptimized_longitudinal_median"] == before
    assert row["size_wall_volume"] == report["measurements"]["wall_volume"]
    assert row["version_heartgen"] == heartgen.__version__
    assert row["elements"] == "1x12x6"
    assert row["seconds"] == pytest.approx(sum(report["seconds"].values()))
    assert len(row["sha256"]) == 64


def test_what_should_not_be_meshed_ends_as_failed_with_its_reason(two):
    out, table, _ = two
    for case, reason in (
        ("odd/block", "failed: no cavity"),
        ("odd/slice", "failed: "),
        ("odd/text", "failed: text.nii.gz: The file is not gzip-compressed"),
    ):
        assert status_of(table, case).startswith(reason)
        assert "Traceback" not in status_of(table, case)
        assert "heartgen itself failed" not in status_of(table, case)
        assert names(out / "cases" / case) == ["rows.json"]


def test_both_tables_hold_the_same(two):
    out, table, _ = two
    pd.testing.assert_frame_equal(read_results(out), table)
    written = pd.read_csv(out / "results.csv")
    assert list(written.columns) == list(table.columns)
    assert list(written["status"]) == list(table["status"])
    with pytest.raises(InputError, match="give a folder that heartgen batch made"):
        read_results(out / "cases")


def test_progress_counts_to_the_end(two):
    _, _, told = two
    assert [done for done, _, _ in told] == [0, 1, 2, 3, 4, 5]
    assert {total for _, total, _ in told} == {5}


def test_one_process_gives_the_same_meshes_as_two_and_as_none(two, hearts, tmp_path):
    out, _, _ = two
    batch(hearts, tmp_path, workers=Workers(1))
    for case in ("a", "b"):
        for name in ("mesh.exf", "mesh.vtu"):
            one = (tmp_path / "cases" / case / name).read_bytes()
            assert one == (out / "cases" / case / name).read_bytes()
    here = heartgen.personalize(heartgen.read_mask(hearts / "b.nrrd")).report
    there = json.loads((out / "cases" / "b" / "report.json").read_text())
    assert here.accuracy.mean == pytest.approx(there["accuracy"]["mean"], abs=1e-6)
    assert here.quality.mean == pytest.approx(there["quality"]["mean"], abs=1e-6)


def test_what_is_done_is_not_done_again(two, hearts, tmp_path, monkeypatch):
    out = tmp_path / "out"
    shutil.copytree(two[0], out)
    shutil.rmtree(out / "cases" / "odd" / "block")
    (out / "results.parquet").unlink()
    before = {p: p.stat().st_mtime_ns for p in (out / "cases").rglob("*.json")}
    table = batch(hearts, out, workers=Workers(1))
    assert status_of(table, "odd/block").startswith("failed: no cavity")
    assert {p: p.stat().st_mtime_ns for p in before} == before
    pd.testing.assert_frame_equal(table, two[1])

    def refuse(*arguments):
        raise AssertionError("there is nothing to do")

    monkeypatch.setattr("heartgen.cohort.cluster.connected", refuse)
    pd.testing.assert_frame_equal(batch(hearts, out), two[1])


def test_results_of_other_options_are_not_taken_for_these(two, hearts, tmp_path):
    with pytest.raises(InputError, match=r"results of other options.*--redo"):
        batch(hearts, two[0], lod=2)
    out = tmp_path / "out"
    shutil.copytree(two[0], out)
    table = batch(hearts / "a.nii.gz", out, lod=2, redo=True, workers=Workers(1))
    assert list(table["lod"]) == [2]
    assert json.loads((out / "cases" / "a" / "report.json").read_text())["options"]["lod"] == 2


def test_a_folder_has_one_batch_at_a_time(hearts, tmp_path):
    with FileLock(tmp_path / ".lock"), pytest.raises(HeartgenError, match="another run"):
        batch(hearts, tmp_path)


def test_command_tells_what_came_out(two, hearts):
    out, table, _ = two
    outcome = CliRunner().invoke(app, ["batch", str(hearts), "-o", str(out)])
    assert outcome.exit_code == 1
    assert "3 of 5 have no mesh, odd/block because: no cavity" in outcome.stderr
    assert f"{table['error_mean'].median():.3f}" in outcome.stdout
    assert str(out / "results.csv") in outcome.stdout


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--set", "quality=1,2"], "heartgen sweep compares them"),
        (["--set", "color=red"], "there is no option 'color'"),
        (["--elements", "12"], "for example 1x12x6"),
        (["--scheduler", "tcp://127.0.0.1:1", "--jobs", "2"], "has workers of its own"),
        (["--cluster", "no_such.Cluster"], "there is no cluster no_such.Cluster"),
        (["--scheduler", "nonsense"], "no scheduler answers there"),
    ],
)
def test_bad_choices_are_a_sentence(hearts, tmp_path, arguments, sentence):
    command = ["batch", str(hearts), "-o", str(tmp_path), *arguments]
    outcome = CliRunner().invoke(app, command)
    assert outcome.exit_code == 1
    assert sentence in " ".join(outcome.stderr.split())
    assert "Traceback" not in outcome.output
