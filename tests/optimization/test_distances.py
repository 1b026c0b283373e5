"""Distances between mesh and patient, in both directions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heartgen.mesh.closest import closest_points
from heartgen.mesh.dof_map import DofMap, FaceDofMap
from heartgen.mesh.surface_faces import sample_faces
from heartgen.optimization import misfit
from heartgen.optimization.distances import MeshToPatient, PatientToMesh
from heartgen.optimization.settings import FACE_GAUSS
from heartgen.optimization.target import TRUNCATION_SURFACES
from tests.optimization.hearts import Heart


def faces_of(heart: Heart) -> tuple[FaceDofMap, np.ndarray]:
    dof_map = DofMap(heart.mesh.topology)
    return FaceDofMap(dof_map, heart.mesh.topology), heart.mesh.dofs[dof_map.free]


def test_mesh_to_patient_is_the_mean_square_of_the_signed_distance(heart: Heart) -> None:
    faces, q = faces_of(heart)
    term = MeshToPatient(faces, heart.target, np.ones(len(faces.faces)))
    square = area = 0.0
    for name, rows in heart.mesh.topology.surfaces.items():
        points, _, weights = sample_faces(heart.mesh, rows, FACE_GAUSS)
        square += float(weights @ heart.target.images[name].sample(points)[0] ** 2)
        area += float(weights.sum())
    assert term.near(q).value(q) == pytest.approx(square / area, rel=0.05)


def test_patient_to_mesh_is_the_distance_to_the_tangent_planes(heart: Heart) -> None:
    faces, q = faces_of(heart)
    term = PatientToMesh(faces, heart.target, np.ones(len(faces.faces)))
    for name, points in heart.target.points.items():
        face, functions, normal, value, weight = term._matched(faces.at(q), name)
        near = np.einsum("pa,pax->px", functions, faces.at(q)[face])
        np.testing.assert_allclose(
            np.sum((near - points.points) * normal, axis=1), value, atol=1e-9
        )
        assert np.all(weight <= points.weights * (1 + 1e-12))
        # At a closest point inside a face the whole distance is along the normal.
        whole = np.linalg.norm(near - points.points, axis=1)
        assert np.median((whole - np.abs(value))[weight > 0]) < 1e-6
        assert np.isin(face, np.arange(faces.rows[name].start, faces.rows[name].stop)).all()


def test_points_that_look_the_other_way_do_not_count(left: Heart) -> None:
    faces, q = faces_of(left)
    ones = np.ones(len(faces.faces))
    points = {n: replace(p, normals=-p.normals) for n, p in left.target.points.items()}
    assert PatientToMesh(faces, left.target, ones).near(q).value(q) > 0
    averse = PatientToMesh(faces, replace(left.target, points=points), ones).near(q)
    assert averse.value(q) < 1e-3 * PatientToMesh(faces, left.target, ones).near(q).value(q)


def test_the_data_of_a_face_weigh_what_it_is_given(heart: Heart) -> None:
    faces, q = faces_of(heart)
    some = np.arange(len(faces.faces)) % 2.0
    for kind in (MeshToPatient, PatientToMesh):
        one, other, whole = (
            kind(faces, heart.target, w).near(q).value(q) for w in (some, 1 - some, 1 + some)
        )
        assert whole == pytest.approx(2 * one + other)


def test_misfit_is_the_mean_distance_from_the_patient(heart: Heart) -> None:
    distance, weight = [], []
    for name, points in heart.target.points.items():
        assert name not in TRUNCATION_SURFACES
        rows = heart.mesh.topology.surfaces[name]
        distance.append(closest_points(heart.mesh, rows, points.points, 8).distance)
        weight.append(points.weights)
    exact = np.average(np.concatenate(distance), weights=np.concatenate(weight))
    assert misfit(heart.mesh, heart.target) == pytest.approx(exact, rel=0.02)
