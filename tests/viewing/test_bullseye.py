"""Bull's-eye plots have every segment in its place."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("matplotlib")

from matplotlib.colors import to_hex
from matplotlib.patches import Wedge

import heartgen
from benchmarks.solids import ellipsoid
from heartgen.fields import SEGMENTS
from heartgen.viewing import Bullseye, bullseyes, draw_bullseye
from heartgen.viewing.bullseye import ABSENT

ELEMENTS = (1, 12, 6)


def wedges(figure):
    return [p for p in figure.axes[0].patches if isinstance(p, Wedge)]


def test_segments_are_where_cardiologists_look_for_them():
    values = {n: float(n) for n in SEGMENTS if n != 10}
    figure = draw_bullseye(Bullseye("n", "number", values, (1.0, 17.0)))
    found = dict(zip(SEGMENTS, wedges(figure), strict=True))
    middle = {n: np.radians((w.theta1 + w.theta2) / 2) for n, w in found.items()}
    for n, word in SEGMENTS.items():
        x, y = np.cos(middle[n]), np.sin(middle[n])
        if "anterior" in word and "antero" not in word:
            assert y == pytest.approx(1)
        if word.endswith("septal"):
            assert x < 0
        if "lateral" in word:
            assert x > 0
        if word.endswith("inferior"):
            assert y == pytest.approx(-1)
    assert found[17].r < found[13].r < found[7].r < found[1].r
    assert to_hex(found[10].get_facecolor()) == ABSENT
    assert {t.get_text() for t in figure.axes[0].texts} >= {"17.0", "–", "septal"}


def test_quantities_of_a_beat():
    meshes = [
        ellipsoid(22.0, 60.0, 10.0, 20.0, ELEMENTS),
        ellipsoid(15.0, 52.0, 14.0, 17.0, ELEMENTS),
    ]
    found = bullseyes(heartgen.compare(meshes, ["large", "small"]), meshes)
    keys = ["diastole", "systole", "thickening", "longitudinal", "circumferential", "radial"]
    assert [shown.key for shown in found] == keys
    assert found[0].title == "wall, large (mm)"
    assert found[0].limits == found[1].limits
    assert found[2].values[7] == pytest.approx(found[1].values[7] / found[0].values[7] - 1)
    for shown in found:
        low, high = shown.limits
        assert all(low <= value <= high for value in shown.values.values())
    other = [meshes[0], ellipsoid(15.0, 52.0, 14.0, 17.0, (1, 12, 8))]
    assert len(bullseyes(heartgen.compare(other), other)) == 3
