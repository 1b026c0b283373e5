"""Every term of the energy: its derivatives, and what its Gauss-Newton matrix is."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from heartgen.mesh.validity import certify
from heartgen.optimization.assembly import Blocks
from heartgen.optimization.distances import MeshToPatient, PatientToMesh
from heartgen.optimization.quality import EvenJacobians, RightAngles
from heartgen.optimization.surface_lines import SurfaceLines
from heartgen.optimization.terms import Term
from tests.optimization.hearts import Heart

STEP = 1e-5
"""Of the difference quotients, mm."""

FROZEN = (PatientToMesh, RightAngles, SurfaceLines)
"""Terms whose weights stay while the mesh moves, so that the gradient is that of the value."""

TERMS = (MeshToPatient, PatientToMesh, EvenJacobians, RightAngles, SurfaceLines)

LEFT_FINE, BOTH_FINE = (2, 12, 6), (2, 12, 8)
"""Elements around 1 cm^3 or less."""


@pytest.fixture(scope="module")
def fine(heart: Heart) -> Heart:
    return heart.finer(*(LEFT_FINE if heart.anatomy.rv is None else BOTH_FINE))


def place(heart: Heart, size: float = 0.1) -> np.ndarray:
    """Degrees of freedom of the mesh with every one disturbed, mm: no term is at rest."""
    energy, rng = heart.energy(), np.random.default_rng(0)
    return energy.degrees(heart.mesh) + size * rng.standard_normal((energy.dof_map.n, 3))


def term_of(heart: Heart, kind: type) -> Term:
    """One term, in which elements weigh differently."""
    weight = np.random.default_rng(1).choice([1.0, 2.0, 8.0], heart.mesh.n_elements)
    (found,) = [t for t in heart.energy().terms(weight) if isinstance(t, kind)]
    return found


def slope(value: Callable[[np.ndarray], float], q: np.ndarray, direction: np.ndarray) -> float:
    """Difference quotient."""
    return (value(q + STEP * direction) - value(q - STEP * direction)) / (2 * STEP)


def padded(blocks: Blocks, direction: np.ndarray) -> np.ndarray:
    """Direction (b, 3 m) in each block."""
    local = np.concatenate([direction, np.zeros((1, 3))])[blocks.dofs]
    return np.asarray(local.reshape(len(blocks.dofs), -1))


def gradient(blocks: Blocks, n: int) -> np.ndarray:
    """The blocks' gradients, added up, (n, 3)."""
    out = np.zeros((n + 1, 3))
    np.add.at(out, blocks.dofs.ravel(), blocks.gradient.reshape(-1, 3))
    return out[:n]


@pytest.mark.slow
def test_the_energy_has_these_terms(heart: Heart) -> None:
    assert [type(t) for t in heart.energy().terms(np.ones(heart.mesh.n_elements))] == list(TERMS)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FROZEN)
@pytest.mark.parametrize("seed", range(3))
def test_gradient_is_that_of_the_value(heart: Heart, kind: type, seed: int) -> None:
    q = place(heart)
    model = term_of(heart, kind).near(q)
    direction = np.random.default_rng(seed).standard_normal(q.shape)
    # Values are sums of squares r'r, whose blocks hold J'r.
    expected = 2 * np.sum(padded(model.blocks, direction) * model.blocks.gradient)
    assert slope(model.value, q, direction) == pytest.approx(expected, rel=1e-4)
    assert model.value(q) > 0


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(3))
def test_gradient_of_even_jacobians(fine: Heart, seed: int) -> None:
    q = place(fine)
    assert certify(fine.energy().shape(q)).all_valid
    model = term_of(fine, EvenJacobians).near(q)
    direction = np.random.default_rng(seed).standard_normal(q.shape)
    expected = 2 * np.sum(padded(model.blocks, direction) * model.blocks.gradient)
    assert slope(model.value, q, direction) == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("seed", range(3))
def test_gradient_of_the_distances_from_the_mesh(heart: Heart, seed: int) -> None:
    # Its areas are measured anew in the value, but they are weights to the gradient.
    q = place(heart)
    term = term_of(heart, MeshToPatient)
    assert isinstance(term, MeshToPatient)
    model = term.near(q)
    direction = np.random.default_rng(seed).standard_normal(q.shape)
    weight = term._samples(q)[3]

    def weighed(q: np.ndarray) -> float:
        return float(np.sum(weight * term._samples(q)[2] ** 2))

    assert weighed(q) == pytest.approx(model.value(q))
    expected = 2 * np.sum(padded(model.blocks, direction) * model.blocks.gradient)
    assert slope(weighed, q, direction) == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize("size", [0.1, 3.0])
@pytest.mark.parametrize("kind", TERMS)
def test_a_short_way_down_the_gradient_lowers_the_value(
    heart: Heart, kind: type, size: float
) -> None:
    q = place(heart, size)  # with the larger disturbance elements fold
    assert certify(heart.energy().shape(q)).all_valid == (size < 1)
    model = term_of(heart, kind).near(q)
    down = -gradient(model.blocks, len(q))
    expected = -2 * float(np.sum(down**2))
    assert expected < 0
    along = slope(model.value, q, down / np.linalg.norm(down)) * np.linalg.norm(down)
    assert along == pytest.approx(expected, rel=0.15)


@pytest.mark.parametrize("size", [0.0, 3.0])
@pytest.mark.parametrize("kind", TERMS)
def test_matrix_is_symmetric_and_positive_semidefinite(
    heart: Heart, kind: type, size: float
) -> None:
    matrix = term_of(heart, kind).near(place(heart, size)).blocks.matrix
    largest = np.abs(matrix).max()
    np.testing.assert_allclose(matrix, matrix.transpose(0, 2, 1), atol=1e-12 * largest)
    assert np.linalg.eigvalsh(matrix).min() > -1e-10 * largest
    assert largest > 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", [EvenJacobians, RightAngles])
def test_an_element_weighs_what_it_is_given(heart: Heart, kind: type) -> None:
    n, q = heart.mesh.n_elements, place(heart)
    weight = np.random.default_rng(2).uniform(1, 4, n)

    def value(weight: np.ndarray) -> float:
        (term,) = [t for t in heart.energy().terms(weight) if isinstance(t, kind)]
        return term.near(q).value(q)

    each = [value(np.where(np.arange(n) == e, 1.0, 1e-12)) for e in range(n)]
    assert value(weight) == pytest.approx(weight @ each, rel=1e-6)


def test_what_counts_less_when_eased_and_more_when_weighed(heart: Heart) -> None:
    q, ones = place(heart), np.ones(heart.mesh.n_elements)

    def values(weight: float, ease: float) -> dict[type, float]:
        return {type(t): t.near(q).value(q) for t in heart.energy().terms(weight * ones, ease)}

    usual, weighed, eased = values(1, 1), values(9, 1), values(1, 0.25)
    for kind in TERMS:
        quality, data = kind in (EvenJacobians, RightAngles), kind in (MeshToPatient, PatientToMesh)
        assert weighed[kind] == pytest.approx((9 if quality else 1) * usual[kind])
        assert eased[kind] == pytest.approx((1 if data else 0.25) * usual[kind])


@pytest.mark.slow
def test_a_fold_is_infinite_to_a_valid_mesh_and_finite_to_a_folded_one(fine: Heart) -> None:
    energy, term = fine.energy(), term_of(fine, EvenJacobians)
    q, far = (place(fine, size) for size in (0.1, 5.0))
    assert not certify(energy.shape(far)).all_valid
    assert term.near(q).value(far) == np.inf
    assert np.isfinite(term.near(far).value(far))


def test_even_jacobians_do_not_know_units(heart: Heart) -> None:
    q, term = place(heart), term_of(heart, EvenJacobians)
    folded = place(heart, 10.0)
    assert not certify(heart.energy().shape(folded)).all_valid
    small = term.near(0.01 * q).value(0.01 * q)
    for unit in (0.01, 1.0, 100.0):
        model = term.near(unit * q)
        assert model.value(unit * q) == pytest.approx(small)
        assert model.value(unit * folded) == np.inf
