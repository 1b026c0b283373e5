"""Proportions that no left ventricle has are told."""

from __future__ import annotations

import pytest

from heartgen.anatomy.plausibility import check_proportions


@pytest.mark.parametrize(
    ("length", "radius", "thickness", "ratio"),
    [
        (80, 25, 9, 1.2),
        (95, 33, 6, 1.8),
        (110, 40, 6, 2.6),
        (66, 10.3, 20, 0.09),
        (14, 3.2, 2.1, 0.27),
        (5, 1.5, 0.8, 0.6),
    ],
    ids=["normal", "dilated", "very dilated", "hypertrophic, end systole", "rabbit", "mouse"],
)
def test_hearts_are_left_alone(
    length: float, radius: float, thickness: float, ratio: float
) -> None:
    assert check_proportions(length, radius, thickness, ratio) == []


@pytest.mark.parametrize(
    ("length", "radius", "thickness", "ratio", "words"),
    [
        (28, 22, 9, 0.6, "distance between slices"),
        (300, 25, 9, 1.5, "distance between slices"),
        (80, 25, 1, 1.2, "too thin a wall"),
        (80, 35, 4.5, 3.9, "too large a cavity"),
        (80, 35, 3.5, 2.9, "too thin a wall, as a right one"),
    ],
)
def test_what_is_no_heart_is_told(
    length: float, radius: float, thickness: float, ratio: float, words: str
) -> None:
    (finding,) = check_proportions(length, radius, thickness, ratio)
    assert words in finding.message
    assert finding.serious
