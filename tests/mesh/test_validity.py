"""The certificate proves what Gauss points cannot see."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.jacobian import determinants, jacobian_ratio
from heartgen.mesh.validity import certify, determinant_coefficients


def single(control: np.ndarray) -> HexMesh:
    """One element with given Bernstein coefficients (64, 3)."""
    topology = replace(
        cup_topology((1, 3, 1)),
        extraction=sp.csr_array(sp.eye_array(64)),
        index=np.zeros((1, 3), dtype=np.intp),
        collapsed=np.zeros((0, 2), dtype=np.intp),
    )
    return HexMesh(control, topology)


def cube() -> np.ndarray:
    """Bernstein coefficients of the unit cube."""
    return lattice()


def test_coefficients_are_those_of_det_j() -> None:
    rng = np.random.default_rng(0)
    control = rng.standard_normal((3, 64, 3))
    xi = rng.uniform(size=(20, 3))
    coefficients = determinant_coefficients(control).reshape(3, -1)
    from heartgen.mesh.bernstein import bernstein

    f = [bernstein(xi[:, d], 8) for d in range(3)]
    basis = np.einsum("qk,qj,qi->qkji", f[2], f[1], f[0]).reshape(20, -1)
    for e in range(3):
        exact = determinants(single(control[e]), xi)[0]
        assert np.abs(basis @ coefficients[e] - exact).max() < 1e-10 * np.abs(exact).max()


def test_a_cube_and_gentle_deformations_are_proven_valid() -> None:
    noise = np.random.default_rng(0).standard_normal((64, 3))
    for size in (0, 0.01, 0.03):
        assert certify(single(cube() + size * noise)).all_valid


def test_a_tangled_element_that_passes_at_gauss_points_is_caught() -> None:
    control = cube()
    corner = 0
    control[corner] += 0.12  # det J there is 1 - 9 * 0.12 < 0, but grows quickly
    mesh = single(control)
    assert jacobian_ratio(mesh)[0] > 0
    assert determinants(mesh, np.zeros((1, 3)))[0, 0] < 0
    assert not certify(mesh).all_valid


def test_a_fold_inside_an_element_is_caught() -> None:
    control = cube()
    for node in (21, 22, 25, 26, 37, 38, 41, 42):
        control[node, 0] = 1 - control[node, 0] + (0.9 if control[node, 0] < 0.5 else -0.9)
    mesh = single(control)
    inside = determinants(mesh, lattice(9))
    assert inside.min() < 0
    assert not certify(mesh).all_valid


@settings(max_examples=60)
@given(st.integers(0, 10_000), st.floats(0.0, 0.4))
def test_certificate_never_contradicts_a_dense_sample(seed: int, size: float) -> None:
    control = cube() + size * np.random.default_rng(seed).standard_normal((64, 3))
    certificate = certify(single(control))
    sampled = determinants(single(control), lattice(12)).min()
    assert certificate.lower_bound[0] <= sampled + 1e-9
    if certificate.all_valid:
        assert sampled > 0
    elif sampled > 0:
        finer = determinants(single(control), lattice(40)).min()
        assert finer < 0.2 * np.median(determinants(single(control), lattice(12)))


def test_collapsed_apex_is_certified_and_its_fold_is_not(cup: HexMesh) -> None:
    assert certify(cup).all_valid
    apical = cup.topology.index[:, 2] == 0
    broken = cup.dofs.copy()
    broken[1:3] *= -1  # the endocardial tangent plane at the pole turns inside out
    certificate = certify(cup.with_dofs(broken))
    assert not certificate.valid[apical & (cup.topology.index[:, 0] == 0)].all()


def test_interpolation_matrix_is_the_identity_at_corners() -> None:
    corners = lattice(2)
    assert np.abs(tabulate(corners).sum(1) - 1).max() < 1e-14
