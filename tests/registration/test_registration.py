"""Deformations fold nowhere, and the smoothing operator is what it says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heartgen.registration.deformation import Deformation, GridMap, NodeGrid, fold_bound
from heartgen.registration.smoothing import Smoothing, conjugate_gradients


def grid(spacing: float = 2.0) -> NodeGrid:
    """A small grid, turned and shifted."""
    from scipy.spatial.transform import Rotation

    frame = np.eye(4)
    frame[:3, :3] = spacing * Rotation.from_rotvec([0.2, 0.3, -0.4]).as_matrix()
    frame[:3, 3] = [5, -3, 1]
    return NodeGrid(frame, (5, 6, 4))


def inside(g: NodeGrid, n: int, seed: int = 0) -> np.ndarray:
    """Random points in the grid."""
    index = np.random.default_rng(seed).uniform(0, np.array(g.shape) - 1, (n, 3))
    return index @ g.frame[:3, :3].T + g.frame[:3, 3]


def test_interpolation_reproduces_affine_functions_and_sums_to_one() -> None:
    g = grid()
    points = inside(g, 50)
    basis = g.interpolation(points)
    a, b = np.random.default_rng(1).standard_normal((3, 3)), np.array([1.0, 2, 3])
    assert np.abs(basis @ (g.nodes() @ a + b) - (points @ a + b)).max() < 1e-10
    assert np.abs(basis.sum(1) - 1).max() < 1e-12


@settings(max_examples=40)
@given(st.integers(0, 10_000), st.floats(0.0, 1.5))
def test_fold_bound_is_a_lower_bound_of_the_determinant(seed: int, size: float) -> None:
    g = grid()
    u = size * np.random.default_rng(seed).standard_normal((g.size, 3))
    part = GridMap(g, u)
    points, h = inside(g, 30, seed) * 1.0, 1e-5
    center = g.nodes().mean(0)
    points = center + 0.9 * (points - center)
    slopes = [(part(points + h * e) - part(points - h * e)) / (2 * h) for e in np.eye(3)]
    determinant = np.linalg.det(np.stack(slopes, -1))
    crossing = np.abs(np.linalg.det(np.stack(slopes, -1)) - determinant) > 1
    assert (determinant[~crossing] >= fold_bound(g, u).min() - 1e-3).all()


def test_fold_bound_of_known_maps() -> None:
    g = grid()
    assert np.allclose(fold_bound(g, np.zeros((g.size, 3))), 1)
    squeeze = -0.5 * (g.nodes() - g.nodes().mean(0))
    assert np.allclose(fold_bound(g, squeeze), 0.125)
    assert (fold_bound(g, 4 * squeeze) < 0).all()


def test_chain_applies_its_maps_in_order() -> None:
    g = grid()
    first, second = GridMap(g, np.full((g.size, 3), 0.1)), GridMap(g, 0.05 * g.nodes())
    points = inside(g, 10)
    chain = Deformation().then(first).then(second)
    assert np.array_equal(chain(points), second(first(points)))
    assert chain.least_determinant() == min(first.least_determinant(), second.least_determinant())


def test_smoothing_matches_its_spectrum() -> None:
    s = Smoothing((5, 6, 4))
    rng = np.random.default_rng(0)
    a, b = rng.standard_normal((2, 120, 3))
    assert np.vdot(a, s.apply(b)) == pytest.approx(np.vdot(s.apply(a), b))
    assert np.abs(s.apply(np.ones((120, 3)))).max() < 1e-12
    dense = np.stack([s.apply(np.outer(e, [1, 0, 0]))[:, 0] for e in np.eye(120)])
    assert s.trace == pytest.approx(np.trace(dense))
    assert np.allclose(np.sort(np.linalg.eigvalsh(dense)), np.sort(s.spectrum.ravel()), atol=1e-9)
    solved = s.solve(a, 2.0, 0.7)
    assert np.abs(2 * s.apply(solved) + 0.7 * solved - a).max() < 1e-3


def test_conjugate_gradients_solve() -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((30, 30))
    matrix = root @ root.T + np.eye(30)
    right = rng.standard_normal((30, 3))
    x = conjugate_gradients(lambda v: matrix @ v, right, lambda r: r, 500)
    assert np.abs(matrix @ x - right).max() < 1e-7
