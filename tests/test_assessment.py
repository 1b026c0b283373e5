"""The error is the distance: meshes against masks of the same heart, shifted or grown as told.

The heart is half a hollow ball, the base a flat ring at its equator: of every point its distance to
that is known, and so are the means over a heart that was shifted or has grown.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from benchmarks.solids import ellipsoid
from heartgen import samples
from heartgen.assessment import Accuracy, assess_accuracy, mean_error
from heartgen.images.isosurface import Isosurface, isosurface
from heartgen.images.levelset import LevelSet, signed_distance
from heartgen.mesh import HexMesh

VOXEL = 1.0
"""Voxel size of the masks, mm."""

WITHIN = {"exact": 0.03, "mask": 0.1}
"""What a mean distance may be off, mm: against the exact level function on a grid of such voxels,
the rims of which triangles round, and against what is made of voxels, a tenth of one."""

ROOM = 8
"""Voxels around a heart."""

GROWTH, SHIFT = 2.0, 3.0
"""How far surfaces are moved, mm."""


@dataclass(frozen=True)
class HalfBall:
    """Half of a hollow ball below z = 0, moved.

    Attributes
    ----------
    inner, outer : float
        Radii, mm.
    place : (3,) tuple
        The ball's center, mm.
    """

    inner: float = 20.0
    outer: float = 30.0
    place: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def areas(self) -> np.ndarray:
        """Areas of endocardium, epicardium and base, (3,), mm^2."""
        caps = 2 * np.pi * np.array([self.inner, self.outer]) ** 2
        return np.append(caps, np.pi * (self.outer**2 - self.inner**2))

    @property
    def volume(self) -> float:
        """Volume of the wall, mm^3."""
        return 2 / 3 * np.pi * (self.outer**3 - self.inner**3)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Distance of points (n, 3) to the nearest of the three surfaces, (n,), mm."""
        x, y, z = (points - self.place).T
        ring = np.hypot(x, y)
        base = np.hypot(np.clip(ring, self.inner, self.outer) - ring, z)
        caps = [
            np.where(z < 0, np.abs(np.hypot(ring, z) - r), np.hypot(ring - r, z))
            for r in (self.inner, self.outer)
        ]
        return np.min([*caps, base], axis=0)

    def points(self, n: int = 40_000) -> tuple[np.ndarray, np.ndarray]:
        """Points of the surfaces (3 n, 3), mm, on a golden spiral, and their areas (3 n,), mm^2."""
        share = (np.arange(n) + 0.5) / n
        turn = np.pi * (3 - np.sqrt(5)) * np.arange(n)
        circle = np.stack([np.cos(turn), np.sin(turn)], -1)
        cap = np.column_stack([np.sqrt(1 - share**2)[:, None] * circle, -share])
        ring = np.sqrt(self.inner**2 + share * (self.outer**2 - self.inner**2))
        base = np.column_stack([ring[:, None] * circle, np.zeros(n)])
        found = np.concatenate([self.inner * cap, self.outer * cap, base]) + self.place
        return found, np.repeat(self.areas / n, n)

    def mean_distance_to(self, other: HalfBall) -> float:
        """Mean distance from these surfaces to the others, mm."""
        points, areas = self.points()
        return float(np.average(other.distance(points), weights=areas))

    def level(self, kind: str) -> LevelSet:
        """Its level function: exact, or what heartgen makes of the voxels of it."""
        if kind == "mask":
            mask = samples.ideal_cup(
                VOXEL,
                radius=self.inner,
                length=self.inner,
                wall=self.outer - self.inner,
                base_height=0.0,
                translation=self.place,
            ).mask
            return signed_distance(np.pad(mask.voxels, ROOM), _moved(mask.affine, -ROOM))
        n = int(2 * self.outer / VOXEL) + 2 * ROOM
        affine = _moved(np.diag([VOXEL, VOXEL, VOXEL, 1.0]), -n / 2 + 0.3)
        affine[:3, 3] += self.place
        index = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), -1).reshape(-1, 3)
        points = index @ affine[:3, :3].T + affine[:3, 3]
        ring = np.linalg.norm(points - self.place, axis=1)
        wall = (ring > self.inner) & (ring < self.outer) & (points[:, 2] < self.place[2])
        values = np.where(wall, -1, 1) * self.distance(points)
        return LevelSet(values.reshape(n, n, n).astype(np.float32), affine)


def _moved(affine: np.ndarray, voxels: float) -> np.ndarray:
    """The same grid, begun so many voxels later along each axis."""
    moved = affine.copy()
    moved[:3, 3] += affine[:3, :3] @ np.full(3, voxels)
    return moved


HEART = HalfBall()


@pytest.fixture(scope="module")
def mesh() -> HexMesh:
    """The heart as a mesh."""
    return ellipsoid(HEART.inner, HEART.inner, HEART.outer - HEART.inner, 0.0, (1, 12, 6))


def judged(mesh: HexMesh, patient: HalfBall, kind: str = "exact") -> Accuracy:
    """The mesh against another half ball."""
    return assess_accuracy(mesh, patient.level(kind), patient.volume)


def test_the_reference_is_right_where_it_is_known_by_heart() -> None:
    points, areas = HEART.points()
    assert HEART.distance(points).max() < 1e-12
    assert areas.sum() == pytest.approx(HEART.areas.sum())
    known = [[0, 0, 0], [0, 0, -35], [0, 25, 1], [33, 0, 4], [0, 0, -23], [0, 22, -1]]
    expected = [20, 5, 1, 5, 3, 1]
    np.testing.assert_allclose(HEART.distance(np.array(known, dtype=float)), expected)


@pytest.mark.parametrize("kind", WITHIN)
def test_a_mesh_on_its_own_mask_has_no_error(mesh: HexMesh, kind: str) -> None:
    found = judged(mesh, HEART, kind)
    assert found.mean < WITHIN[kind]
    assert found.reverse_mean < WITHIN[kind]
    assert found.dice == pytest.approx(1, abs=0.01)


@pytest.mark.slow
@pytest.mark.parametrize("kind", WITHIN)
@pytest.mark.parametrize("direction", [(0, 0, 1), (0, 0, -1), (1, 0, 0), (-0.48, 0.6, 0.64)])
def test_error_of_a_shifted_heart(mesh: HexMesh, direction: tuple[float, ...], kind: str) -> None:
    x, y, z = SHIFT * np.array(direction)
    shifted = HalfBall(place=(float(x), float(y), float(z)))
    found = judged(mesh, shifted, kind)
    there, back = shifted.mean_distance_to(HEART), HEART.mean_distance_to(shifted)
    assert found.mean == pytest.approx(there, abs=WITHIN[kind])
    assert found.reverse_mean == pytest.approx(back, abs=WITHIN[kind])
    assert found.symmetric_mean == pytest.approx((there + back) / 2, abs=WITHIN[kind])
    # Along any direction the normals of a half ball are a half in the mean, those of its base
    # all or nothing.
    first_order = SHIFT * HEART.areas @ [0.5, 0.5, abs(direction[2])] / HEART.areas.sum()
    assert (there + back) / 2 == pytest.approx(first_order, rel=0.1)


@pytest.mark.parametrize("kind", WITHIN)
def test_error_of_a_grown_heart(mesh: HexMesh, kind: str) -> None:
    d, r, R = GROWTH, HEART.inner, HEART.outer
    grown = HalfBall(r - d, R + d)
    found = judged(mesh, grown, kind)
    # Both caps are off by d. Of the wider ring that is its base, only the new edges lie beside;
    # and from the mesh, what is less than d below that base is nearer to it than to the caps.
    rims = np.pi * d**2 * (r + R)
    there = (grown.areas[:2].sum() * d + rims) / grown.areas.sum()
    assert found.mean == pytest.approx(there, abs=WITHIN[kind])
    back = (HEART.areas[:2].sum() * d - rims) / HEART.areas.sum()
    assert found.reverse_mean == pytest.approx(back, abs=WITHIN[kind])
    assert found.p95 == pytest.approx(d, abs=3 * WITHIN[kind])
    assert found.reverse_p95 == pytest.approx(d, abs=3 * WITHIN[kind])
    assert found.dice == pytest.approx(2 * HEART.volume / (HEART.volume + grown.volume), abs=0.01)


def test_error_of_a_shrunken_heart_is_one_in_both_directions(mesh: HexMesh) -> None:
    """Its rims lie on the base of the mesh, but those of the mesh beside its own."""
    shrunken = HalfBall(HEART.inner + GROWTH, HEART.outer - GROWTH)
    found = judged(mesh, shrunken)
    there = shrunken.mean_distance_to(HEART)
    assert found.mean == pytest.approx(there, abs=WITHIN["exact"])
    back = HEART.mean_distance_to(shrunken)
    assert found.reverse_mean == pytest.approx(back, abs=WITHIN["exact"])
    assert found.symmetric_mean == pytest.approx((found.mean + found.reverse_mean) / 2)


@pytest.mark.parametrize(("name", "other"), [("epi", "lv_endo"), ("lv_endo", "epi")])
def test_error_is_told_of_the_surface_that_has_it(mesh: HexMesh, name: str, other: str) -> None:
    thick = {"epi": HalfBall(outer=HEART.outer + GROWTH), "lv_endo": HalfBall(HEART.inner - GROWTH)}
    found = judged(mesh, thick[name]).by_surface
    assert set(found) == {"epi", "lv_endo", "base"}
    assert found[name] == pytest.approx(GROWTH, abs=0.1)  # less at the rim
    assert found[other] < WITHIN["exact"]


def test_each_figure_is_of_its_own_surface(mesh: HexMesh) -> None:
    """The error is that to the outline; what is given and what is raw have errors of their own."""
    mild, strong = (
        HalfBall(HEART.inner - d, HEART.outer + d).level("exact") for d in (GROWTH / 2, GROWTH)
    )
    own = HEART.level("exact")
    found = assess_accuracy(mesh, own, HEART.volume, isosurface(mild), isosurface(strong))
    assert 0 < found.mean == pytest.approx(mean_error(mesh, isosurface(mild)))
    assert found.as_given == pytest.approx(mean_error(mesh, isosurface(strong)))
    assert found.mean < 0.6 * found.as_given
    assert found.reverse_mean < WITHIN["exact"]
    assert found.raw_mean is None
    again = assess_accuracy(mesh, own, HEART.volume, raw=mild)
    assert again.mean < WITHIN["exact"]
    assert again.raw_mean == found.mean
    assert again.as_given is None


def test_errors_are_means_over_areas_not_over_points(mesh: HexMesh) -> None:
    """Where a surface has more points or more elements, it does not count more."""
    thick = HalfBall(outer=HEART.outer + GROWTH)
    level = thick.level("exact")
    surface = isosurface(level)
    far = np.argsort(surface.points[:, 2])  # a copy of the lower half, of no weight
    twice = far[: len(far) // 2]
    padded = Isosurface(
        np.concatenate([surface.points, surface.points[twice]]),
        surface.triangles,
        np.concatenate([surface.weights, np.zeros(len(twice))]),
        np.concatenate([surface.normals, surface.normals[twice]]),
    )
    assert mean_error(mesh, padded) == pytest.approx(mean_error(mesh, surface), rel=1e-9)
    uneven = mesh.refined(longitudinal=3)
    one, other = (assess_accuracy(m, level, thick.volume) for m in (mesh, uneven))
    assert other.mean == pytest.approx(one.mean, rel=1e-6)
    back = HEART.mean_distance_to(thick)
    assert one.reverse_mean == pytest.approx(back, abs=WITHIN["exact"])
    assert other.reverse_mean == pytest.approx(back, abs=WITHIN["exact"])
