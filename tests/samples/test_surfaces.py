from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial import KDTree

from heartgen import samples

pytestmark = pytest.mark.slow

SURFACES = ("endo", "epi", "base")
PARTS = [
    (name, part)
    for count, parts in ((1, SURFACES), (2, ("lv_endo", "rv_endo", "epi", "base")))
    for name in samples.names(count)
    for part in parts
]


@pytest.mark.parametrize("name", ["ideal", "lifelike", "valves"])
def test_surface_and_volumes_obey_the_divergence_theorem(name, loaded):
    """Flux of x through the outside of the wall, with normals fitted to neighboring samples."""
    truth = loaded[name].truth
    flux = 0.0
    for surface in SURFACES:
        points, weights = truth.surface(40_000, surface)
        _, near = KDTree(points).query(points, k=12)
        patches = points[near] - points[near].mean(axis=1, keepdims=True)
        normals = np.linalg.svd(patches, full_matrices=False)[2][:, -1]
        outward = {
            "endo": np.array([0.0, 0.0, -10.0]) - points,
            "epi": points - [0.0, 0.0, -10.0],
            "base": np.broadcast_to([0.0, 0.0, 1.0], points.shape),
        }[surface]
        normals *= np.sign(np.einsum("nx,nx->n", normals, outward))[:, None]
        flux += weights @ np.einsum("nx,nx->n", points, normals) / 3
    assert_allclose(flux, truth.wall_volume, rtol=2e-3)


@pytest.mark.parametrize(
    ("name", "surface"), [*PARTS, *((name, "all") for name in samples.names())]
)
def test_surface_weights_are_even_and_sum_to_the_area(name, surface, loaded):
    truth = loaded[name].truth
    points, weights = truth.surface(5001, surface)
    assert points.shape == (5001, 3)
    assert weights.shape == (5001,)
    assert_allclose(weights.sum(), truth.area(surface), rtol=1e-9)
    assert weights.max() < 4 * weights.min()


@pytest.mark.parametrize(("name", "surface"), PARTS)
def test_distance_is_zero_on_the_surface_itself(name, surface, loaded):
    truth = loaded[name].truth
    points, _ = truth.surface(3000, surface)
    assert truth.distance(points, surface).max() < 1e-6
    assert truth.distance(points).max() < 1e-6


@pytest.mark.parametrize(
    ("name", "surface"),
    [(name, part) for name, part in PARTS if name in ("valves", "biv", "thick_lv")],
)
def test_distance_agrees_with_a_dense_cloud(name, surface, loaded):
    truth = loaded[name].truth
    probe = np.random.default_rng(3).uniform([-75, -45, -80], [45, 45, 40], (800, 3))
    cloud, weights = truth.surface(150_000, surface)
    nearest = KDTree(cloud).query(probe)[0]
    found = truth.distance(probe, surface)
    assert (found <= nearest + 1e-5).all(), "no point of the surface is closer"
    gap = np.sqrt(weights.max())
    assert (nearest - found < gap).all()
    assert np.median(nearest - found) < gap / 10


@pytest.mark.parametrize("name", ["lifelike", "biv_tilted"])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_distance_is_one_lipschitz(name, loaded, seed):
    rng = np.random.default_rng(seed)
    p = loaded[name].truth.apex + rng.uniform(-90, 90, (50, 3))
    q = p + rng.normal(0, 3, p.shape)
    truth = loaded[name].truth
    change = np.abs(truth.distance(p) - truth.distance(q))
    assert (change <= np.linalg.norm(p - q, axis=1) + 1e-3).all()


@pytest.mark.parametrize("name", ["ideal", "valves", "biv_tilted"])
def test_rims_are_where_the_surfaces_meet_the_base(name, loaded):
    truth = loaded[name].truth
    for rim, surface in zip(truth.rims, truth.shape.surfaces, strict=False):
        assert truth.distance(rim, surface).max() < 1e-6
        assert truth.distance(rim, "base").max() < 1e-6


@pytest.mark.parametrize("name", ["valves", "biv"])
def test_truth_can_be_sent_to_another_process(name, loaded):
    truth = loaded[name].truth
    probe, _ = truth.surface(20)
    expected = truth.distance(probe + 1.0)
    sent = pickle.loads(pickle.dumps(truth))
    assert_array_equal(sent.distance(probe + 1.0), expected)


def test_one_ventricle_answers_to_the_names_of_the_mesh(loaded):
    truth = loaded["lifelike"].truth
    assert truth.area("lv_endo") == truth.area("endo")
    assert_array_equal(truth.distance([[0, 0, 0]], "lv_endo"), truth.distance([[0, 0, 0]], "endo"))
