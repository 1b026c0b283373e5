from __future__ import annotations

import re

import numpy as np
import pytest

pytest.importorskip("pyvista")

from heartgen.fields import SEGMENTS
from heartgen.viewing.bullseye_svg import bullseye_html, segment_key
from heartgen.viewing.segment_values import result_bullseyes


@pytest.fixture(scope="module")
def eyes(result):
    return {eye.key: eye for eye in result_bullseyes(result)}


def test_values_by_segment_are_those_of_the_report(result, eyes):
    assert set(eyes) == {"thickness", "error", "wriggle"}
    error = list(eyes["error"].values.values())
    assert set(eyes["error"].values) == set(SEGMENTS)
    assert min(error) < result.report.accuracy.reverse_mean < max(error)
    thickness = np.mean(list(eyes["thickness"].values.values()))
    assert thickness == pytest.approx(result.anatomy.wall_thickness, rel=0.25)
    for eye in eyes.values():
        low, high = eye.limits
        assert all(low <= value <= high for value in eye.values.values())


def test_plot_tells_every_value(eyes):
    page = bullseye_html(eyes["error"])
    assert page.count("<path") == len(SEGMENTS)
    for segment, name in SEGMENTS.items():
        assert f"{segment}, {name}: {eyes['error'].values[segment]:.2f}" in page


def test_key_tells_all_segments_apart():
    numbers = re.findall(r">(\d+)</text>", segment_key())
    assert sorted(map(int, numbers)) == list(SEGMENTS)
