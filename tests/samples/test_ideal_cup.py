from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import integrate

from heartgen import samples

RADIUS, LENGTH, WALL, BASE = 22.0, 60.0, 10.0, 20.0
CUP = samples.ideal_cup(4.0)


def cup_volume(radius, length, base):
    """Of an ellipsoid with semi-axes (radius, radius, length) below the plane z = base."""
    return np.pi * radius**2 * (base + length - (base**3 + length**3) / (3 * length**2))


def cup_area(radius, length, base):
    """Lateral area of the same, by adaptive quadrature of the surface of revolution."""

    def ring(polar):
        metric = np.hypot(radius * np.cos(polar), length * np.sin(polar))
        return 2 * np.pi * radius * np.sin(polar) * metric

    return integrate.quad(ring, 0, np.arccos(-base / length), epsrel=1e-12)[0]


def rim_radius(radius, length, base):
    return radius * np.sqrt(1 - (base / length) ** 2)


@pytest.mark.slow
@given(
    radius=st.floats(5, 40),
    length=st.floats(10, 100),
    wall=st.floats(1, 15),
    cut=st.floats(-0.5, 0.8),
)
@settings(max_examples=8)
def test_ideal_volumes_and_areas_are_those_of_ellipsoids(radius, length, wall, cut):
    base = cut * length
    truth = samples.ideal_cup(
        radius / 5, radius=radius, length=length, wall=wall, base_height=base
    ).truth
    inside, outside = (radius, length, base), (radius + wall, length + wall, base)
    annulus = np.pi * (rim_radius(*outside) ** 2 - rim_radius(*inside) ** 2)
    assert_allclose(truth.cavity_volume, cup_volume(*inside), rtol=1e-6)
    assert_allclose(truth.wall_volume, cup_volume(*outside) - cup_volume(*inside), rtol=1e-6)
    assert_allclose(truth.area("endo"), cup_area(*inside), rtol=1e-6)
    assert_allclose(truth.area("epi"), cup_area(*outside), rtol=1e-6)
    assert_allclose(truth.area("base"), annulus, rtol=1e-6)


def test_surface_samples_integrate_functions():
    """Second moment of the endocardium of the ideal cup about its axis, against quadrature."""
    points, weights = CUP.truth.surface(20_000, "endo")

    def ring(polar):
        r = RADIUS * np.sin(polar)
        metric = np.hypot(RADIUS * np.cos(polar), LENGTH * np.sin(polar))
        return 2 * np.pi * r**3 * metric

    exact = integrate.quad(ring, 0, np.arccos(-BASE / LENGTH))[0]
    assert_allclose(weights @ (points[:, 0] ** 2 + points[:, 1] ** 2), exact, rtol=1e-4)
    assert_allclose(weights @ points[:, :2] / weights.sum(), 0, atol=0.01)


@given(offset=st.floats(-6, 6), polar=st.floats(0.0, 1.7), angle=st.floats(0, 6.28))
def test_distance_of_points_off_the_ideal_endocardium(offset, polar, angle):
    """Along the analytic normal, short of the focal distance and away from the rim."""
    truth = CUP.truth
    r, z = RADIUS * np.sin(polar), -LENGTH * np.cos(polar)
    around = np.array([np.cos(angle), np.sin(angle)])
    normal = np.array([*(np.sin(polar) / RADIUS * around), -np.cos(polar) / LENGTH])
    point = np.array([*(r * around), z]) + offset * normal / np.linalg.norm(normal)
    assert_allclose(truth.distance(point[None], "endo"), abs(offset), atol=1e-6)


@given(share=st.floats(-0.3, 0.9))
def test_distance_from_the_medial_axis_of_the_cavity(share):
    """On the long axis of a prolate ellipsoid, a whole circle of points is closest."""
    focus = LENGTH**2 - RADIUS**2
    z = -share * focus / LENGTH
    exact = RADIUS * np.sqrt(1 - z**2 / focus)
    assert_allclose(CUP.truth.distance([[0, 0, z]], "endo"), exact, atol=1e-4)


def test_distance_to_rims_base_and_poles_of_the_ideal_cup():
    inner = rim_radius(RADIUS, LENGTH, BASE)
    outer = rim_radius(RADIUS + WALL, LENGTH + WALL, BASE)
    middle = (inner + outer) / 2
    points = [
        [0, 0, 40],
        [0, middle, 27],
        [0, -middle, 5],
        [0, 0, -77],
        [outer + 3, 0, 24],
        [0, 0, 20],
    ]
    above_inner = np.hypot(20, inner)
    truth = CUP.truth
    assert_allclose(
        truth.distance(points, "base"),
        [above_inner, 7, 15, np.hypot(97, inner), 5, inner],
        atol=1e-6,
    )
    assert_allclose(truth.distance(points[:1], "endo"), above_inner, atol=1e-6)
    assert_allclose(truth.distance(points[3:4], "epi"), 7, atol=1e-6)
    assert_allclose(truth.distance(points[4:5]), 5, atol=1e-6)


def test_rims_of_the_ideal_cup_are_circles():
    radii = [np.linalg.norm(rim[:, :2], axis=1) for rim in CUP.truth.rims]
    assert_allclose(radii[0], rim_radius(RADIUS, LENGTH, BASE))
    assert_allclose(radii[1], rim_radius(RADIUS + WALL, LENGTH + WALL, BASE))
