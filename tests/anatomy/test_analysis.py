"""The shape analysis finds what the phantoms were made with, or says what is wrong."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.anatomy.hull import convex_hull
from heartgen.errors import AnatomyError
from heartgen.images import Mask
from heartgen.images.levelset import signed_distance


@pytest.mark.slow
@settings(max_examples=8)
@given(seed=st.integers(0, 1000), spacing=st.sampled_from([1.5, 2.0]))
def test_cup_in_any_orientation(seed: int, spacing: float) -> None:
    sample = samples.ideal_cup(spacing, rotation=seed)
    found = analyze(sample.mask)
    center, normal = sample.truth.basal_plane
    assert np.degrees(np.arccos(min(1.0, float(found.frame[:3, 2] @ normal)))) < 3
    assert abs(found.base.plane.height(center[None])[0]) < 0.5 * spacing
    assert found.length == pytest.approx(80, abs=1.2 * spacing)
    assert found.wall_thickness == pytest.approx(10, abs=0.6 * spacing)
    assert found.pool_volume == pytest.approx(sample.truth.cavity_volume, rel=0.03)
    assert found.wall_volume == pytest.approx(sample.truth.wall_volume, rel=0.03)
    assert found.base.truncation is None


def test_tilted_base_is_found() -> None:
    sample = samples.load("tilted")
    found = analyze(sample.mask)
    _, normal = sample.truth.basal_plane
    assert np.degrees(np.arccos(float(found.frame[:3, 2] @ normal))) < 3


def test_frame_is_right_handed_and_orthonormal() -> None:
    axes = analyze(samples.lifelike_lv(2.0, rotation=3).mask).frame[:3, :3]
    assert np.abs(axes.T @ axes - np.eye(3)).max() < 1e-12
    assert np.linalg.det(axes) == pytest.approx(1)


def block(*shape: int) -> np.ndarray:
    """An empty image."""
    return np.zeros(shape, dtype=bool)


def ball(radius: float, inner: float = 0.0) -> np.ndarray:
    """A ball, or a closed shell."""
    grid = np.stack(np.meshgrid(*[np.arange(50.0)] * 3, indexing="ij"), -1) - 24.5
    r = np.linalg.norm(grid, axis=-1)
    return np.asarray((r < radius) & (r >= inner))


def two_cups() -> np.ndarray:
    """Two ventricles side by side in one wall."""
    out = block(90, 50, 50)
    out[5:85, 5:45, 5:45] = True
    out[12:40, 12:38, 12:45] = False
    out[50:78, 12:38, 12:45] = False
    return out


def plate() -> np.ndarray:
    """A plate one voxel thick."""
    out = block(30, 30, 30)
    out[5:25, 5:25, 15] = True
    return out


@pytest.mark.parametrize(
    ("voxels", "words"),
    [
        (ball(20), "filled body"),
        (ball(20, 12), "no opening"),
        (two_cups(), "two blood pools"),
        (plate(), "flat"),
    ],
)
def test_what_is_no_left_ventricle_is_named(voxels: np.ndarray, words: str) -> None:
    with pytest.raises(AnatomyError, match=words):
        analyze(Mask(voxels, np.eye(4)), ventricles="lv")


def test_pin_hole_is_closed_and_reported() -> None:
    sample = samples.ideal_cup(1.5)
    voxels = sample.mask.voxels.copy()
    apex = sample.mask.to_index(sample.truth.apex[None])[0].round().astype(int)
    axis = int(np.argmax(np.abs(sample.truth.basal_plane[1] @ sample.mask.affine[:3, :3])))
    tunnel = [slice(a, a + 1) for a in apex]
    tunnel[axis] = slice(None)
    column = voxels[tuple(tunnel)].copy()
    voxels[tuple(tunnel)] = False
    assert column.any()
    found = analyze(Mask(voxels, sample.mask.affine))
    assert "leaks" in {f.check for f in found.findings}
    assert found.length == pytest.approx(80, abs=2.5)


def test_a_missing_apex_is_told_with_size_and_place() -> None:
    sample = samples.ideal_cup(1.5)
    voxels, up = sample.mask.voxels.copy(), sample.truth.basal_plane[1]
    height = (sample.mask.to_world(np.argwhere(voxels).astype(float)) - sample.truth.apex) @ up
    lowest = np.argwhere(voxels)[height < 14]  # the endocardium ends 10 mm above the epicardium
    voxels[tuple(lowest.T)] = False
    found = analyze(Mask(voxels, sample.mask.affine))
    (told,) = [f for f in found.findings if f.check == "leaks" and f.serious]
    assert "open over" in told.message
    assert "below the base" in told.message


@pytest.mark.slow
@settings(max_examples=20)
@given(st.integers(0, 1000))
def test_convex_hull_agrees_with_half_spaces(seed: int) -> None:
    rng = np.random.default_rng(seed)
    voxels = rng.random((12, 14, 9)) < 0.02
    voxels[[2, 9, 4, 5], [2, 3, 11, 6], [1, 2, 3, 7]] = True
    hull = convex_hull(voxels)
    assert (hull >= voxels).all()
    from scipy.spatial import Delaunay

    points = np.argwhere(voxels)
    inside = Delaunay(points).find_simplex(np.argwhere(np.ones_like(voxels)), tol=1e-6) >= 0
    assert (hull.ravel() == inside).mean() > 0.998


def test_signed_distance_of_a_ball() -> None:
    spacing = np.array([0.8, 1.0, 1.3])
    affine = np.diag([*spacing, 1.0])
    grid = np.stack(np.meshgrid(*[np.arange(n) for n in (70, 60, 50)], indexing="ij"), -1) * spacing
    center = np.array([27.3, 29.1, 31.7])
    r = np.linalg.norm(grid - center, axis=-1)
    level = signed_distance(r < 18, affine)
    near = np.abs(r - 18) < 5
    assert np.abs(level.values - (r - 18))[near].mean() < 0.15
    points = center + 16 * np.array([[1.0, 0, 0], [0, -1, 0], [0.6, 0, 0.8]])
    value, slope = level.sample(points)
    assert np.abs(value + 2).max() < 0.4
    assert (np.einsum("nx,nx->n", slope, (points - center) / 16) > 0.95).all()


def test_distance_continues_outside_the_grid() -> None:
    level = signed_distance(ball(15), np.eye(4))
    value, slope = level.sample(np.array([[24.5, 24.5, 90.0]]))
    assert value[0] == pytest.approx(90 - 24.5 - 15, abs=0.5)
    assert slope[0] @ [0, 0, 1] > 0.9


def test_tube_open_at_both_ends_is_refused() -> None:
    grid = np.stack(np.meshgrid(*[np.arange(60.0)] * 3, indexing="ij"), -1) - 29.5
    r = np.linalg.norm(grid[..., :2], axis=-1)
    tube = (r < 24) & (r > 15) & (np.abs(grid[..., 2]) < 26)
    with pytest.raises(AnatomyError, match="open at both ends"):
        analyze(Mask(tube, np.eye(4)))


@pytest.mark.slow
def test_papillary_muscles_belong_to_the_pool() -> None:
    sample = samples.load("papillary")
    found = analyze(sample.mask)
    assert found.pool_volume == pytest.approx(sample.truth.cavity_volume, rel=0.04)
    clean = analyze(samples.load("lifelike").mask)
    assert "papillary muscles" not in {f.check for f in clean.findings}
