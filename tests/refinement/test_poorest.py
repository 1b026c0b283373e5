"""The poorest elements: raised to what is asked for, or as far as they can be, and told."""

from __future__ import annotations

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.errors import Cancelled, InputError
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.surfaces import face_control
from heartgen.pipeline import Personalization
from heartgen.refinement.elements import Care
from heartgen.refinement.poorest import ROUNDS, raise_poorest

ELEMENTS = (2, 12, 8)


@pytest.fixture(scope="module")
def heart() -> samples.Sample:
    return samples.biv(2.0)


@pytest.fixture(scope="module")
def usual(heart: samples.Sample) -> Personalization:
    return heartgen.personalize(heart.mask, elements=ELEMENTS)


def test_the_poorest_reaches_what_is_asked_for(
    heart: samples.Sample, usual: Personalization
) -> None:
    least = usual.report.quality.min + 0.04
    raised = heartgen.personalize(heart.mask, elements=ELEMENTS, least_quality=least).report
    assert raised.quality.min >= least
    assert raised.quality.valid
    assert not any("poorest" in f.message for f in raised.findings)
    assert raised.quality.mean > usual.report.quality.mean - 0.01
    assert raised.accuracy.mean < 1.1 * usual.report.accuracy.mean


def test_where_all_reach_it_nothing_changes(heart: samples.Sample, usual: Personalization) -> None:
    least = usual.report.quality.min - 0.01
    same = heartgen.personalize(heart.mask, elements=ELEMENTS, least_quality=least)
    np.testing.assert_array_equal(same.mesh.dofs, usual.mesh.dofs)


def test_a_relaxed_interior_raises_them_without_the_surfaces(usual: Personalization) -> None:
    mesh = usual.mesh
    relaxed = heartgen.refinement.relax(mesh)
    least = float(jacobian_ratio(relaxed).min()) + 0.02
    raised = heartgen.refinement.relax(mesh, least)
    assert jacobian_ratio(raised).min() >= least
    faces = mesh.topology.external
    assert np.array_equal(face_control(raised, faces), face_control(mesh, faces))


def test_what_is_out_of_reach_is_told(heart: samples.Sample) -> None:
    asked = heartgen.personalize(heart.mask, elements=(2, 6, 3), least_quality=0.95).report
    assert asked.quality.valid
    (message,) = [f.message for f in asked.findings if "poorest" in f.message]
    assert f"{asked.quality.min:.3f}, not 0.95 as asked for" in message


def test_the_best_round_is_kept(usual: Personalization) -> None:
    asked: list[float] = []
    rng = np.random.default_rng(0)

    def worse(mesh: HexMesh, care: Care) -> HexMesh:
        asked.append(float(care.emphasis.max()))
        return mesh.with_dofs(mesh.dofs + rng.normal(scale=0.3, size=mesh.dofs.shape))

    assert raise_poorest(usual.mesh, 0.9, worse) is usual.mesh
    assert len(asked) == ROUNDS
    assert np.all(np.diff(asked) > 0)


def test_progress_can_cancel(usual: Personalization) -> None:
    def cancel(done: float) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        heartgen.refinement.relax(usual.mesh, 0.9, cancel)


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"least_quality": 1.0}, "cannot be asked of every element"),
        ({"least_quality": -0.1}, "cannot be asked of every element"),
        ({"least_quality": float("nan")}, "cannot be asked of every element"),
        ({"least_quality": 0.3, "refine": False}, "allow the refinement"),
    ],
)
def test_what_cannot_be_asked_for(choices: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        heartgen.Options(**choices)
