"""Proportions that no left ventricle has are told."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heartgen.anatomy.plausibility import check_proportions, check_roundness, roundness


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


def _voxels(crescent: float, scale: float = 1.0) -> tuple[np.ndarray, float]:
    """Pool of voxels of 1 mm: a cylinder, less one that is moved by some of its radius."""
    x = np.stack(np.meshgrid(*[np.arange(-24.0, 25.0)] * 3, indexing="ij"), -1).reshape(-1, 3)
    inside = np.hypot(x[:, 0], x[:, 1]) < 20
    return scale * x[inside & (np.hypot(x[:, 0] - crescent * 20, x[:, 1]) >= 20)], scale


@given(angle=st.floats(0, 3), scale=st.floats(0.1, 10))
def test_roundness_knows_neither_size_nor_direction(angle: float, scale: float) -> None:
    pool, voxel = _voxels(0.9, scale)
    turn = np.array(
        [[1, 0, 0], [0, np.cos(angle), -np.sin(angle)], [0, np.sin(angle), np.cos(angle)]]
    )
    straight = roundness(pool, np.array([0.0, 0.0, 1.0]), voxel)
    turned = roundness(pool @ turn.T, turn @ [0.0, 0.0, 1.0], voxel)
    assert turned == pytest.approx(straight, rel=0.05)
    assert straight == pytest.approx(roundness(*_direction(0.9)), rel=0.02)


def _direction(crescent: float) -> tuple[np.ndarray, np.ndarray, float]:
    pool, voxel = _voxels(crescent)
    return pool, np.array([0.0, 0.0, 1.0]), voxel


def test_a_disc_is_round_and_a_crescent_is_told() -> None:
    assert roundness(*_direction(2.0)) == pytest.approx(1.0, abs=0.02)
    assert check_roundness(*_direction(2.0)) == []
    (finding,) = check_roundness(*_direction(0.9))
    assert "crescent" in finding.message
    assert finding.serious
