"""Points are found in the elements they lie in, exactly."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import MeshError
from heartgen.mesh import HexMesh, MeshField
from heartgen.mesh.closest import closest_points
from heartgen.mesh.rasterization import FLATNESS, rasterize
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh

FOUND = 1e-9
"""Distance of a point from where it is found, mm."""


def curved(apex: str) -> HexMesh:
    """A thick half shell that is bent and sheared, far from the origin."""
    shape = TruncatedEllipsoid(
        center=np.zeros(2),
        lean=np.zeros(2),
        section=20 * np.eye(2),
        axis=30.0,
        cut=0.0,
        wall=10.0,
        apex=8.0,
    )
    mesh = ellipsoid_mesh(shape, (2, 12, 6), apex=apex, hole=6.0)
    affine = np.eye(4)
    affine[:3, :3] += [[0, 0.2, 0.1], [-0.1, 0, 0.3], [0.05, 0, 0]]
    affine[:3, 3] = [120, -340, 900]
    return mesh.transformed(affine)


MESHES = {apex: curved(apex) for apex in ("collapsed", "patch", "hole")}

share = st.one_of(st.sampled_from([0.0, 1e-9, 0.5, 1.0]), st.floats(0, 1))


@given(apex=st.sampled_from(sorted(MESHES)), data=st.data())
@settings(max_examples=150)
def test_found_where_they_are(apex, data):
    mesh = MESHES[apex]
    element = data.draw(st.integers(0, mesh.n_elements - 1))
    xi = np.array([[data.draw(share), data.draw(share), data.draw(share)]])
    point = mesh.evaluate(np.array([element]), xi)
    elements, found = mesh.locate(point)
    assert elements[0] >= 0
    assert ((found >= 0) & (found <= 1)).all()
    assert_allclose(mesh.evaluate(elements, found), point, atol=FOUND, rtol=0)


@pytest.mark.parametrize("apex", MESHES)
def test_inside_an_element_it_is_that_one(apex):
    mesh, generator = MESHES[apex], np.random.default_rng(3)
    elements = generator.integers(mesh.n_elements, size=2000)
    xi = generator.uniform(0.01, 0.99, (2000, 3))
    found, where = mesh.locate(mesh.evaluate(elements, xi))
    assert_array_equal(found, elements)
    assert_allclose(where, xi, atol=1e-7)


@pytest.mark.parametrize("apex", MESHES)
def test_found_however_near_a_pole_or_a_face_they_are(apex):
    mesh, generator = MESHES[apex], np.random.default_rng(5)
    elements = generator.integers(mesh.n_elements, size=3000)
    near = 10.0 ** generator.uniform(-18, -1, (3000, 3))
    xi = np.where(generator.random((3000, 3)) < 0.5, near, generator.random((3000, 3)))
    xi = np.where(generator.random((3000, 3)) < 0.5, xi, 1 - xi)
    points = mesh.evaluate(elements, xi)
    found, where = mesh.locate(points)
    assert (found >= 0).all()
    assert_allclose(mesh.evaluate(found, where), points, atol=FOUND, rtol=0)


def test_found_without_any_symmetry(disturbed):
    generator = np.random.default_rng(4)
    elements = generator.integers(disturbed.n_elements, size=500)
    xi = generator.uniform(size=(500, 3))
    points = disturbed.evaluate(elements, xi)
    assert_allclose(disturbed.evaluate(*disturbed.locate(points)), points, atol=FOUND, rtol=0)


@pytest.mark.parametrize("apex", MESHES)
def test_outside_there_is_none(apex):
    mesh = MESHES[apex]
    points = mesh.lagrange_points().reshape(-1, 3)
    low = points.min(0) - 2.3
    shape = tuple(np.ceil((np.ptp(points, axis=0) + 5) / 3).astype(int).tolist())
    affine = np.diag([3.0, 3.0, 3.0, 1.0])
    affine[:3, 3] = low
    inside = rasterize(mesh, shape, affine).ravel() > 0
    centers = np.argwhere(np.ones(shape, dtype=bool)) * 3.0 + low
    elements, xi = mesh.locate(centers)
    differ = centers[(elements >= 0) != inside]
    if len(differ):  # where the triangles of the image lie beside the surface
        away = closest_points(mesh, mesh.topology.external, differ).distance
        assert (away < 3 * FLATNESS).all()
    assert np.isnan(xi[elements < 0]).all()
    assert np.isnan(mesh.evaluate(elements, xi)[elements < 0]).all()


def test_off_the_surface_by_little_is_outside():
    mesh = MESHES["hole"]
    face = mesh.surfaces["epi"][:1]
    point = mesh.evaluate(face[:, 0], np.array([[0.3, 0.4, 1.0]]))
    slope = mesh.gradient(np.array([[0.3, 0.4, 1.0]]))[face[0, 0], 0][:, 2]
    outward = slope / np.linalg.norm(slope)
    assert mesh.locate(point - 1e-6 * outward)[0][0] == face[0, 0]
    assert mesh.locate(point + 1e-6 * outward)[0][0] == -1


def test_values_of_points_are_those_of_elements():
    mesh = MESHES["patch"]
    xi = np.array([[0.2, 0.7, 0.4]])
    every = np.arange(mesh.n_elements)
    at_points = mesh.evaluate(every, np.repeat(xi, len(every), axis=0))
    assert_allclose(at_points, mesh.evaluate(xi)[:, 0], atol=1e-12)
    field = MeshField("place", mesh.lagrange_points())
    assert_allclose(field.evaluate(every, np.repeat(xi, len(every), axis=0)), at_points, atol=1e-10)
    constant = MeshField("number", every.astype(float))
    assert_array_equal(constant.evaluate(np.array([3, -1]), np.zeros((2, 3)))[:, 0], [3, np.nan])


@pytest.mark.parametrize(
    ("elements", "xi"),
    [([0], np.zeros((2, 3))), ([0.5], np.zeros((1, 3))), ([10_000], np.zeros((1, 3)))],
)
def test_what_does_not_belong_together_is_refused(elements, xi):
    with pytest.raises(MeshError, match="give"):
        MESHES["hole"].evaluate(np.array(elements), xi)


def test_points_that_are_none_are_refused():
    with pytest.raises(MeshError, match=r"give \(n, 3\)"):
        MESHES["hole"].locate(np.zeros(3))
    elements, xi = MESHES["hole"].locate(np.zeros((0, 3)))
    assert len(elements) == len(xi) == 0
    assert MESHES["hole"].locate(np.full((1, 3), np.nan))[0][0] == -1
