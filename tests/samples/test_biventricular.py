from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy import ndimage

from heartgen import samples

pytestmark = pytest.mark.slow

RADIUS, LENGTH, LV_WALL, SEPTUM, RV_WALL = 22.0, 80.0, 10.0, 10.0, 3.0
BASE = LENGTH / 4
POLE = BASE - LENGTH
CRUMBS = 0.01
NORMAL = samples.biv(4.0).truth

HEARTS = st.fixed_dictionaries(
    {
        "rv_size": st.floats(0.9, 1.25),
        "rv_wall": st.floats(2, 6),
        "lv_wall": st.floats(7, 14),
        "septum": st.floats(7, 14),
        "tilt": st.floats(-15, 15),
        "radius": st.floats(18, 28),
        "length": st.floats(75, 95),
        "rv_apex": st.floats(10, 25),
    }
)


def truncated_ellipsoid(radius, length, base, slope):
    """Volume below the tilted plane z = base + slope x: a cap of the unit ball, stretched."""
    height = base / np.hypot(length, slope * radius)
    return np.pi * radius**2 * length * (2 / 3 + height - height**3 / 3)


def rooms(sample):
    """Volumes, mm^3, and centroids, world, of outside and pools below the base; largest first.

    Also checks that nothing else is empty but crumbs of the right pool, in its sharp horns.
    """
    mask, (center, normal) = sample.mask, sample.truth.basal_plane
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    below = ((world - center) @ normal < 0).reshape(mask.voxels.shape)
    labels, count = ndimage.label(below & ~mask.voxels)
    index = np.arange(1, count + 1)
    volumes = np.bincount(labels.ravel())[1:] * np.prod(mask.spacing)
    centroids = mask.to_world(np.array(ndimage.center_of_mass(labels > 0, labels, index)))
    order = np.argsort(-volumes)
    assert volumes[order[3:]].sum() < CRUMBS * volumes[order[2]]
    return volumes[order[:3]], centroids[order[:3]]


# --- volumes -------------------------------------------------------------------------------------


@given(heart=HEARTS)
@settings(max_examples=5)
def test_left_pool_is_a_truncated_ellipsoid(heart):
    truth = samples.biv(8.0, **heart).truth
    slope = np.tan(np.radians(heart["tilt"]))
    exact = truncated_ellipsoid(heart["radius"], 0.75 * heart["length"], heart["length"] / 4, slope)
    assert_allclose(truth.cavity_volume, exact, rtol=1e-7)


@pytest.mark.parametrize("name", samples.names(2))
def test_pools_are_two_rooms_with_the_true_volumes_and_centroids(name, loaded):
    sample = loaded[name]
    truth = sample.truth
    volumes, centroids = rooms(sample)
    exact = np.array([truth.cavity_volume, truth.rv.cavity_volume])
    middles = np.array([truth.rv.left_centroid, truth.rv.centroid])
    order = np.argsort(-exact)
    assert_allclose(volumes[1:], exact[order], rtol=3e-3)
    assert_allclose(centroids[1:], middles[order], atol=0.15)


def test_volumes_of_pool_and_wall_converge_with_the_voxels():
    error = []
    for spacing in (4.0, 2.0, 1.0):
        poses = [samples.biv(spacing, rv_wall=6.0, rotation=seed) for seed in range(3)]
        found = [rooms(s)[0][2] / s.truth.rv.cavity_volume - 1 for s in poses]
        error.append(np.sqrt(np.mean(np.square(found))))
    assert error[-1] < 1e-3
    assert error[0] / error[-1] > 4, "at least first order in the spacing"


def test_area_of_the_base_is_that_of_the_highest_slice():
    """Pixel by pixel on the highest plane, a hundredth of a millimeter below the base."""
    sample = samples.biv((0.25, 0.25, 2.0), translation=(0.0, 0.0, 1.01))
    top = np.flatnonzero(sample.mask.voxels.any(axis=(0, 1)))[-1]
    slab = sample.mask.voxels[:, :, top].sum() * 0.25**2
    assert_allclose(slab, sample.truth.area("base"), rtol=2e-3)


# --- surfaces ------------------------------------------------------------------------------------


def test_distances_at_poles_and_base():
    points = [[0, 0, POLE - 3], [0, 0, POLE - LV_WALL - 4], [RADIUS, 0, 0], [27.0, 0, 30]]
    assert_allclose(NORMAL.distance(points[:1], "lv_endo"), 3, atol=1e-6)
    assert_allclose(NORMAL.distance(points[1:2], "epi"), 4, atol=1e-6)
    assert_allclose(NORMAL.distance(points[2:3], "epi"), LV_WALL, atol=1e-6)
    assert_allclose(NORMAL.distance(points[3:], "base"), 10, atol=1e-6)
    rim = RADIUS * np.sqrt(1 - (BASE / (0.75 * LENGTH)) ** 2)
    assert_allclose(NORMAL.distance([[0, 0, BASE]], "base"), rim, atol=1e-6)
    assert_allclose(NORMAL.distance([[0, 0, 0]], "lv_endo"), RADIUS, atol=1e-6)


@given(heart=HEARTS)
@settings(max_examples=5)
def test_walls_are_as_thick_as_asked_and_nowhere_thinner(heart):
    truth = samples.biv(8.0, **heart).truth
    right, _ = truth.surface(600, "rv_endo")
    left, _ = truth.surface(300, "lv_endo")
    free = truth.distance(right, "epi")
    septal = truth.distance(right, "lv_endo")
    thick = truth.distance(left, "epi")
    for found, asked, share in (
        (free, heart["rv_wall"], 0.3),
        (septal, heart["septum"], 0.15),
        (thick, heart["lv_wall"], 0.3),
    ):
        assert found.min() > asked - 1e-5
        assert np.mean(found < asked + 1e-5) > share, "exactly so over most of that wall"
    assert truth.rv.wall == heart["rv_wall"]
    assert truth.rv.septum == heart["septum"]


@given(heart=HEARTS, seed=st.integers(0, 100))
@settings(max_examples=6)
def test_wall_encloses_two_pools_that_never_touch(heart, seed):
    heart["rv_wall"] = max(heart["rv_wall"], 4.0)
    sample = samples.biv(2.0, rotation=seed, **heart)
    assert ndimage.label(sample.mask.voxels)[1] == 1
    volumes, _ = rooms(sample)
    exact = sorted([sample.truth.cavity_volume, sample.truth.rv.cavity_volume])
    assert_allclose(sorted(volumes[1:]), exact, rtol=0.02)


# --- landmarks -----------------------------------------------------------------------------------


@given(heart=HEARTS, seed=st.integers(0, 100))
@settings(max_examples=5)
def test_landmarks_lie_where_they_should(heart, seed):
    truth = samples.biv(8.0, rotation=seed, **heart).truth
    rv, axis = truth.rv, truth.long_axis
    points, _ = truth.surface(4000, "rv_endo")
    height = (points - truth.apex) @ axis
    assert_allclose(rv.apex_level, heart["rv_apex"], atol=1e-5)
    assert_allclose((rv.apex - truth.apex) @ axis, heart["rv_apex"], atol=1e-5)
    assert heart["rv_apex"] - 1e-6 < height.min() < heart["rv_apex"] + 1.5
    assert truth.distance(rv.apex[None], "rv_endo")[0] < 1e-4
    middle = (rv.apex_level + heart["length"]) / 2
    for landmarks in (rv.insertions, rv.grooves):
        assert_allclose((landmarks - truth.apex) @ axis, middle, atol=1e-5)
    assert truth.distance(rv.insertions, "rv_endo").max() < 1e-5
    assert_allclose(truth.distance(rv.insertions, "lv_endo"), heart["septum"], atol=1e-4)
    assert truth.distance(rv.grooves, "epi").max() < 1e-5
    assert_allclose(truth.distance(rv.grooves, "lv_endo"), heart["lv_wall"], atol=1e-4)
    assert_allclose(truth.distance(truth.apex[None], "lv_endo"), 0, atol=1e-6)
    sine = np.linalg.norm(np.cross(truth.basal_plane[1], axis))
    assert_allclose(sine, np.sin(np.radians(abs(heart["tilt"]))), atol=1e-9)


def test_insertion_angles_span_the_right_pool_at_mid_height(loaded):
    """The crescent's horns are the points of its pool furthest around the long axis."""
    sample = loaded["biv"]
    truth, mask = sample.truth, sample.mask
    rv, axis = truth.rv, truth.long_axis
    points, _ = truth.surface(200_000, "rv_endo")
    middle = (rv.insertions[0] - truth.apex) @ axis
    level = points[np.abs((points - truth.apex) @ axis - middle) < 0.5]
    aside = np.cross(axis, rv.towards)
    angle = np.arctan2((level - truth.apex) @ aside, (level - truth.apex) @ rv.towards)
    assert_allclose([angle.min(), angle.max()], rv.insertion_angles, atol=0.03)
    assert (np.abs(rv.groove_angles) > np.abs(rv.insertion_angles)).all()
    assert mask.voxels[
        tuple(np.round(mask.to_index(rv.insertions - 2 * rv.towards)).astype(int).T)
    ].all()


def test_larger_right_ventricles_are_larger():
    volumes = [samples.biv(8.0, rv_size=s).truth.rv.cavity_volume for s in (0.8, 1.0, 1.2)]
    assert volumes[0] < volumes[1] < volumes[2]
    left = [samples.biv(8.0, rv_size=s).truth.cavity_volume for s in (0.8, 1.2)]
    assert left[0] == left[1]
