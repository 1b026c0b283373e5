"""The certificate proves what Gauss points cannot see."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from math import comb, prod

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.jacobian import determinants, jacobian_ratio
from heartgen.mesh.validity import (
    UNIT,
    certify,
    certify_jacobian,
    determinant_coefficients,
    rounding_bound,
)


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


def nearly_flat(seed: int, thickness: float) -> np.ndarray:
    """Coefficients (64, 3) of an element all of whose edges lie nearly in one plane, mm."""
    rng = np.random.default_rng(seed)
    control = cube() @ np.array([[12.0, 0.0, 0.0], [3.0, 9.0, 0.0], [7.0, 5.0, thickness]])
    control += 0.01 * thickness * rng.standard_normal((64, 3))
    rotation = Rotation.random(rng=rng).as_matrix()
    return control @ rotation.T + [120.0, -80.0, 40.0]


def exact_coefficients(control: np.ndarray) -> np.ndarray:
    """Bernstein coefficients (9, 9, 9) of det J, as fractions, of those of one element."""
    whole = np.vectorize(Fraction, otypes=[object])(control).reshape(4, 4, 4, 3)
    columns = []
    for d in range(3):
        slope = 3 * np.diff(whole, axis=2 - d)
        n = [s - 1 for s in slope.shape[:3]]
        for place in np.ndindex(*slope.shape[:3]):
            slope[place] *= prod(comb(a, b) for a, b in zip(n, place, strict=True))
        columns.append(np.moveaxis(slope, -1, 0))

    def times(f: np.ndarray, g: np.ndarray) -> np.ndarray:
        shape = [m + n - 1 for m, n in zip(f.shape, g.shape, strict=True)]
        out = np.full(shape, Fraction(0), dtype=object)
        for k, j, i in np.ndindex(*f.shape):
            out[tuple(slice(a, a + n) for a, n in zip((k, j, i), g.shape, strict=True))] += (
                f[k, j, i] * g
            )
        return out

    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = columns
    det = (
        times(ax, times(by, cz) - times(bz, cy))
        + times(ay, times(bz, cx) - times(bx, cz))
        + times(az, times(bx, cy) - times(by, cx))
    )
    for place in np.ndindex(9, 9, 9):
        det[place] /= prod(comb(8, b) for b in place)
    return det


@pytest.mark.parametrize("thickness", [1e-9, 1e-5, 1.0])
def test_rounding_bound_covers_the_errors_and_is_not_much_more(thickness: float) -> None:
    largest = 0.0
    for seed in range(2):
        control = nearly_flat(seed, thickness)
        exact = exact_coefficients(control)
        found = determinant_coefficients(control[None])[0]
        bound = rounding_bound(control[None])[0]
        error = np.abs(np.vectorize(Fraction, otypes=[object])(found) - exact).astype(float)
        assert np.all(error <= bound)
        largest = max(largest, float((error / bound).max()))
        if thickness < 1e-8:  # a fixed share of the largest coefficient would not do
            assert error.max() > 1e-12 * np.abs(found).max()
        # No more than a few hundred roundings of the products, which do not cancel.
        product = np.linalg.norm(np.ptp(control, axis=0)) ** 3
        assert bound.max() < 1e4 * UNIT * product
    assert largest > 1e-3


@pytest.mark.slow
def test_flat_elements_are_decided_right_or_not_at_all() -> None:
    for thickness in (1e-14, 1e-12, 1e-9, 1e-6):
        for seed in range(4):
            control = nearly_flat(seed, thickness)
            certificate = certify_jacobian(single(control))
            exact = exact_coefficients(control) if seed == 0 else None
            if exact is not None and certificate.all_valid:
                assert min(exact[::8, ::8, ::8].ravel()) >= Fraction(certificate.lower_bound[0])
            mirrored = control.reshape(4, 4, 4, 3)[::-1].reshape(64, 3)
            assert not certify_jacobian(single(mirrored)).all_valid
    assert certify_jacobian(single(nearly_flat(0, 1e-6))).all_valid


def test_numbers_that_are_none_are_not_valid() -> None:
    assert not certify_jacobian(single(np.full((64, 3), np.nan))).all_valid


def test_a_cube_and_gentle_deformations_are_proven_valid() -> None:
    noise = np.random.default_rng(0).standard_normal((64, 3))
    for size in (0, 0.01, 0.03):
        assert certify_jacobian(single(cube() + size * noise)).all_valid


def test_a_tangled_element_that_passes_at_gauss_points_is_caught() -> None:
    control = cube()
    corner = 0
    control[corner] += 0.12  # det J there is 1 - 9 * 0.12 < 0, but grows quickly
    mesh = single(control)
    assert jacobian_ratio(mesh)[0] > 0
    assert determinants(mesh, np.zeros((1, 3)))[0, 0] < 0
    assert not certify_jacobian(mesh).all_valid


def test_a_fold_inside_an_element_is_caught() -> None:
    control = cube()
    for node in (21, 22, 25, 26, 37, 38, 41, 42):
        control[node, 0] = 1 - control[node, 0] + (0.9 if control[node, 0] < 0.5 else -0.9)
    mesh = single(control)
    inside = determinants(mesh, lattice(9))
    assert inside.min() < 0
    assert not certify_jacobian(mesh).all_valid


@pytest.mark.slow
@settings(max_examples=60)
@given(st.integers(0, 10_000), st.floats(0.0, 0.4))
def test_certificate_never_contradicts_a_dense_sample(seed: int, size: float) -> None:
    control = cube() + size * np.random.default_rng(seed).standard_normal((64, 3))
    certificate = certify_jacobian(single(control))
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


def test_functions_are_the_identity_at_corners() -> None:
    """There one of the 64 functions is 1, that of the corner, and all others are 0."""
    one, many = lattice(2), lattice()
    corner = [int(np.flatnonzero((many == c).all(1))[0]) for c in one]
    assert len(set(corner)) == 8
    np.testing.assert_array_equal(tabulate(one), np.eye(64)[corner])
