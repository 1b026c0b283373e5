from __future__ import annotations

import pytest
from typer.testing import CliRunner

import heartgen
from heartgen import samples
from heartgen.cli.cohort import app
from heartgen.cohort import sweep
from heartgen.cohort.summary import by_options, summarize
from heartgen.errors import InputError
from heartgen.viewing.tradeoff import draw_sweep

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def mask():
    return samples.lifelike_lv(3.0).mask


@pytest.fixture(scope="module")
def table(mask):
    return sweep(mask, lod=[1, 2], elements=[(1, 12, 6), (1, 8, 4)], optimize=False)


def test_every_combination_has_a_row(table):
    found = list(zip(table["elements"], table["lod"], strict=True))
    assert found == [("1x12x6", 1), ("1x12x6", 2), ("1x8x4", 1), ("1x8x4", 2)]
    assert not table["optimize"].any()


def test_figures_are_those_of_single_fits(table, mask):
    single = heartgen.personalize(mask, lod=2, elements=(1, 8, 4), optimize=False)
    row = table.iloc[3]
    assert row["error_mean"] == pytest.approx(single.report.accuracy.mean, rel=1e-9)
    assert row["q_mean"] == pytest.approx(single.report.quality.mean, rel=1e-9)


def test_a_level_that_does_not_exist_is_refused_before_any_work(mask):
    with pytest.raises(InputError, match="level of detail 7 does not exist"):
        sweep(mask, lod=[1, 7])


def test_a_combination_that_fails_is_told_and_the_others_are_there(mask):
    found = sweep(mask, lod=1, optimize=False, elements=[(1, 12, 6), (1, 1, 1)])
    assert [status.startswith("failed: ") for status in found["status"]] == [False, True]


def test_groups_are_the_combinations(table):
    groups = summarize(by_options(table, ["elements", "lod"]))
    assert [g.name for g in groups] == [
        "elements 1x12x6, lod 1",
        "elements 1x12x6, lod 2",
        "elements 1x8x4, lod 1",
        "elements 1x8x4, lod 2",
    ]
    assert groups[0].error.median == table["error_mean"][0]


def test_picture_has_a_curve_for_each_combination(table):
    axes = draw_sweep(table, ["lod", "elements"]).axes[0]
    curves = {line.get_label(): line for line in axes.lines if line.get_marker() != "None"}
    assert set(curves) == {"elements 1x12x6", "elements 1x8x4"}
    assert list(curves["elements 1x8x4"].get_xdata()) == list(table["error_mean"][2:])
    assert [text.get_text() for text in axes.texts] == ["1", "2", "1", "2"]


def test_command_writes_table_and_picture_and_goes_on(hearts, tmp_path):
    command = ["sweep", str(hearts / "a.nii.gz"), "-o", str(tmp_path), "--jobs", "1"]
    command += ["--lod", "1,2", "--set", "optimize=no"]
    outcome = CliRunner().invoke(app, command)
    assert outcome.exit_code == 0, outcome.output
    assert (tmp_path / "tradeoff.png").read_bytes().startswith(b"\x89PNG")
    assert str(tmp_path / "results.csv") in outcome.stdout
    assert "lod 2" in outcome.stdout
    first = (tmp_path / "results.csv").read_bytes()
    assert CliRunner().invoke(app, command).exit_code == 0
    assert (tmp_path / "results.csv").read_bytes() == first
