"""Closest points are exact and complete."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from heartgen.mesh import HexMesh
from heartgen.mesh.closest import closest_points
from heartgen.mesh.surface_faces import evaluate_faces, sample_faces, tessellate
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh


def mesh() -> HexMesh:
    """A round cup."""
    shape = TruncatedEllipsoid(np.zeros(2), np.zeros(2), 20 * np.eye(2), 50.0, 0.5, 10.0, 8.0)
    return ellipsoid_mesh(shape, (1, 12, 6))


MESH = mesh()
EXTERNAL = MESH.topology.external
DENSE = cKDTree(tessellate(MESH, EXTERNAL, 60)[0])


def test_points_off_the_surface_along_its_normal_come_back() -> None:
    for offset in (0.0, 0.5, 2.0):
        points, normals, _ = sample_faces(MESH, EXTERNAL, 5)
        found = closest_points(MESH, EXTERNAL, points + offset * normals)
        assert np.abs(found.distance - offset).max() < 1e-9
        assert np.linalg.norm(found.points - points, axis=1).max() < 1e-6


@settings(max_examples=40)
@given(st.integers(0, 10_000))
def test_never_farther_than_the_nearest_of_many_samples(seed: int) -> None:
    queries = np.random.default_rng(seed).uniform([-35, -35, -70], [35, 35, 10], (50, 3))
    found = closest_points(MESH, EXTERNAL, queries)
    dense, _ = DENSE.query(queries)
    assert (found.distance <= dense + 1e-9).all()
    assert (found.distance >= dense - 0.2).all()


def test_parameters_evaluate_to_the_point() -> None:
    queries = np.random.default_rng(0).uniform([-35, -35, -70], [35, 35, 10], (40, 3))
    found = closest_points(MESH, EXTERNAL, queries)
    for n in range(len(queries)):
        points, _ = evaluate_faces(MESH, EXTERNAL[found.face[n]][None], found.uv[n][None])
        assert np.abs(points[0, 0] - found.points[n]).max() < 1e-10
