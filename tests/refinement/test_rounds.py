"""Rounds of refinement: out of folds, and no worse for it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from heartgen import samples
from heartgen.anatomy import analyse
from heartgen.mesh import HexMesh
from heartgen.mesh.validity import certify
from heartgen.options import QUALITY_LIMITS
from heartgen.refinement import (
    Patient,
    Weights,
    misfit,
    patient_of,
    refine,
    refine_in_rounds,
    rounds,
    weights_for,
)
from heartgen.templates import biventricular_template

ELEMENTS = (2, 6, 3)


@pytest.fixture(scope="module")
def heart() -> tuple[HexMesh, Patient]:
    """Template of a coarse sample, a few elements of which are easily folded."""
    anatomy = analyse(samples.biv(2.0).mask)
    return biventricular_template(anatomy, ELEMENTS), patient_of(anatomy)


@pytest.fixture(scope="module")
def usual() -> Weights:
    """Weights under which nothing folds."""
    return weights_for(1, 1.0, biventricular=True, columns=ELEMENTS[1])


@pytest.fixture(scope="module")
def greedy(usual: Weights) -> Weights:
    """Weights with so little quality that elements fold between the guard points."""
    return replace(usual, spread=usual.spread / 100, shear=usual.shear / 100)


def test_within_the_valid_meshes_no_step_leaves_them(
    heart: tuple[HexMesh, Patient], usual: Weights, greedy: Weights
) -> None:
    template, patient = heart
    assert not certify(refine(template, patient, greedy)).all_valid
    start = refine(template, patient, usual)
    assert certify(start).all_valid
    refined = refine(start, patient, greedy, within=True)
    assert certify(refined).all_valid
    assert misfit(refined, patient) < 0.8 * misfit(start, patient)


@pytest.mark.parametrize("remedy", ["emphasis", "firmness"])
def test_what_it_took_to_unfold_costs_little_accuracy(
    heart: tuple[HexMesh, Patient], greedy: Weights, remedy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    template, patient = heart
    free = refine(template, patient, greedy)
    folded = int(np.sum(~certify(free).valid))
    monkeypatch.setattr(rounds, "REMEDIES", {remedy: 9})
    refined, treated, valid = refine_in_rounds(template, patient, greedy)
    assert valid
    assert certify(refined).all_valid
    assert treated >= folded > 0

    assert misfit(refined, patient) < misfit(free, patient)


@pytest.mark.parametrize("seed", [1, 3])
def test_a_mesh_full_of_folds_unfolds_whatever_quality_weighs(
    heart: tuple[HexMesh, Patient], seed: int
) -> None:
    template, patient = heart
    shake = np.random.default_rng(seed).normal(scale=2, size=template.dofs.shape)
    start = template.with_dofs(template.dofs + shake)
    assert np.mean(certify(start).valid) < 0.6
    most = weights_for(1, QUALITY_LIMITS[1], biventricular=True, columns=ELEMENTS[1])
    assert certify(refine(start, patient, most)).all_valid


def test_without_folds_there_is_one_round(heart: tuple[HexMesh, Patient], usual: Weights) -> None:
    template, patient = heart
    refined, treated, valid = refine_in_rounds(template, patient, usual)
    assert (treated, valid) == (0, True)
    np.testing.assert_array_equal(refined.dofs, refine(template, patient, usual).dofs)
