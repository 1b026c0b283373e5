from __future__ import annotations

from html.parser import HTMLParser

import numpy as np
import pandas as pd
import pytest
from typer.testing import CliRunner

from heartgen import samples
from heartgen.cli.cohort import app
from heartgen.cohort import Case, Workers, batch, write_report
from heartgen.cohort.summary import BOTH, LEFT, by_ventricles, reasons, summarize
from heartgen.viewing.distributions import draw_boxes


class Reader(HTMLParser):
    """Collects what a page shows, what it would load, and the pages in it."""

    def __init__(self, text):
        super().__init__()
        self.words, self.loads, self.scenes = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        for name, value in attrs:
            if name in {"src", "data", "poster", "action"}:
                self.loads.append(value)
            elif name == "srcdoc":
                self.scenes.append(value)

    def handle_data(self, data):
        self.words.append(" ".join(data.split()))


def made_up():
    """A table of four hearts of the left ventricle, two of both, and one without a mesh."""
    n = 7
    return pd.DataFrame(
        {
            "case": [f"case{i}" for i in range(n)],
            "group": [""] * n,
            "status": ["success"] * 5 + ["error above the voxel diagonal", "failed: no cavity"],
            "success": [True] * 5 + [False, False],
            "valid": [True] * 6 + [False],
            "error_mean": [0.1, 0.2, 0.3, 0.4, 1.0, 3.0, np.nan],
            "q_mean": [0.6, 0.7, 0.5, 0.4, 0.5, 0.3, np.nan],
            "size_right_width": [np.nan] * 4 + [60.0, 61.0, np.nan],
        }
    )


def test_groups_are_the_ventricles_where_none_are_given():
    groups = {group.name: group for group in summarize(by_ventricles(made_up()))}
    left, both = groups[LEFT], groups[BOTH]
    assert (left.cases, left.successes, left.valid, left.failures) == (4, 4, 4, 0)
    assert (both.cases, both.successes, both.valid, both.failures) == (2, 1, 2, 0)
    assert groups["not meshed"].failures == 1
    assert groups["not meshed"].error is None
    assert left.error.median == pytest.approx(0.25)
    assert (left.error.low, left.error.high) == pytest.approx((0.175, 0.325))
    assert (both.error.largest, both.quality.least) == (3.0, 0.3)


def test_wriggle_is_told_where_it_was_measured():
    table = by_ventricles(made_up())
    assert all(group.wriggle is None for group in summarize(table))
    along = [10.0, 20.0, np.nan, 30.0, 40.0, 60.0, np.nan]
    groups = {g.name: g for g in summarize(table.assign(fair_longitudinal_median=along))}
    assert groups[LEFT].wriggle.median == 20
    assert groups[BOTH].wriggle.largest == 60


def test_a_case_without_a_mesh_counts_with_the_only_kind_there_is():
    table = made_up().drop(columns="size_right_width")
    (group,) = summarize(by_ventricles(table))
    assert (group.name, group.cases, group.failures) == (LEFT, 7, 1)
    assert reasons(table) == [("case6", "no cavity")]


def test_boxes_are_those_of_the_groups():
    figure = draw_boxes(by_ventricles(made_up()))
    names = [text.get_text() for text in figure.axes[0].get_xticklabels()]
    assert names == [f"{LEFT} (4)", f"{BOTH} (2)"]
    medians = [
        line.get_ydata()[0] for line in figure.axes[0].lines if line.get_color() == "#d55e00"
    ]
    assert medians == pytest.approx([0.25, 2.0])


@pytest.fixture(scope="module")
def out(tmp_path_factory):
    """A batch of a heart, of one that is almost the same, and of a block."""
    folder = tmp_path_factory.mktemp("report") / "my <cohort>"
    heart = samples.lifelike_lv(3.0).mask
    voxels = np.zeros_like(heart.voxels)
    voxels[4:14, 4:14, 4:14] = True
    cases = [
        Case("heart", heart),
        Case("block", type(heart)(voxels, heart.affine, "block")),
    ]
    batch(cases, folder, workers=Workers(1))
    return folder


@pytest.mark.slow
def test_page_tells_all_and_loads_nothing(out):
    outcome = CliRunner().invoke(app, ["report", str(out)])
    assert outcome.exit_code == 0, outcome.output
    page = Reader((out / "report.html").read_text(encoding="utf-8"))
    assert page.loads == []
    assert "my <cohort>" in page.words
    text = " ".join(page.words)
    assert "1 of 2 cases are a success (50%); 1 have no mesh." in text
    assert "no cavity found" in text
    assert "heart" in page.words
    assert "block" in page.words


@pytest.mark.slow
def test_masks_that_are_not_there_any_more_are_not_shown(out):
    page = Reader(write_report(out, out / "other.html").read_text(encoding="utf-8"))
    assert page.scenes == []


@pytest.mark.slow
def test_best_and_worst_are_shown_in_3d(hearts, tmp_path):
    batch(hearts / "a.nii.gz", tmp_path, workers=Workers(1))
    page = Reader(write_report(tmp_path).read_text(encoding="utf-8"))
    (scene,) = page.scenes
    assert "base64Str" in scene
    inner = Reader(scene)
    assert [link for link in inner.loads if not link.startswith("data:")] == []


def test_a_folder_without_results_is_a_sentence(tmp_path):
    outcome = CliRunner().invoke(app, ["report", str(tmp_path)])
    assert outcome.exit_code == 1
    assert "give a folder that heartgen batch made" in outcome.stderr
