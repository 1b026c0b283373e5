"""The trade-off app, without a browser, on a small heart."""

from __future__ import annotations

import csv
import io

import pytest

pytest.importorskip("pyvista")

from heartgen.viewing import tradeoff as drawn
from heartgen.widgets import tradeoff
from heartgen.widgets.input_case import InputCase
from heartgen.widgets.tradeoff_page import COLORS
from heartgen.widgets.tradeoff_study import MOST_MESHES, TradeoffStudy


@pytest.fixture
def study(finished):
    """A study with the small heart."""
    made = TradeoffStudy()
    made._add(finished.case)
    yield made
    made.close()


def test_colors_are_those_of_the_figure():
    assert COLORS == drawn.COLORS


def test_combinations_are_all_of_them(study):
    study.elements, study.qualities = "auto, 1x4x2", "0.5, 2,"
    found = [(options.elements, options.quality) for options in study.combinations()]
    assert found == [(None, 0.5), (None, 2.0), ((1, 4, 2), 0.5), ((1, 4, 2), 2.0)]


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("elements", "1x4", "are not three"),
        ("elements", "1x4x4000", "at most"),
        ("qualities", "much", "not a number"),
        ("qualities", ",".join(str(n) for n in range(1, 60)), f"more than the {MOST_MESHES}"),
        ("levels", (), "tick at least one"),
    ],
)
def test_what_cannot_be_fitted_is_told(study, name, value, told):
    setattr(study, name, value)
    study.start()
    assert study.runs == []
    assert told in study.complaint


def test_without_a_heart_there_is_nothing_to_fit():
    made = TradeoffStudy()
    made.start()
    assert "no heart" in made.complaint
    made.close()


def test_hearts_have_names_of_their_own(study, finished):
    study._add(finished.case)
    assert len(study.hearts) == 1
    assert "already" in study.complaint
    study._add(InputCase(finished.case.mask, "", "1"))
    assert [heart.name for heart in study.hearts][1].endswith("(2)")
    study.remove(study.hearts[0])
    assert len(study.hearts) == 1


@pytest.mark.slow
def test_fits_arrive_and_are_shown(finished):
    made = tradeoff(None)
    page, study = made.page, made.study
    study._add(finished.case)
    page.levels[2].value = False
    page.elements.value, page.qualities.value = "1x4x2", "0.5, 2"
    page._start()
    study._pool.submit(lambda: None).result()
    assert not study.active
    assert [len(along) for _, along in study.curves()] == [2, 2]
    assert [curve["name"] for curve in page.plot.curves] == ["quality 0.5", "quality 2"]
    assert [(p["label"], p["curve"]) for p in page.plot.points] == [
        ("1", 0), ("2", 0), ("1", 1), ("2", 1),
    ]  # fmt: skip
    assert page.table.value.count("<tr") == 5
    page.plot.selected = 3
    assert page.shown.shown is study.outcomes[3]
    rows = list(csv.DictReader(io.StringIO(study.table())))
    assert [(row["quality"], row["lod"]) for row in rows] == [
        ("0.5", "1"), ("0.5", "2"), ("2.0", "1"), ("2.0", "2"),
    ]  # fmt: skip
    assert float(rows[3]["error_mean"]) == study.outcomes[3].result.report.accuracy.mean
    sent = []
    page.png.hand_over = lambda name, content: sent.append(content)
    page._save_plot()
    assert sent[0].startswith(b"\x89PNG")
    page._start()
    assert len(study.runs) == 2
    assert "has been fitted" in study.complaint
    for each in (study, page.shown):
        each.close()
