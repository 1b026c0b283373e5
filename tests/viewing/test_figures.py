"""Histograms of the error and the quality."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from heartgen.viewing import draw_histograms


@pytest.mark.slow
@pytest.mark.parametrize("fitted", ["result", "stack"])
def test_errors_drawn_are_those_of_the_report(fitted, request):
    result = request.getfixturevalue(fitted)
    bars = draw_histograms(result).axes[0].patches
    shares = np.array([bar.get_height() for bar in bars])
    places = np.array([bar.get_x() + bar.get_width() / 2 for bar in bars])
    assert shares.sum() == pytest.approx(1)
    assert shares @ places == pytest.approx(result.report.accuracy.mean, rel=0.02)
