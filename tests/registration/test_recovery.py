"""Registration finds again what is known: a heart that was deformed by a formula.

The patient is the template, half a hollow ball, moved by a smooth map that can be inverted. How
surfaces slide along themselves cannot be seen: they have to come to lie on each other, and the map
throughout the wall has to be the known one but for that.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from benchmarks.solids import ellipsoid
from heartgen.errors import RegistrationError
from heartgen.images.levelset import LevelSet
from heartgen.mesh import HexMesh
from heartgen.mesh.surface_faces import sample_faces
from heartgen.registration import Deformation, register

INNER, OUTER = 20.0, 30.0
"""Radii of the half ball, mm."""

VOXEL = 1.0
LENGTH = 75.0
"""Voxel size, and the length for which a level means as many voxels, mm."""

ROOM = 14
"""Voxels around the half ball: more than any map moves it."""

Map = Callable[[np.ndarray], np.ndarray]

SURFACES: dict[str, Map] = {
    "lv_endo": lambda x: np.linalg.norm(x, axis=1) - INNER,
    "epi": lambda x: np.linalg.norm(x, axis=1) - OUTER,
    "base": lambda x: x[:, 2],
}
"""Signed distance to each surface of the template, mm."""


def bend(x: np.ndarray, sign: float = 1.0) -> np.ndarray:
    """Push sections sideways by up to 4 mm; with -1, back."""
    return x + sign * 4.0 * np.sin(x[:, 2:] / 15) * [0.8, 0.6, 0.0]


def swell(x: np.ndarray, sign: float = 1.0) -> np.ndarray:
    """Lift and lower columns by up to 3 mm; with -1, back."""
    return x + sign * 3.0 * np.cos(x[:, :1] / 14) * [0.0, 0.0, 1.0]


SHIFT = np.array([3.0, -2.0, 4.0])
STRETCH = np.array([1.15, 0.9, 1.1])

MAPS: dict[str, tuple[Map, Map]] = {
    "shift": (lambda x: x + SHIFT, lambda x: x - SHIFT),
    "stretch": (lambda x: x * STRETCH, lambda x: x / STRETCH),
    "bend": (bend, lambda x: bend(x, -1)),
    "bend and swell": (lambda x: swell(bend(x)), lambda x: bend(swell(x, -1), -1)),
}
"""Maps and their inverses. (A half ball that is turned hardly shows it.)"""

CLOSE = 0.05
"""Mean distance of surfaces that were found, mm: a twentieth of a voxel."""

FOUND = 0.25
"""Share of a map that may be missed throughout the wall: what slides along the surfaces."""


@pytest.fixture(scope="module")
def template() -> HexMesh:
    return ellipsoid(INNER, INNER, OUTER - INNER, 0.0, (1, 12, 6))


def patient(back: Map) -> dict[str, LevelSet]:
    """Distances, to first order, to the surfaces of the template moved by the inverse of a map."""
    low, high = -OUTER - ROOM, OUTER + ROOM
    axis = np.arange(low, high + VOXEL, VOXEL)
    affine = np.diag([VOXEL, VOXEL, VOXEL, 1.0])
    affine[:3, 3] = low
    grid = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), -1).reshape(-1, 3)
    places, h = back(grid), 1e-4
    images = {}
    for name, height in SURFACES.items():
        value = height(places)
        slopes = [(height(back(grid + h * e)) - value) / h for e in np.eye(3)]
        distance = value / np.linalg.norm(slopes, axis=0)
        images[name] = LevelSet(distance.reshape(3 * [len(axis)]).astype(np.float32), affine)
    return images


def found(template: HexMesh, back: Map, lod: int) -> tuple[Deformation, ...]:
    return register(template, patient(back), np.eye(4), VOXEL, LENGTH, lod)


def apart(template: HexMesh, move: Map, back: Map) -> float:
    """Mean distance of the template's surfaces, moved, from the patient's, mm."""
    total = area = 0.0
    for name, height in SURFACES.items():
        points, _, areas = sample_faces(template, template.topology.surfaces[name], 6)
        total += float(areas @ np.abs(height(back(move(points)))))
        area += float(areas.sum())
    return total / area


def inside(template: HexMesh) -> np.ndarray:
    """Points throughout the wall."""
    xi = np.random.default_rng(0).random((20, 3))
    return template.evaluate(xi).reshape(-1, 3)


def test_nothing_is_moved_where_nothing_moved(template: HexMesh) -> None:
    (deformation,) = found(template, lambda x: x, lod=1)
    points = inside(template)
    assert np.abs(deformation(points) - points).max() < 0.02


@pytest.mark.slow
@pytest.mark.parametrize("name", MAPS)
def test_known_maps_are_found(template: HexMesh, name: str) -> None:
    move, back = MAPS[name]
    (deformation,) = found(template, back, lod=1)
    assert apart(template, lambda x: x, back) > 20 * CLOSE
    assert apart(template, deformation, back) < CLOSE
    assert deformation.least_determinant() > 0
    points = inside(template)
    off = np.linalg.norm(deformation(points) - move(points), axis=1)
    moved = np.linalg.norm(move(points) - points, axis=1)
    assert off.mean() < FOUND * moved.mean()


@pytest.mark.slow
def test_finer_levels_come_closer(template: HexMesh) -> None:
    _, back = MAPS["bend and swell"]
    first, second, third = (apart(template, part, back) for part in found(template, back, lod=3))
    assert third < 0.8 * second < 0.8 * first


def test_the_other_way_is_far_off(template: HexMesh) -> None:
    """The deformation takes the template to the patient, not the patient to the template."""
    move, back = MAPS["bend"]
    (deformation,) = found(template, move, lod=1)
    assert apart(template, deformation, move) < CLOSE
    assert apart(template, deformation, back) > 20 * CLOSE


@pytest.mark.parametrize("lod", [0, 6])
def test_levels_that_do_not_exist_are_refused(template: HexMesh, lod: int) -> None:
    with pytest.raises(RegistrationError, match=f"level of detail {lod} does not exist"):
        found(template, lambda x: x, lod)
