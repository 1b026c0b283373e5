"""Laws of the mesh kernel: bases, continuity, volumes, refinement."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from heartgen.errors import MeshError
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import (
    BERNSTEIN_TO_HERMITE,
    HERMITE_TO_BERNSTEIN,
    bernstein,
    bernstein_derivative,
    lattice,
    subdivision,
    tabulate,
)
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.jacobian import determinants, jacobian_ratio, scaled_jacobian, volume
from heartgen.mesh.projection import projector
from heartgen.mesh.quadrature import gauss, gauss_cube
from heartgen.mesh.surface_faces import enclosed_volume, evaluate_faces, surface_area

unit = st.floats(0, 1)


@given(st.lists(st.tuples(unit, unit, unit), min_size=1, max_size=20))
def test_basis_functions_sum_to_one(points: list[tuple[float, float, float]]) -> None:
    xi = np.array(points)
    assert np.abs(tabulate(xi).sum(1) - 1).max() < 1e-12
    for d in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        assert np.abs(tabulate(xi, d).sum(1)).max() < 1e-12


@given(st.lists(st.floats(-5, 5), min_size=4, max_size=4), unit)
def test_hermite_data_reproduces_every_cubic(c: list[float], t: float) -> None:
    p = np.polynomial.Polynomial(c)
    data = np.array([p(0), p.deriv()(0), p(1), p.deriv()(1)])
    at = np.array([t])
    control = HERMITE_TO_BERNSTEIN @ data
    assert abs(bernstein(at) @ control - p(t)) < 1e-12
    assert abs(bernstein_derivative(at) @ control - p.deriv()(t)) < 1e-11
    assert abs(bernstein_derivative(at, 2) @ control - p.deriv(2)(t)) < 1e-10
    assert np.abs(BERNSTEIN_TO_HERMITE @ control - data).max() < 1e-12


@given(st.integers(1, 6), unit)
def test_subdivision_keeps_the_curve(n: int, t: float) -> None:
    whole = np.array([1.0, -2.0, 0.5, 3.0])
    for piece, matrix in enumerate(subdivision(n)):
        place = np.array([(piece + t) / n])
        assert abs(bernstein(np.array([t])) @ (matrix @ whole) - bernstein(place) @ whole) < 1e-12


@given(st.integers(1, 8))
def test_gauss_rule_is_exact_to_its_order(n: int) -> None:
    t, w = gauss(n)
    for power in range(2 * n):
        assert abs(w @ t**power - 1 / (power + 1)) < 1e-13


@pytest.mark.slow
def test_gradient_is_the_derivative_of_the_position(disturbed: HexMesh) -> None:
    xi = np.random.default_rng(0).uniform(0.1, 0.9, (5, 3))
    h = 1e-6
    gradient = disturbed.gradient(xi)
    for d in range(3):
        step = np.eye(3)[d] * h
        slope = (disturbed.evaluate(xi + step) - disturbed.evaluate(xi - step)) / (2 * h)
        assert np.abs(gradient[..., d] - slope).max() < 1e-6


@pytest.mark.slow
def test_wall_is_c1_across_every_interior_face(disturbed: HexMesh) -> None:
    t = np.linspace(0, 1, 5)
    v, u = (g.ravel() for g in np.meshgrid(t, t, indexing="ij"))
    index = {tuple(i): e for e, i in enumerate(disturbed.topology.index)}
    n_r, n_c, n_l = disturbed.topology.shape
    pairs = 0
    for (r, c, s), e in index.items():
        neighbors = (
            ((r, (c + 1) % n_c, s), 0),
            ((r, c, s + 1) if s + 1 < n_l else None, 1),
            ((r + 1, c, s) if r + 1 < n_r else None, 2),
        )
        for other, axis in neighbors:
            if other is None:
                continue
            here = np.insert(np.stack([u, v], -1), axis, 1.0, axis=1)
            there = np.insert(np.stack([u, v], -1), axis, 0.0, axis=1)
            o = index[other]
            jump = disturbed.evaluate(here)[e] - disturbed.evaluate(there)[o]
            slope = disturbed.gradient(here)[e] - disturbed.gradient(there)[o]
            assert np.abs(jump).max() < 1e-10
            assert np.abs(slope).max() < 1e-10
            pairs += 1
    assert pairs >= n_r * n_c * n_l


@pytest.mark.slow
def test_pole_is_one_point_with_one_tangent_plane(disturbed: HexMesh) -> None:
    for face_end, element_layer in ((0.0, 0), (1.0, disturbed.topology.shape[0] - 1)):
        at_pole = np.stack([np.linspace(0, 1, 7), np.zeros(7), np.full(7, face_end)], -1)
        row = np.flatnonzero(
            (disturbed.topology.index[:, 2] == 0)
            & (disturbed.topology.index[:, 0] == element_layer)
        )
        places = disturbed.evaluate(at_pole)[row].reshape(-1, 3)
        assert np.ptp(places, axis=0).max() < 1e-12
        leaving = disturbed.gradient(at_pole)[row][..., 1].reshape(-1, 3)
        values = np.linalg.svd(leaving, compute_uv=False)
        assert values[2] < 1e-10 * values[0]


@pytest.mark.slow
def test_volume_by_two_routes(disturbed: HexMesh) -> None:
    assert volume(disturbed) == pytest.approx(enclosed_volume(disturbed), rel=1e-9)


@pytest.mark.slow
def test_spherical_shell_converges_to_its_volume() -> None:
    from heartgen.templates.ellipsoid import TruncatedEllipsoid
    from heartgen.templates.lv import ellipsoid_mesh

    shape = TruncatedEllipsoid(np.zeros(2), np.zeros(2), 20 * np.eye(2), 20.0, 0.0, 10.0, 10.0)
    exact = 2 * np.pi / 3 * (30**3 - 20**3)
    counts = np.array([6, 12, 24])
    errors = [abs(volume(ellipsoid_mesh(shape, (1, n, n // 2))) / exact - 1) for n in counts]
    assert max(errors) < 5e-4
    assert np.log2(errors[1] / errors[2]) > 3


def test_area_of_a_graded_wall_does_not_depend_on_the_grading(cup: HexMesh) -> None:
    linear = HexMesh(
        cup_topology(cup.topology.shape).straightening @ cup.dofs, cup_topology(cup.topology.shape)
    )
    for name in ("lv_endo", "epi"):
        faces = cup.topology.surfaces[name]
        assert surface_area(cup, faces) == pytest.approx(surface_area(linear, faces), rel=1e-12)
    assert volume(cup) == pytest.approx(volume(linear), rel=1e-12)


def test_faces_point_outward(cup: HexMesh) -> None:
    center = np.array([[0.5, 0.5]])
    middle = cup.evaluate(np.full((1, 3), 0.5))[:, 0]
    for faces in cup.topology.surfaces.values():
        points, area = evaluate_faces(cup, faces, center)
        outward = np.einsum("fx,fx->f", points[:, 0] - middle[faces[:, 0]], area[:, 0])
        assert (outward > 0).all()


@pytest.mark.slow
def test_refinement_leaves_the_geometry_unchanged(disturbed: HexMesh) -> None:
    pieces = {"radial": 2, "circumferential": 3, "longitudinal": 2}
    fine = disturbed.refined(**pieces)
    assert fine.n_elements == 12 * disturbed.n_elements
    assert fine.dofs is disturbed.dofs
    xi = lattice(3)
    n1, n2, n3 = 3, 2, 2
    values = fine.evaluate(xi).reshape(disturbed.n_elements, n3, n2, n1, -1, 3)
    for k in range(n3):
        for j in range(n2):
            for i in range(n1):
                coarse = disturbed.evaluate((xi + np.array([i, j, k])) / np.array([n1, n2, n3]))
                assert np.abs(values[:, k, j, i] - coarse).max() < 1e-10
    assert volume(fine) == pytest.approx(enclosed_volume(fine), rel=1e-9)
    for name, faces in disturbed.topology.surfaces.items():
        assert surface_area(fine, fine.topology.surfaces[name], 12) == pytest.approx(
            surface_area(disturbed, faces, 24), rel=1e-6
        )


def test_refined_structure_and_nodes() -> None:
    topology = cup_topology((1, 4, 2))
    mesh = HexMesh(np.zeros((len(topology.constant), 3)), topology)
    fine = mesh.refined(radial=2, circumferential=2, longitudinal=2).topology
    assert fine.shape == (2, 8, 4)
    assert len(np.unique(fine.index, axis=0)) == len(fine.index)
    assert fine.index.max(0).tolist() == [1, 7, 3]
    assert len(np.unique(fine.nodes)) == 3 * (1 + 8 * 4)
    assert len(fine.collapsed) == 2 * 8
    assert {name: len(f) for name, f in fine.surfaces.items()} == {
        "lv_endo": 32,
        "epi": 32,
        "base": 16,
    }


def test_lagrange_points_carry_the_same_geometry(disturbed: HexMesh) -> None:
    vandermonde = tabulate(lattice())
    control = np.linalg.solve(vandermonde, disturbed.lagrange_points())
    assert np.abs(control - disturbed.control).max() < 1e-10


@pytest.mark.slow
def test_projection_returns_every_function_of_the_space(disturbed: HexMesh, cup: HexMesh) -> None:
    xi, _ = gauss_cube((6, 6, 5))
    p = projector(cup, (6, 6, 5))
    values = disturbed.evaluate(xi).reshape(-1, 3)
    assert np.abs(p.project(values) - disturbed.dofs).max() < 1e-6
    back = disturbed.with_dofs(p.project(values))
    assert np.abs(back.control - disturbed.control).max() < 1e-8


@pytest.mark.slow
def test_affine_transform_is_exact(cup: HexMesh) -> None:
    affine = np.eye(4)
    affine[:3] = np.random.default_rng(3).standard_normal((3, 4))
    moved = cup.transformed(affine)
    expected = cup.control @ affine[:3, :3].T + affine[:3, 3]
    assert np.abs(moved.control - expected).max() < 1e-10


def test_quality_does_not_depend_on_pose_and_scale(cup: HexMesh) -> None:
    from scipy.spatial.transform import Rotation

    affine = np.eye(4)
    affine[:3, :3] = 3.7 * Rotation.from_rotvec([0.3, 0.4, -0.9]).as_matrix()
    moved = cup.transformed(affine)
    assert np.abs(jacobian_ratio(moved) - jacobian_ratio(cup)).max() < 1e-10
    assert np.abs(scaled_jacobian(moved) - scaled_jacobian(cup)).max() < 1e-10


@pytest.mark.slow
def test_quality_of_a_uniform_element_is_one_and_of_a_folded_one_not_positive(cup: HexMesh) -> None:
    mirror = np.diag([1.0, 1.0, -1.0, 1.0])
    assert (jacobian_ratio(cup.transformed(mirror)) <= 0).all()
    assert (determinants(cup, np.full((1, 3), 0.5)) > 0).all()


@pytest.mark.parametrize("shape", [(0, 12, 6), (1, 2, 6), (1, 12, 0)])
def test_too_few_elements_are_refused(shape: tuple[int, int, int]) -> None:
    with pytest.raises(MeshError, match="use at least"):
        cup_topology(shape)
