from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import heartgen
from heartgen.anatomy import BasalSurface, Plane, analyze
from heartgen.anatomy.basal_surface import HIGHEST, fit_basal_surface
from heartgen.errors import InputError

LENGTH, RADIUS = 90.0, 30.0
TURN = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
PLANE = Plane(np.array([10.0, -20.0, 30.0]), TURN[2])


def world(x, y, z):
    return PLANE.origin + np.stack(np.broadcast_arrays(x, y, z), -1) @ TURN


def ring(height, n=72):
    angle = 2 * np.pi * np.arange(n) / n
    return world(RADIUS * np.cos(angle), RADIUS * np.sin(angle), height(angle))


def test_flat_rim_makes_the_plane():
    basal_surface = fit_basal_surface(PLANE, ring(lambda a: 0 * a), LENGTH)
    points = world(*np.random.default_rng(1).uniform(-28, 28, (3, 200)))
    assert basal_surface.height(points) == pytest.approx(PLANE.height(points), abs=1e-9)


def test_sheet_follows_a_smooth_rim_and_no_noise():
    noise = np.random.default_rng(2).normal(0, 1, 72)
    rim = ring(lambda a: 5 * np.cos(2 * a))
    basal_surface = fit_basal_surface(PLANE, ring(lambda a: 5 * np.cos(2 * a) + noise), LENGTH)
    off = basal_surface.height(rim)
    assert np.sqrt(np.mean(off**2)) < 0.8
    assert np.sqrt(np.mean(PLANE.height(rim) ** 2)) > 3


def test_height_is_along_the_normal_and_shifts_with_the_sheet():
    basal_surface = fit_basal_surface(
        PLANE, ring(lambda a: 4 * np.sin(a) + 3 * np.cos(3 * a)), LENGTH
    )
    points = world(*np.random.default_rng(3).uniform(-30, 30, (3, 100)))
    lifted = points + 7 * PLANE.normal
    assert basal_surface.height(lifted) == pytest.approx(basal_surface.height(points) + 7)
    assert basal_surface.shifted(-2).height(points) == pytest.approx(
        basal_surface.height(points) + 2
    )


def test_sheet_moves_with_the_heart():
    rim = ring(lambda a: 4 * np.sin(a) + 3 * np.cos(2 * a))
    turn = Rotation.from_euler("xyz", [2.0, 0.3, -0.7]).as_matrix()
    moved = Plane(turn @ PLANE.origin, turn @ PLANE.normal)
    points = world(*np.random.default_rng(4).uniform(-28, 28, (3, 100)))
    one = fit_basal_surface(PLANE, rim, LENGTH).height(points)
    other = fit_basal_surface(moved, rim @ turn.T, LENGTH).height(points @ turn.T)
    assert other == pytest.approx(one, abs=0.02)


def test_outflow_tract_is_passed_through():
    tube = ring(lambda a: np.where(np.abs(a - np.pi) < 0.5, 40.0, 0.0))
    basal_surface = fit_basal_surface(PLANE, tube, LENGTH)
    over = PLANE.height(tube) - basal_surface.height(tube)
    assert over.max() < HIGHEST * LENGTH + 1


@pytest.mark.slow
def test_valves_end_the_mesh_on_a_sheet_or_on_a_plane():
    mask = heartgen.samples.load("valves").mask
    rim, plane = analyze(mask), analyze(mask, follow_rim=False)
    assert isinstance(rim.base.surface, BasalSurface)
    assert plane.base.surface is plane.base.plane
    assert rim.base.truncation < plane.base.truncation
    assert rim.wall_volume > plane.wall_volume
    with pytest.raises(InputError, match="rim or plane"):
        heartgen.Options(base="valves")


@pytest.mark.slow
def test_less_of_a_heart_with_valves_is_lost(shared_data: Path) -> None:
    mask = heartgen.read_mask(shared_data / "biv" / "bivme_patient1_f00_valves.nii.gz")
    rim, plane = analyze(mask), analyze(mask, follow_rim=False)
    held = mask.voxels.sum() * np.prod(mask.spacing)
    assert rim.wall_volume > 0.95 * held > plane.wall_volume
