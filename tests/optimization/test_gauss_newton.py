"""The driver: it goes down, stays where it may be, and takes no number for an answer."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from heartgen.errors import Cancelled
from heartgen.optimization.assembly import Assembler, Blocks
from heartgen.optimization.gauss_newton import minimize
from heartgen.optimization.terms import Model
from tests.optimization.hearts import Heart

DOFS = np.array([[0]])
"""One point, x, y, z."""

VALLEY = np.array([[-1.2, 1.0, 0.5]])
"""A start in Rosenbrock's valley, whose lowest place is (1, 1, 0)."""


@dataclass(frozen=True)
class Valley:
    """Rosenbrock's function as squares of residuals; what it is at each step is written down."""

    seen: list[float] = field(default_factory=list)

    def near(self, q: np.ndarray) -> Model:
        x, y, z = q[0]
        residual = np.array([10 * (y - x**2), 1 - x, z])
        rows = np.array([[-20 * x, 10, 0], [-1, 0, 0], [0, 0, 1]])
        self.seen.append(float(residual @ residual))
        return Model(self.value, Blocks(DOFS, (rows.T @ rows)[None], (rows.T @ residual)[None]))

    @staticmethod
    def value(q: np.ndarray) -> float:
        x, y, z = q[0]
        return float(100 * (y - x**2) ** 2 + (1 - x) ** 2 + z**2)


@dataclass(frozen=True)
class Changed:
    """A valley whose value is another."""

    change: Callable[[np.ndarray, float], float]

    def near(self, q: np.ndarray) -> Model:
        model = Valley().near(q)
        return replace(model, value=lambda q: self.change(q, model.value(q)))


@pytest.fixture
def assembler() -> Assembler:
    return Assembler([DOFS], 1)


def test_it_goes_down_at_every_step_to_the_lowest_place(assembler: Assembler) -> None:
    valley = Valley()
    found = minimize(VALLEY, [valley], assembler, 50)
    np.testing.assert_allclose(found, [[1, 1, 0]], atol=1e-6)
    assert len(valley.seen) > 2
    assert np.all(np.diff(valley.seen) < 0)


def test_terms_are_added(assembler: Assembler) -> None:
    def pull(q: np.ndarray) -> Model:
        away = q - [[3.0, 0.0, 0.0]]
        return Model(
            lambda q: float(np.sum((q - [[3.0, 0.0, 0.0]]) ** 2)),
            Blocks(DOFS, np.eye(3)[None], away.reshape(1, 3)),
        )

    class Pull:
        near = staticmethod(pull)

    class Rest:
        @staticmethod
        def near(q: np.ndarray) -> Model:
            return Model(
                lambda q: 2 * float(np.sum(q**2)),
                Blocks(DOFS, 2 * np.eye(3)[None], 2 * q.reshape(1, 3)),
            )

    found = minimize(np.ones((1, 3)), [Pull(), Rest()], assembler)
    np.testing.assert_allclose(found, [[1, 0, 0]], atol=1e-8)


def test_it_stays_feasible(assembler: Assembler) -> None:
    asked: list[bool] = []

    def feasible(q: np.ndarray) -> bool:
        asked.append(bool(q[0, 0] < 0))
        return asked[-1]

    valley = Valley()
    found = minimize(VALLEY, [valley], assembler, 50, feasible)
    assert found[0, 0] < 0
    assert not all(asked)
    assert Valley.value(found) < valley.seen[0]


def test_without_a_feasible_step_it_stays(assembler: Assembler) -> None:
    found = minimize(VALLEY, [Valley()], assembler, 50, lambda q: False)
    np.testing.assert_array_equal(found, VALLEY)


@pytest.mark.parametrize("number", [np.nan, np.inf])
def test_it_does_not_go_where_the_energy_is_no_number(assembler: Assembler, number: float) -> None:
    def bad(q: np.ndarray, value: float) -> float:
        return number if q[0, 0] > 0 else value

    found = minimize(VALLEY, [Changed(bad)], assembler, 50)
    assert found[0, 0] <= 0
    assert Valley.value(found) < Valley.value(VALLEY)


def test_a_start_that_is_no_number_is_given_back(assembler: Assembler) -> None:
    found = minimize(VALLEY, [Changed(lambda q, value: np.nan)], assembler)
    np.testing.assert_array_equal(found, VALLEY)


def test_few_steps_are_fewer(assembler: Assembler) -> None:
    for steps in (0, 1, 3):
        valley, done = Valley(), []
        minimize(VALLEY, [valley], assembler, steps, progress=done.append)
        assert len(valley.seen) == steps
        assert done == [step / steps for step in range(steps)]


def test_progress_can_cancel(assembler: Assembler) -> None:
    def stop(done: float) -> None:
        if done > 0:
            raise Cancelled

    with pytest.raises(Cancelled):
        minimize(VALLEY, [Valley()], assembler, progress=stop)


def energy_of(heart: Heart, q: np.ndarray) -> float:
    terms = heart.energy().terms(np.ones(heart.mesh.n_elements))
    return sum(term.near(q).value(q) for term in terms)


@pytest.mark.slow
def test_the_energy_of_a_heart_falls(heart: Heart) -> None:
    energy = heart.energy()
    terms = energy.terms(np.ones(heart.mesh.n_elements))
    reached = [energy.degrees(heart.mesh)]
    for _ in range(4):
        reached.append(minimize(reached[-1], terms, energy.assembler, 1))
    values = [energy_of(heart, q) for q in reached]
    assert np.all(np.diff(values) <= 0)
    assert values[-1] < 0.5 * values[0]


def test_a_step_that_is_not_a_number_is_not_made(
    heart: Heart, monkeypatch: pytest.MonkeyPatch
) -> None:
    energy = heart.energy()
    q = energy.degrees(heart.mesh)
    monkeypatch.setattr(Assembler, "solve", lambda self, blocks: np.full(q.shape, np.nan))
    kept = minimize(q, energy.terms(np.ones(heart.mesh.n_elements)), energy.assembler)
    np.testing.assert_array_equal(kept, q)


@pytest.mark.slow
def test_no_step_leaves_what_is_feasible(both: Heart) -> None:
    energy = both.energy()
    terms = energy.terms(np.ones(both.mesh.n_elements))
    q = energy.degrees(both.mesh)
    most = 0.5 * np.abs(minimize(q, terms, energy.assembler, 4) - q).max()
    kept = minimize(q, terms, energy.assembler, 4, lambda p: bool(np.abs(p - q).max() < most))
    assert 0 < np.abs(kept - q).max() < most
    before, after = (sum(term.near(x).value(x) for term in terms) for x in (q, kept))
    assert after < before
