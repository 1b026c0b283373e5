from __future__ import annotations

import itertools
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal
from scipy import integrate, ndimage
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from heartgen import samples
from heartgen.errors import InputError

RADIUS, LENGTH, WALL, BASE = 22.0, 60.0, 10.0, 20.0
SURFACES = ("endo", "epi", "base")
SIGNED_PERMUTATIONS = [
    np.diag(signs)[:, order]
    for order in itertools.permutations(range(3))
    for signs in itertools.product((1.0, -1.0), repeat=3)
]


@pytest.fixture(scope="module")
def loaded():
    return {name: samples.load(name) for name in samples.names()}


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


def wall_points(sample):
    """World coordinates of the voxels of the mask, sorted."""
    points = sample.mask.to_world(np.argwhere(sample.mask.voxels).astype(float))
    return np.unique(np.round(points, 6) + 0.0, axis=0)


# --- volumes and areas ---------------------------------------------------------------------------


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


@pytest.mark.parametrize("make", [samples.ideal_cup, samples.lifelike_lv])
def test_voxel_volume_converges_to_the_truth(make):
    error = []
    for spacing in (4.0, 2.0, 1.0):
        poses = [make(spacing, rotation=seed, translation=(0.3, seed, 0.1)) for seed in range(4)]
        ratio = [s.mask.volume / s.truth.wall_volume for s in poses]
        error.append(np.sqrt(np.mean(np.square(np.array(ratio) - 1))))
    assert error[-1] < 5e-4
    assert error[0] / error[-1] > 4, "at least first order in the spacing"


@pytest.mark.parametrize("name", ["ideal", "lifelike", "valves", "tilted"])
def test_named_masks_have_the_true_volume(name, loaded):
    """Also where the base is parallel to the voxel planes: it must fall between two of them."""
    assert_allclose(loaded[name].mask.volume, loaded[name].truth.wall_volume, rtol=1.5e-3)


@pytest.mark.parametrize("name", ["ideal", "lifelike", "tilted"])
def test_cavity_volume_is_that_of_the_voxels_the_wall_and_the_base_enclose(name, loaded):
    mask, truth = loaded[name].mask, loaded[name].truth
    world = mask.to_world(np.argwhere(np.ones_like(mask.voxels)).astype(float))
    centre, normal = truth.basal_plane
    above = ((world - centre) @ normal > 0).reshape(mask.voxels.shape)
    rooms, _ = ndimage.label(~(mask.voxels | above))
    middle = np.round(mask.to_index(((centre + truth.apex) / 2)[None]))[0].astype(int)
    cavity = rooms == rooms[tuple(middle)]
    assert_allclose(cavity.sum() * np.prod(mask.spacing), truth.cavity_volume, rtol=2e-3)


@pytest.mark.parametrize("name", ["ideal", "lifelike", "valves"])
def test_surface_and_volumes_obey_the_divergence_theorem(name, loaded):
    """Flux of x through the outside of the wall, with normals fitted to neighbouring samples."""
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


@pytest.mark.parametrize("name", samples.names())
@pytest.mark.parametrize("surface", ["all", *SURFACES])
def test_surface_weights_are_even_and_sum_to_the_area(name, surface, loaded):
    truth = loaded[name].truth
    points, weights = truth.surface(5001, surface)
    assert points.shape == (5001, 3)
    assert weights.shape == (5001,)
    assert_allclose(weights.sum(), truth.area(surface), rtol=1e-9)
    assert weights.max() < 4 * weights.min()


def test_surface_samples_integrate_functions(loaded):
    """Second moment of the endocardium of the ideal cup about its axis, against quadrature."""
    points, weights = loaded["ideal"].truth.surface(20_000, "endo")

    def ring(polar):
        r = RADIUS * np.sin(polar)
        metric = np.hypot(RADIUS * np.cos(polar), LENGTH * np.sin(polar))
        return 2 * np.pi * r**3 * metric

    exact = integrate.quad(ring, 0, np.arccos(-BASE / LENGTH))[0]
    assert_allclose(weights @ (points[:, 0] ** 2 + points[:, 1] ** 2), exact, rtol=1e-4)
    assert_allclose(weights @ points[:, :2] / weights.sum(), 0, atol=0.01)


# --- distance ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", samples.names())
@pytest.mark.parametrize("surface", SURFACES)
def test_distance_is_zero_on_the_surface_itself(name, surface, loaded):
    truth = loaded[name].truth
    points, _ = truth.surface(3000, surface)
    assert truth.distance(points, surface).max() < 1e-6
    assert truth.distance(points).max() < 1e-6


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


@pytest.mark.parametrize("surface", ["all", *SURFACES])
def test_distance_agrees_with_a_dense_cloud(surface, loaded):
    truth = loaded["valves"].truth
    probe = np.random.default_rng(3).uniform([-45, -45, -80], [45, 45, 40], (800, 3))
    cloud, weights = truth.surface(150_000, surface)
    nearest = KDTree(cloud).query(probe)[0]
    found = truth.distance(probe, surface)
    assert (found <= nearest + 1e-5).all(), "no point of the surface is closer"
    gap = np.sqrt(weights.max())
    assert (nearest - found < gap).all()
    assert np.median(nearest - found) < gap / 10


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=20)
def test_distance_is_one_lipschitz(seed):
    rng = np.random.default_rng(seed)
    p = rng.uniform(-60, 60, (50, 3))
    q = p + rng.normal(0, 3, p.shape)
    truth = LIFELIKE.truth
    change = np.abs(truth.distance(p) - truth.distance(q))
    assert (change <= np.linalg.norm(p - q, axis=1) + 1e-3).all()


# --- placement -----------------------------------------------------------------------------------


@given(seed=st.integers(0, 1000), scale=st.sampled_from([0.1, 0.3, 1.0, 1.2]))
@settings(max_examples=8)
def test_truth_moves_with_the_heart(seed, scale):
    rotation = Rotation.random(None, np.random.default_rng(seed)).as_matrix()
    shift = np.array([10.0, -20.0, 30.0])
    still = LIFELIKE.truth
    moved = samples.lifelike_lv(
        5.0 * scale, rotation=rotation, translation=shift, scale=scale
    ).truth
    points, weights = still.surface(300)
    there, there_weights = moved.surface(300)
    assert_allclose(there, scale * points @ rotation.T + shift, atol=1e-9)
    assert_allclose(there_weights, scale**2 * weights)
    assert_allclose(moved.wall_volume, scale**3 * still.wall_volume)
    assert_allclose(moved.cavity_volume, scale**3 * still.cavity_volume)
    probe = np.random.default_rng(seed).uniform(-50, 50, (50, 3))
    assert_allclose(
        moved.distance(scale * probe @ rotation.T + shift), scale * still.distance(probe), atol=1e-6
    )
    (centre, normal), (there_centre, there_normal) = still.basal_plane, moved.basal_plane
    assert_allclose(there_centre, scale * rotation @ centre + shift)
    assert_allclose(there_normal, rotation @ normal)
    assert_allclose(moved.apex, scale * rotation @ still.apex + shift)


@pytest.mark.parametrize("direction", SIGNED_PERMUTATIONS[::5])
def test_order_and_sign_of_the_image_axes_do_not_change_the_heart(direction):
    spacing = np.array([2.0, 2.5, 3.0])
    placed = {"rotation": 3, "translation": (5.0, 0.7, -3.0), "papillary": True}
    straight = samples.lifelike_lv(spacing, **placed)
    turned = samples.lifelike_lv(np.abs(direction.T) @ spacing, direction=direction, **placed)
    assert_allclose(turned.mask.affine[:3, :3] / turned.mask.spacing, direction)
    assert_array_equal(wall_points(turned), wall_points(straight))


@pytest.mark.parametrize("name", ["ideal", "lifelike", "valves", "tilted"])
def test_edge_of_the_mask_lies_at_the_true_surface(name, loaded):
    sample = loaded[name]
    voxels = sample.mask.voxels
    assert not voxels[[0, -1]].any()
    assert not voxels[:, [0, -1]].any()
    assert not voxels[:, :, [0, -1]].any()
    edge = voxels & ~ndimage.binary_erosion(voxels)
    world = sample.mask.to_world(np.argwhere(edge).astype(float))
    assert sample.truth.distance(world).max() < sample.mask.spacing.max() + 1e-6


def test_scaled_heart_on_a_scaled_grid_has_the_same_voxels():
    """Human in mm and in cm."""
    small = samples.lifelike_lv(0.2, scale=0.1)
    assert_array_equal(small.mask.voxels, samples.lifelike_lv(2.0).mask.voxels)
    assert_allclose(small.mask.spacing, 0.2)


# --- anatomy -------------------------------------------------------------------------------------


def test_lifelike_wall_tapers_from_base_to_apex(loaded):
    truth = loaded["lifelike"].truth
    endo, _ = truth.surface(4000, "endo")
    thickness = truth.distance(endo, "epi")
    height = endo[:, 2]
    assert 9 < thickness[height > 10].mean() < 11
    assert 4.5 < thickness[height < -55].mean() < 6
    assert thickness.min() > 4


@pytest.mark.parametrize("name", ["ideal", "valves"])
def test_rims_are_where_the_surfaces_meet_the_base(name, loaded):
    truth = loaded[name].truth
    for rim, surface in zip(truth.rims, ("endo", "epi"), strict=True):
        assert rim.shape == (512, 3)
        assert truth.distance(rim, surface).max() < 1e-6
        assert truth.distance(rim, "base").max() < 1e-6
    if name == "ideal":
        radii = [np.linalg.norm(rim[:, :2], axis=1) for rim in truth.rims]
        assert_allclose(radii[0], rim_radius(RADIUS, LENGTH, BASE))
        assert_allclose(radii[1], rim_radius(RADIUS + WALL, LENGTH + WALL, BASE))


def test_basal_plane_and_apex_are_where_the_mask_has_them(loaded):
    for name in ("ideal", "lifelike", "tilted"):
        truth = loaded[name].truth
        centre, normal = truth.basal_plane
        base, _ = truth.surface(500, "base")
        assert np.abs((base - centre) @ normal).max() < 0.05
        assert (truth.apex - centre) @ normal < -75
        assert truth.distance(truth.apex[None], "endo")[0] < 1e-9
    tilt = np.degrees(np.arccos(loaded["lifelike"].truth.basal_plane[1][2]))
    assert 5 < tilt < 12


def test_irregular_rim_rises_and_falls_by_six_millimetres(loaded):
    truth = loaded["valves"].truth
    centre, normal = truth.basal_plane
    base, weights = truth.surface(4000, "base")
    height = (base - centre) @ normal
    assert 5 < height.max() < 6.5
    assert -6.5 < height.min() < -5
    assert abs(weights @ height / weights.sum()) < 0.5


def test_papillary_muscles_stand_free_above_and_merge_below(loaded):
    plain = samples.lifelike_lv().mask
    muscled = samples.lifelike_lv(papillary=True).mask
    assert (muscled.voxels | ~plain.voxels).all(), "the wall itself is untouched"
    muscle = muscled.voxels & ~plain.voxels
    assert ndimage.label(muscle)[1] == 2
    assert ndimage.label(muscled.voxels)[1] == 1

    def pieces(height):
        level = int(np.round(muscled.to_index(np.array([[0.0, 0.0, height]]))[0, 2]))
        return ndimage.label(muscled.voxels[:, :, level])[1]

    assert [pieces(z) for z in (5, -15, -38)] == [1, 3, 1]
    level = int(np.round(muscled.to_index(np.array([[0.0, 0.0, -15.0]]))[0, 2]))
    diameter = 2 * np.sqrt(muscle[:, :, level].sum() / 2 / np.pi)
    assert 7 < diameter < 9.5


def test_trabeculae_are_many_small_ridges_on_the_apical_endocardium(loaded):
    plain = samples.lifelike_lv()
    rough = samples.lifelike_lv(trabeculae=True)
    added = rough.mask.voxels & ~plain.mask.voxels
    assert (rough.mask.voxels | ~plain.mask.voxels).all()
    world = rough.mask.to_world(np.argwhere(added).astype(float))
    assert world[:, 2].max() < -15
    assert rough.truth.distance(world, "endo").max() < 3
    level = added[:, :, int(np.round(rough.mask.to_index(np.array([[0.0, 0.0, -42.0]]))[0, 2]))]
    assert ndimage.label(level, np.ones((3, 3)))[1] >= 8
    assert ndimage.label(rough.mask.voxels)[1] == 1


def test_noise_flips_the_asked_share_of_boundary_voxels_only():
    clean = samples.lifelike_lv(2.0)
    noisy = samples.lifelike_lv(2.0, noise=0.3, seed=5)
    boundary = ndimage.binary_dilation(clean.mask.voxels) & ~ndimage.binary_erosion(
        clean.mask.voxels
    )
    flipped = clean.mask.voxels ^ noisy.mask.voxels
    assert not (flipped & ~boundary).any()
    assert_allclose(flipped.sum() / boundary.sum(), 0.3, atol=0.03)
    assert (noisy.mask.voxels != samples.lifelike_lv(2.0, noise=0.3, seed=6).mask.voxels).any()
    probe, _ = clean.truth.surface(50)
    assert noisy.truth.distance(probe).max() < 1e-6


# --- catalogue and bad input ---------------------------------------------------------------------


def test_named_samples_are_the_same_at_every_call(loaded):
    assert set(samples.names()) == {"ideal", "lifelike", "papillary", "valves", "noisy", "tilted"}
    for name in ("papillary", "noisy", "tilted"):
        first, again = loaded[name], samples.load(name)
        assert_array_equal(again.mask.voxels, first.mask.voxels)
        assert_array_equal(again.mask.affine, first.mask.affine)
        assert_array_equal(again.truth.surface(10)[0], first.truth.surface(10)[0])
    for name, sample in loaded.items():
        assert sample.mask.name == name
        assert sample.description.endswith(".")


def test_truth_can_be_sent_to_another_process(loaded):
    truth = loaded["valves"].truth
    probe, _ = truth.surface(20)
    expected = truth.distance(probe + 1.0)
    sent = pickle.loads(pickle.dumps(truth))
    assert_array_equal(sent.distance(probe + 1.0), expected)


def test_noise_alone_separates_noisy_from_lifelike(loaded):
    assert loaded["noisy"].truth.shape == loaded["lifelike"].truth.shape


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: samples.load("heart"), "choose one of ideal, lifelike"),
        (lambda: samples.ideal_cup(0), "spacing"),
        (lambda: samples.ideal_cup((1, 1)), "spacing"),
        (lambda: samples.ideal_cup(np.nan), "spacing"),
        (lambda: samples.ideal_cup(0.01), "coarser"),
        (lambda: samples.ideal_cup(300.0), "finer"),
        (lambda: samples.ideal_cup(wall=-1), "positive"),
        (lambda: samples.ideal_cup(base_height=60), "base_height"),
        (lambda: samples.ideal_cup(scale=0), "scale"),
        (lambda: samples.ideal_cup(rotation=np.diag([1, 1, -1])), "mirrors"),
        (lambda: samples.ideal_cup(rotation=np.ones((3, 3))), "rotation"),
        (lambda: samples.ideal_cup(direction=np.diag([1, 1, 2])), "direction"),
        (lambda: samples.ideal_cup(translation=(1, 2)), "translation"),
        (lambda: samples.lifelike_lv(noise=1.5), "noise"),
        (lambda: CUP.truth.surface(10, "rv"), "choose all, endo, epi, base"),
        (lambda: CUP.truth.surface(2), "too few"),
        (lambda: CUP.truth.distance([1, 2, 3]), "shape"),
        (lambda: CUP.truth.distance([[1, 2, np.inf]]), "finite"),
    ],
)
def test_bad_input_is_refused_in_one_clear_sentence(call, message):
    with pytest.raises(InputError, match=message):
        call()


CUP = samples.ideal_cup(4.0)
LIFELIKE = samples.lifelike_lv(4.0)
