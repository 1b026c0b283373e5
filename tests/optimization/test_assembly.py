"""The banded system of the optimization is the dense one."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.optimization.assembly import Assembler, Blocks


def _chain(n: int, per_block: int, rng: np.random.Generator) -> Blocks:
    """Positive definite blocks of neighbors in a chain whose numbers are shuffled."""
    numbers = rng.permutation(n)
    dofs = np.stack([numbers[k : k + n - per_block + 1] for k in range(per_block)], axis=1)
    root = rng.normal(size=(len(dofs), 3 * per_block, 3 * per_block))
    return Blocks(dofs, root @ root.transpose(0, 2, 1), rng.normal(size=(len(dofs), 3 * per_block)))


def _two_kinds(n: int, rng: np.random.Generator) -> list[Blocks]:
    """Long and short blocks; some of the short ones' degrees of freedom are none."""
    blocks = [_chain(n, 4, rng), _chain(n, 2, rng)]
    blocks[1].dofs[rng.random(blocks[1].dofs.shape) < 0.2] = n
    return blocks


def _dense(blocks: list[Blocks], n: int) -> tuple[np.ndarray, np.ndarray]:
    """Matrix and gradient of all degrees of freedom, block by block."""
    matrix, gradient = np.zeros((3 * n + 3, 3 * n + 3)), np.zeros(3 * n + 3)
    for b in blocks:
        for dofs, part, slope in zip(b.dofs, b.matrix, b.gradient, strict=True):
            places = (3 * dofs[:, None] + np.arange(3)).ravel()
            matrix[np.ix_(places, places)] += part
            gradient[places] += slope
    return matrix[: 3 * n, : 3 * n], gradient[: 3 * n]


@pytest.mark.parametrize("seed", range(4))
def test_step_solves_the_dense_system(seed: int) -> None:
    rng, n = np.random.default_rng(seed), 23
    blocks = _two_kinds(n, rng)
    step = Assembler([b.dofs for b in blocks], n).solve(blocks)
    matrix, gradient = _dense(blocks, n)
    np.testing.assert_allclose(step.ravel(), -np.linalg.solve(matrix, gradient), rtol=1e-6)


def test_blocks_of_the_same_degrees_of_freedom_are_added() -> None:
    rng, n = np.random.default_rng(5), 23
    one, other = _two_kinds(n, rng)
    more = Blocks(one.dofs, 2 * one.matrix, rng.normal(size=one.gradient.shape))
    step = Assembler([one.dofs, other.dofs], n).solve([one, other, more])
    matrix, gradient = _dense([one, other, more], n)
    np.testing.assert_allclose(step.ravel(), -np.linalg.solve(matrix, gradient), rtol=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_held_degrees_of_freedom_stay_and_the_rest_solves_its_own_system(seed: int) -> None:
    rng, n = np.random.default_rng(seed), 23
    blocks = _two_kinds(n, rng)
    held = rng.random(n) < 0.3
    step = Assembler([b.dofs for b in blocks], n, held).solve(blocks)
    assert held.any()
    assert not step[held].any()
    matrix, gradient = _dense(blocks, n)
    free = np.repeat(~held, 3)
    expected = -np.linalg.solve(matrix[np.ix_(free, free)], gradient[free])
    np.testing.assert_allclose(step[~held].ravel(), expected, rtol=1e-6)


def test_degrees_of_freedom_of_no_block_do_not_move() -> None:
    blocks = _chain(9, 3, np.random.default_rng(0))
    step = Assembler([blocks.dofs], 12).solve([blocks])
    assert not step[9:].any()
    assert step[:9].all()


def test_a_system_without_a_finite_solution_gives_no_number() -> None:
    blocks = _chain(9, 3, np.random.default_rng(0))
    blocks.matrix[0] *= -1e3
    assert np.isnan(Assembler([blocks.dofs], 9).solve([blocks])).all()
