from __future__ import annotations

from dataclasses import replace

import pytest

from heartgen.viewing.card import number, sections, verdict


def changed(report, *, mean=None, quality=None, invalid=0, crossing=0):
    accuracy = report.accuracy if mean is None else replace(report.accuracy, mean=mean)
    measured = replace(
        report.quality,
        valid=invalid + crossing == 0,
        invalid_elements=invalid,
        overlapping_elements=crossing,
    )
    if quality is not None:
        measured = replace(measured, mean=quality)
    return replace(report, accuracy=accuracy, quality=measured)


def test_success_is_said(result):
    judged = verdict(result.report)
    assert judged.level == "good"
    assert judged.text.startswith("success")


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"mean": 9.0}, "error above the voxel diagonal (9.00, not below"),
        ({"quality": 0.25}, "quality below the threshold (0.250, not above 0.33)"),
    ],
)
def test_valid_but_no_success_says_why(result, change, reason):
    report = changed(result.report, **change)
    judged = verdict(report)
    assert judged.level == "doubtful"
    assert not report.success
    assert reason in judged.text


def test_fold_outweighs_all_else(result):
    judged = verdict(changed(result.report, invalid=1))
    assert judged.level == "bad"
    assert judged.text == "not valid: 1 element folds"
    judged = verdict(changed(result.report, invalid=3, crossing=2))
    assert judged.text == "not valid: 3 elements fold and walls cross in 2 elements"


def test_every_surface_and_step_has_its_row(result):
    rows = {name for section in sections(result.report) for name, _ in section.rows}
    assert {"LV endocardium", "epicardium", "base", *result.report.seconds} <= rows


def test_fairness_has_its_rows(result):
    rows = dict(row for section in sections(result.report) for row in section.rows)
    assert rows["wriggle along, median"] == f"{result.report.fairness.longitudinal_median:.1f}°"
    assert "normals off by, mean" in rows
    unknown = replace(result.report.fairness, normal_mean=None, normal_p95=None)
    without = sections(replace(result.report, fairness=unknown))
    assert "normals off by, mean" not in dict(row for part in without for row in part.rows)


def test_clinical_indices_have_their_rows(result):
    rows = dict(row for section in sections(result.report) for row in section.rows)
    indices = result.report.indices
    assert rows["left cavity"] == f"{number(indices.lv_cavity_volume)} ml"
    assert rows["mid 7–12"].split()[0] == f"{indices.wall_thickness[7]:.1f}"
    assert rows["counted from"].startswith("the patient's right and front")
    cut_short = replace(indices, wall_thickness={})
    rows = dict(
        row
        for section in sections(replace(result.report, indices=cut_short))
        for row in section.rows
    )
    assert rows["apex 17"] == "–"


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.13, "0.130"),
        (1.375, "1.38"),
        (99.96, "100"),
        (1234.4, "1234"),
        (0.0, "0.00"),
        (-2.5, "-2.50"),
    ],
)
def test_numbers_are_written_plainly(value, text):
    assert number(value) == text
