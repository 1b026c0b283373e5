"""Refinement: its derivatives, its laws, and what it repairs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from heartgen import samples
from heartgen.anatomy import Anatomy, analyse
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.enhancement import enhance
from heartgen.mesh import HexMesh
from heartgen.mesh.freedom import FaceFreedom, Freedom
from heartgen.mesh.validity import certify, determinant_coefficients
from heartgen.refinement import Weights, misfit, patient_of, refine, weights_for
from heartgen.refinement.anchor import FARTHEST, FARTHEST_OF_ALL, drift
from heartgen.refinement.assembly import Assembler
from heartgen.refinement.distances import distance_blocks, from_patient, to_patient
from heartgen.refinement.elements import Elements, usual_care
from heartgen.templates import lv_template

STEP = 1e-5


@pytest.fixture(scope="module")
def anatomy() -> Anatomy:
    return analyse(samples.lifelike_lv(2.0).mask)


@pytest.fixture(scope="module")
def template(anatomy: Anatomy) -> HexMesh:
    return lv_template(anatomy, (1, 8, 4))


def folded(mesh: HexMesh) -> HexMesh:
    """The mesh with a node of the outer surface pushed through the inner one."""
    freedom = Freedom(mesh.topology)
    q = mesh.dofs[freedom.free].copy()
    corner = mesh.control[mesh.topology.index[:, 2] == 2][0]
    inner, outer = corner[0], corner[48]
    hit = np.flatnonzero(np.linalg.norm(q - outer, axis=1) < 1e-6)
    q[hit] += 1.5 * (inner - outer)
    return mesh.with_dofs(freedom.straight @ q)


@pytest.mark.parametrize("unfolding", [False, True])
def test_gradient_of_the_quality_terms(template: HexMesh, unfolding: bool) -> None:
    freedom = Freedom(template.topology)
    rng = np.random.default_rng(0)
    emphasis = rng.choice([1.0, 2.0, 8.0], template.n_elements)
    care = usual_care(template.n_elements).with_more("emphasis", emphasis)
    elements = Elements(freedom, template.topology, care)
    q = template.dofs[freedom.free] + 0.1 * rng.standard_normal((freedom.n, 3))
    direction = rng.standard_normal(q.shape)
    oblique = elements.oblique(elements.state(q, unfolding))

    def energy(t: float) -> float:
        state = elements.state(q + t * direction, unfolding=False)
        if unfolding:
            lifted = elements.state(q, unfolding=True).lift
            state = replace(state, lift=lifted)
        return 2.0 * elements.spread(state) + 3.0 * elements.shear(state, oblique)

    slope = (energy(STEP) - energy(-STEP)) / (2 * STEP)
    blocks = elements.blocks(q, elements.state(q, unfolding), 2.0, 3.0, 0.0)
    padded = np.concatenate([direction, np.zeros((1, 3))])[blocks.dofs].reshape(
        len(blocks.dofs), -1
    )
    # The blocks hold half the gradient of a sum of squares.
    assert 2 * np.sum(padded * blocks.gradient) == pytest.approx(slope, rel=1e-5)


def test_firm_elements_are_held_straight_and_fitted_less_closely(
    anatomy: Anatomy, template: HexMesh
) -> None:
    firmness = np.where(template.topology.index[:, 1] < 2, 1e2, 1)
    care = usual_care(template.n_elements).with_more("firmness", firmness)
    patient, weights = patient_of(anatomy), weights_for(5, 1.0)
    free = refine(template, patient, weights)
    held = refine(template, patient, weights, care=care)
    freedom = Freedom(template.topology)
    form = Elements(freedom, template.topology, care)

    def bent(mesh: HexMesh) -> float:
        q = mesh.dofs[freedom.free]
        return form.bent(q, form.stiff(form.state(q)))

    assert bent(held) < 0.5 * bent(free)
    errors = [
        assess_accuracy(m, anatomy.myocardium, anatomy.wall_volume).mean for m in (free, held)
    ]
    assert errors[0] < errors[1]


def test_emphasis_betters_elements_and_costs_less_accuracy_than_firmness(
    anatomy: Anatomy, template: HexMesh
) -> None:
    chosen = template.topology.index[:, 1] < 2
    patient, weights = patient_of(anatomy), weights_for(5, 1.0)
    usual = usual_care(template.n_elements)
    free, stressed, firm = (
        refine(template, patient, weights, care=care)
        for care in (
            usual,
            usual.with_more("emphasis", np.where(chosen, 1e2, 1)),
            usual.with_more("firmness", np.where(chosen, 1e2, 1)),
        )
    )

    def least(mesh: HexMesh) -> float:
        det = determinant_coefficients(mesh.control[chosen & ~_collapsed(mesh)])
        at_corners = det[:, ::8, ::8, ::8].min((1, 2, 3))
        return float((at_corners / det.mean((1, 2, 3))).min())

    assert least(stressed) > least(free)
    assert misfit(stressed, patient) < misfit(firm, patient)


def _collapsed(mesh: HexMesh) -> NDArray[np.bool_]:
    """Elements (e,) at the pole, where det J is zero at corners."""
    return np.isin(np.arange(mesh.n_elements), mesh.topology.collapsed[:, 0])


def test_gradient_of_the_distances(anatomy: Anatomy, template: HexMesh) -> None:
    freedom = Freedom(template.topology)
    faces, patient = FaceFreedom(freedom, template.topology), patient_of(anatomy)
    q = template.dofs[freedom.free]
    direction = np.random.default_rng(0).standard_normal(q.shape)
    d = to_patient(template, faces, patient, 2.0)

    def energy(t: float) -> float:
        moved = template.with_dofs(freedom.straight @ (q + t * direction))
        return float(d.weight @ to_patient(moved, faces, patient, 2.0).value ** 2)

    slope = (energy(STEP) - energy(-STEP)) / (2 * STEP)
    blocks = distance_blocks(faces, [d], 1.0)
    padded = np.concatenate([direction, np.zeros((1, 3))])[blocks.dofs].reshape(
        len(blocks.dofs), -1
    )
    assert 2 * np.sum(padded * blocks.gradient) == pytest.approx(slope, rel=1e-4)


def test_gradient_of_the_movement(template: HexMesh) -> None:
    freedom = Freedom(template.topology)
    faces = FaceFreedom(freedom, template.topology)
    rng = np.random.default_rng(0)
    start, direction = rng.standard_normal((2, freedom.n, 3))
    start *= 3
    moved = template.with_dofs(template.dofs + freedom.straight @ start)

    def energy(t: float) -> float:
        further = moved.with_dofs(moved.dofs + freedom.straight @ (t * direction))
        return float(d.weight @ drift(further, template, faces, 0.5).value ** 2)

    d = drift(moved, template, faces, 0.5)
    assert (d.value > 0).any()
    slope = (energy(STEP) - energy(-STEP)) / (2 * STEP)
    blocks = distance_blocks(faces, [d], 1.0)
    padded = np.concatenate([direction, np.zeros((1, 3))])[blocks.dofs].reshape(
        len(blocks.dofs), -1
    )
    assert 2 * np.sum(padded * blocks.gradient) == pytest.approx(slope, rel=1e-4)


def test_material_points_keep_near_their_anchor(anatomy: Anatomy, template: HexMesh) -> None:
    spin, origin = np.eye(4), anatomy.frame[:3, 3]
    spin[:3, :3] = Rotation.from_rotvec(0.2 * anatomy.frame[:3, 2]).as_matrix()
    spin[:3, 3] = origin - spin[:3, :3] @ origin
    anchor = template.transformed(spin)
    refined = refine(template, patient_of(anatomy), weights_for(3, 1.0), anchor=anchor)
    faces = FaceFreedom(Freedom(template.topology), template.topology)
    before, after = (drift(m, anchor, faces, 0.0).value.max() for m in (template, refined))
    limit = min(FARTHEST * anatomy.length, FARTHEST_OF_ALL)
    assert before > 1.5 * limit
    assert after < 1.05 * limit


def test_distances_from_the_patient_are_those_to_the_tangent_planes(
    anatomy: Anatomy, template: HexMesh
) -> None:
    faces, patient = FaceFreedom(Freedom(template.topology), template.topology), patient_of(anatomy)
    d = from_patient(template, faces, patient.points, patient.voxel)
    points = np.concatenate([p.points for p in patient.points.values()])
    near = np.einsum("pa,pax->px", d.functions, faces.control(template)[d.face])
    np.testing.assert_allclose(np.sum((near - points) * d.normal, axis=1), d.value, atol=1e-9)
    inside = d.weight > 0
    # At a closest point inside a face the whole distance is along the normal.
    assert np.median(np.linalg.norm(near - points, axis=1)[inside] - np.abs(d.value[inside])) < 1e-6
    assert 0.5 < d.weight.sum() <= 1 + 1e-12


def test_error_and_quality_both_improve(anatomy: Anatomy, template: HexMesh) -> None:
    refined = refine(template, patient_of(anatomy), weights_for(3, 1.0))
    before = assess_accuracy(template, anatomy.myocardium, anatomy.wall_volume)
    after = assess_accuracy(refined, anatomy.myocardium, anatomy.wall_volume)
    assert after.mean < 0.5 * before.mean
    assert assess_quality(refined).valid
    np.testing.assert_array_equal(enhance(refined).dofs, refined.dofs)


def test_the_quality_dial_trades_accuracy_for_quality(anatomy: Anatomy, template: HexMesh) -> None:
    patient = patient_of(anatomy)
    loose, firm = (refine(template, patient, weights_for(3, dial)) for dial in (0.2, 5.0))
    error = [
        assess_accuracy(m, anatomy.myocardium, anatomy.wall_volume).mean for m in (loose, firm)
    ]
    quality = [assess_quality(m).mean for m in (loose, firm)]
    assert error[0] < error[1]
    assert quality[0] < quality[1]


def test_folded_elements_are_unfolded(anatomy: Anatomy, template: HexMesh) -> None:
    start = folded(template)
    assert not certify(start).all_valid
    refined = refine(start, patient_of(anatomy), weights_for(2, 1.0))
    assert certify(refined).all_valid


def test_a_step_that_is_not_a_number_is_not_made(
    anatomy: Anatomy, template: HexMesh, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        Assembler, "solve", lambda self, blocks: np.full((self.n, 3), np.nan, dtype=float)
    )
    kept = refine(template, patient_of(anatomy), weights_for(3, 1.0), steps=2)
    np.testing.assert_allclose(kept.dofs, enhance(template).dofs, atol=1e-9)


def test_moves_with_the_patient(anatomy: Anatomy, template: HexMesh) -> None:
    rotation = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    motion = np.eye(4)
    motion[:3, :3], motion[:3, 3] = rotation, [30, -20, 5]
    sample = samples.lifelike_lv(2.0)
    mask = sample.mask
    elsewhere = analyse(type(mask)(mask.voxels, motion @ mask.affine, mask.name))
    here = refine(template, patient_of(anatomy), Weights(), steps=3)
    there = refine(template.transformed(motion), patient_of(elsewhere), Weights(), steps=3)
    np.testing.assert_allclose(there.dofs, here.transformed(motion).dofs, atol=0.05)


def test_progress_can_cancel(anatomy: Anatomy, template: HexMesh) -> None:
    class StopNowError(Exception):
        pass

    def stop(done: float) -> None:
        if done > 0:
            raise StopNowError

    with pytest.raises(StopNowError):
        refine(template, patient_of(anatomy), Weights(), progress=stop)
