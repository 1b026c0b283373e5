"""The banded system of the refinement is the dense one."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.refinement.assembly import Assembler, Blocks


def _chain(n: int, per_block: int, rng: np.random.Generator) -> Blocks:
    """Positive definite blocks of neighbours in a chain whose numbers are shuffled."""
    numbers = rng.permutation(n)
    dofs = np.stack([numbers[k : k + n - per_block + 1] for k in range(per_block)], axis=1)
    root = rng.normal(size=(len(dofs), 3 * per_block, 3 * per_block))
    return Blocks(dofs, root @ root.transpose(0, 2, 1), rng.normal(size=(len(dofs), 3 * per_block)))


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
def test_step_solves_the_dense_system(seed):
    rng, n = np.random.default_rng(seed), 23
    blocks = [_chain(n, 4, rng), _chain(n, 2, rng)]
    blocks[1].dofs[rng.random(blocks[1].dofs.shape) < 0.2] = n  # known ones, which do not move
    step = Assembler([b.dofs for b in blocks], n).solve(blocks)
    matrix, gradient = _dense(blocks, n)
    np.testing.assert_allclose(step.ravel(), -np.linalg.solve(matrix, gradient), rtol=1e-6)


def test_degrees_of_freedom_of_no_block_do_not_move():
    blocks = _chain(9, 3, np.random.default_rng(0))
    step = Assembler([blocks.dofs], 12).solve([blocks])
    assert not step[9:].any()
    assert step[:9].all()


def test_a_system_without_a_finite_solution_gives_no_number():
    blocks = _chain(9, 3, np.random.default_rng(0))
    blocks.matrix[0] *= -1e3
    assert np.isnan(Assembler([blocks.dofs], 9).solve([blocks])).all()
