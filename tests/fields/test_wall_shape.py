"""Thickness and curvature of solids of which both are known."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from heartgen.fields.wall_shape import curvatures, wall_thickness
from heartgen.mesh import HexMesh


def test_thickness_of_a_hollow_ball(ball: HexMesh) -> None:
    thickness = wall_thickness(ball)
    assert np.mean(thickness) == pytest.approx(10, rel=0.005)
    assert np.abs(thickness - 10).max() < 0.01


@pytest.mark.slow
def test_thickness_of_an_ellipsoid_is_the_shortest_way_across(land: HexMesh) -> None:
    t, around = np.meshgrid(np.linspace(0, 1.9, 800), np.radians(np.arange(0, 360, 1.0)))
    epi = [10 * np.sin(t) * np.cos(around), 10 * np.sin(t) * np.sin(around), -20 * np.cos(t)]
    epi = np.stack(epi, -1).reshape(-1, 3)
    points = land.lagrange_points()
    inner = points[:, :16]
    true = cKDTree(epi[epi[:, 2] <= 5]).query(inner.reshape(-1, 3))[0].reshape(-1, 16)
    found = wall_thickness(land)
    assert found[:, :16].mean() == pytest.approx(true.mean(), rel=0.005)
    assert np.array_equal(found[:, :16], found[:, 48:])


def test_curvature_of_a_ball(ball: HexMesh) -> None:
    radius = np.linalg.norm(ball.lagrange_points(), axis=-1)
    away = ball.topology.index[:, 2] > 0
    found = curvatures(ball)[away] * radius[away][..., None]
    assert found == pytest.approx(1, abs=0.02)


def test_curvature_of_an_ellipsoid_at_its_equator(land: HexMesh) -> None:
    points, found = land.lagrange_points(), curvatures(land)
    near = (np.abs(points[..., 2]) < 0.8) & (np.arange(64) < 16)
    around, along = found[near].mean(0)
    assert around == pytest.approx(1 / 7, rel=0.03)
    assert along == pytest.approx(7 / 17**2, rel=0.05)
