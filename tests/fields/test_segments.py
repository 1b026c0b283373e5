"""The 17 segments: their sectors, levels and orientation."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.fields import SEGMENTS, HeartAxes, aha_segment, heart_axes
from heartgen.fields.segments import segments_of_elements
from heartgen.mesh import HexMesh
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh

RING = np.radians(np.arange(0.5, 360))
LEVELS = {"basal": (0.85, range(1, 7)), "mid": (0.5, range(7, 13)), "apical": (0.2, range(13, 17))}


def ring(axes, level: float) -> np.ndarray:
    """A point at each degree around the axis, from the septum towards the anterior wall."""
    around = np.cos(RING)[:, None] * axes.septal + np.sin(RING)[:, None] * axes.anterior
    return axes.apex + level * axes.length * axes.longitudinal + 8 * around


@pytest.mark.parametrize("level", LEVELS)
def test_segments_share_each_level_evenly(land: HexMesh, level: str) -> None:
    axes = heart_axes(land)
    height, expected = LEVELS[level]
    found, degrees = np.unique(aha_segment(ring(axes, height), axes), return_counts=True)
    assert found.tolist() == list(expected)
    assert (degrees == 360 // len(expected)).all()


def test_what_lies_below_the_cavity_is_the_apex(land: HexMesh) -> None:
    axes = heart_axes(land)
    assert set(aha_segment(ring(axes, -0.01), axes)) == {17}
    assert set(aha_segment(ring(axes, 0.01), axes)) == {13, 14, 15, 16}


def test_segments_lie_where_their_names_say() -> None:
    """In a chest, from apex to base is right, back and up; the septum to the right and in front."""
    base, apex = np.array([-1.0, 1.0, 1.0]), np.array([0.0, 0.0, 0.0])
    axes = HeartAxes(base, apex, np.array([-1.0, -1.0, 0.0]) / 2**0.5, "given")
    middle = (base + apex) / 2
    side = {
        "septal": axes.septal,
        "anterior": axes.anterior,
        "lateral": -axes.septal,
        "inferior": -axes.anterior,
    }
    assert side["anterior"][1] < 0 < side["anterior"][2]  # towards the front, and up
    assert side["lateral"][0] > 0  # to the left
    for name, direction in side.items():
        nearby = middle + 0.1 * (direction + 0.1 * axes.anterior)
        assert name in SEGMENTS[int(aha_segment(nearby[None], axes)[0])]


@pytest.mark.slow
def test_every_segment_has_elements_of_its_share(land: HexMesh) -> None:
    fine = land.refined(circumferential=4, longitudinal=4, radial=2)
    axes = heart_axes(fine)
    count = np.bincount(segments_of_elements(fine, axes), minlength=18)
    assert count[0] == 0
    assert (count[1:] > 0).all()
    for _, segments in LEVELS.values():
        ones = count[list(segments)]
        assert ones.max() < 1.35 * ones.min()


@pytest.mark.parametrize("name", ["leaning", "biv"])
def test_the_apex_is_a_cap_and_a_wall_has_one_segment(
    name: str, request: pytest.FixtureRequest
) -> None:
    mesh = request.getfixturevalue(name)
    segment, index = segments_of_elements(mesh, heart_axes(mesh)), mesh.topology.index
    wall = np.ones(mesh.n_elements, dtype=bool)
    wall[mesh.topology.parts.get("right ventricle", [])] = False
    cap = index[wall & (segment == 17), 2]
    assert set(index[wall & (index[:, 2] <= cap.max(initial=-1)), 2]) == set(cap)
    assert np.sum(wall & np.isin(index[:, 2], cap)) == len(cap)
    for column, row in np.unique(index[wall, 1:], axis=0):
        assert len(set(segment[wall & (index[:, 1] == column) & (index[:, 2] == row)])) == 1


@pytest.fixture(scope="module")
def leaning() -> HexMesh:
    """A cup whose apex is not below the middle of its base: the first row has many levels."""
    shape = TruncatedEllipsoid(
        np.zeros(2), np.array([0.3, 0.2]), 22 * np.eye(2), 55.0, 0.5, 10.0, 8.0
    )
    return ellipsoid_mesh(shape, (2, 12, 6))


def test_free_wall_of_the_right_ventricle_has_no_segment(biv: HexMesh) -> None:
    segment = segments_of_elements(biv, heart_axes(biv))
    free = np.zeros(biv.n_elements, dtype=bool)
    free[biv.topology.parts["right ventricle"]] = True
    assert ((segment == 0) == free).all()
    septal = set(segment[biv.topology.parts["septum"]].tolist())
    assert {2, 3, 8, 9} <= septal
    assert not septal & {5, 6, 11, 12, 16}
