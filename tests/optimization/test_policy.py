"""The policy: valid, then close, then good."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import heartgen
from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.enhancement import enhance
from heartgen.errors import Cancelled, InputError
from heartgen.mesh import HexMesh
from heartgen.mesh.dof_map import DofMap, FaceDofMap
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.projection import projector
from heartgen.mesh.surface_faces import face_control, sample_faces
from heartgen.mesh.validity import certify
from heartgen.optimization import (
    FitSettings,
    curve_transmural_lines,
    fit_target,
    misfit,
    optimize,
    policy,
)
from heartgen.optimization.policy import _neighbors, raise_ratios
from heartgen.optimization.settings import GROWTH, MOST_RAISED, RAISED_ROUNDS, RELAXED_ROUNDS
from heartgen.options import QUALITY_LIMITS
from heartgen.result import Personalization
from heartgen.warping import GAUSS, warp
from tests.optimization.conftest import COARSE
from tests.optimization.hearts import Heart

pytestmark = pytest.mark.slow

ELEMENTS = (2, 12, 8)


def greedy(settings: FitSettings) -> FitSettings:
    """Settings with so little quality that elements fold."""
    return replace(settings, even=settings.even / 300, angles=settings.angles / 300)


def much(settings: FitSettings) -> FitSettings:
    """Settings with so much quality that the mesh stays away from the patient."""
    return replace(settings, even=10 * settings.even)


def folded(mesh: HexMesh) -> HexMesh:
    """The mesh with a node of the outer surface pushed through the inner one."""
    dof_map = DofMap(mesh.topology)
    q = mesh.dofs[dof_map.free].copy()
    corner = mesh.control[mesh.topology.index[:, 2] == 2][0]
    inner, outer = corner[0], corner[48]
    hit = np.flatnonzero(np.linalg.norm(q - outer, axis=1) < 1e-6)
    assert len(hit)
    q[hit] += 1.5 * (inner - outer)
    return mesh.with_dofs(dof_map.straight @ q)


def pinched(heart: Heart) -> HexMesh:
    """The mesh, whose lateral walls went through each other near the base; none folds."""
    anatomy, frame = heart.anatomy, heart.anatomy.frame
    middles = heart.mesh.evaluate(np.full((1, 3), 0.5))[:, 0]
    top = anatomy.to_heart(middles)[:, 2].max()

    def pinch(points: np.ndarray) -> np.ndarray:
        x, y, z = anatomy.to_heart(points).T
        toward = np.tanh(x / 5) * np.exp(-((y / 8) ** 2) - ((z - top) / 25) ** 2)
        return points - 28.0 * np.outer(toward, frame[:3, 0])

    return warp(heart.mesh, pinch)


def through_the_septum(heart: Heart) -> HexMesh:
    """The mesh, whose right free wall was sheared through the septum; none folds."""
    mesh = heart.mesh
    free = np.unique(mesh.topology.patches["rv_free_wall"][:, 0])
    wall, septum = (
        sample_faces(mesh, mesh.topology.patches[name], 4)[0].mean(0)
        for name in ("rv_free_wall", "rv_septum")
    )
    toward = (septum - wall) / np.linalg.norm(septum - wall)
    projection = projector(mesh, GAUSS)
    points = projection.points.reshape(mesh.n_elements, -1, 3).copy()
    off = points[free] - wall
    off -= (off @ toward)[..., None] * toward
    share = np.exp(-np.sum((off / 12) ** 2, axis=-1))
    points[free] += 30.0 * share[..., None] * toward
    return enhance(mesh.with_dofs(projection.project(points.reshape(-1, 3))))


def error(mesh: HexMesh, heart: Heart) -> float:
    return assess_accuracy(mesh, heart.anatomy.myocardium, heart.anatomy.wall_volume).mean


def test_error_and_quality_both_improve(left: Heart) -> None:
    optimized = optimize(left.mesh, left.target, left.settings())
    assert optimized.valid
    assert not optimized.regularized.any()
    assert error(optimized.mesh, left) < 0.5 * error(left.mesh, left)
    assert assess_quality(optimized.mesh).valid
    np.testing.assert_array_equal(enhance(optimized.mesh).dofs, optimized.mesh.dofs)


def test_the_quality_dial_trades_accuracy_for_quality(heart: Heart) -> None:
    loose, firm = (
        optimize(heart.mesh, heart.target, heart.settings(3, dial)).mesh for dial in (0.2, 5.0)
    )
    assert error(loose, heart) < error(firm, heart)
    assert assess_quality(loose).mean < assess_quality(firm).mean


def test_levels_trade_quality_for_accuracy(heart: Heart) -> None:
    coarse, fine = (optimize(heart.mesh, heart.target, heart.settings(k)).mesh for k in (1, 5))
    assert error(fine, heart) < error(coarse, heart)
    assert assess_quality(fine).mean < assess_quality(coarse).mean


@pytest.mark.parametrize("seed", [1, 3])
def test_a_mesh_full_of_folds_unfolds_whatever_quality_weighs(both: Heart, seed: int) -> None:
    shake = np.random.default_rng(seed).normal(scale=2, size=both.mesh.dofs.shape)
    start = both.mesh.with_dofs(both.mesh.dofs + shake)
    assert np.mean(certify(start).valid) < 0.6
    for dial in (1.0, QUALITY_LIMITS[1]):
        optimized = optimize(start, both.target, both.settings(1, dial))
        assert optimized.valid
        assert certify(optimized.mesh).all_valid


def test_a_folded_element_is_unfolded(left: Heart) -> None:
    start = folded(left.mesh)
    assert not certify(start).all_valid
    optimized = optimize(start, left.target, left.settings(2))
    assert optimized.valid
    assert certify(optimized.mesh).all_valid
    assert misfit(optimized.mesh, left.target) < misfit(start, left.target)


@pytest.mark.parametrize(
    ("kind", "elements", "cross"),
    [("left", (1, 12, 6), pinched), ("both", (2, 12, 8), through_the_septum)],
)
def test_walls_that_cross_are_taken_apart(
    kind: str,
    elements: tuple[int, int, int],
    cross: Callable[[Heart], HexMesh],
    request: pytest.FixtureRequest,
) -> None:
    heart = request.getfixturevalue(kind).finer(*elements)
    start = cross(heart)
    before = certify(start)
    assert before.overlapping.any()
    assert before.positive.all()
    optimized = optimize(start, heart.target, heart.settings())
    assert optimized.valid
    assert certify(optimized.mesh).all_valid
    assert misfit(optimized.mesh, heart.target) < 0.6 * misfit(start, heart.target)


def test_elements_that_fold_are_regularized_and_few_others(both: Heart) -> None:
    settings = greedy(both.settings())
    energy = policy.Energy(both.mesh, both.target, settings)
    q = policy.minimize(
        energy.degrees(both.mesh),
        energy.terms(np.ones(both.mesh.n_elements)),
        energy.assembler,
    )
    invalid = ~certify(energy.shape(q)).valid
    assert 0 < invalid.sum() < both.mesh.n_elements
    optimized = optimize(both.mesh, both.target, settings)
    assert optimized.valid
    assert certify(optimized.mesh).all_valid
    assert np.all(optimized.regularized[invalid])
    assert not optimized.regularized.all()
    # What it took to unfold costs little of what the others have gained.
    usual = optimize(both.mesh, both.target, both.settings()).mesh
    assert misfit(optimized.mesh, both.target) < misfit(usual, both.target)


def test_what_does_not_become_valid_is_told(both: Heart, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(policy, "ROUNDS", 1)
    monkeypatch.setattr(policy, "MORE_ROUNDS", 1)
    optimized = optimize(both.mesh, both.target, greedy(both.settings()))
    assert not optimized.valid
    assert np.all(optimized.regularized[~certify(optimized.mesh).valid])


def test_neighbors_help_elements_that_do_not_come_free_alone(
    both: Heart, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(policy, "ROUNDS", 1)
    optimized = optimize(both.mesh, both.target, greedy(both.settings()))
    assert optimized.valid
    assert certify(optimized.mesh).all_valid


def test_elements_that_share_a_node_are_neighbors(both: Heart) -> None:
    near, nodes = _neighbors(both.mesh), both.mesh.topology.nodes
    for a, b in np.ndindex(near.shape):
        assert near[a, b] == bool(set(nodes[a]) & set(nodes[b]))


def test_once_valid_no_step_leaves_the_valid_meshes(
    both: Heart, monkeypatch: pytest.MonkeyPatch
) -> None:
    reached: list[bool] = []
    weights: list[float] = []
    eases: list[float] = []
    terms = policy.Energy.terms

    def watched(self: policy.Energy, weight: np.ndarray, ease: float) -> object:
        weights.append(float(weight.max()))
        eases.append(ease)
        return terms(self, weight, ease)

    def minimize(*given: object, feasible: Callable[..., bool], **more: object) -> np.ndarray:
        q = of_driver(*given, feasible=feasible, **more)
        reached.append(feasible(q))
        return q

    of_driver = policy.minimize
    monkeypatch.setattr(policy.Energy, "terms", watched)
    monkeypatch.setattr(policy, "minimize", minimize)
    optimized = optimize(both.mesh, both.target, greedy(both.settings()), allowed=0.0)
    assert optimized.valid
    assert all(reached)
    # Weights grow round by round and go back; then all but the data weighs less and less.
    peak = int(np.flatnonzero(np.equal(weights, max(weights)))[-1])
    assert np.all(np.diff(weights[: peak + 1]) >= 0)
    assert weights[peak] > GROWTH
    assert set(weights[peak + 1 :]) == {GROWTH}
    assert set(eases[: peak + 2]) == {1.0}
    assert np.all(np.diff(eases[peak + 1 :]) < 0)
    assert len(eases) == peak + 2 + RELAXED_ROUNDS


def test_quality_may_cost_no_more_accuracy_than_allowed(heart: Heart) -> None:
    settings = much(heart.settings())
    free = optimize(heart.mesh, heart.target, settings).mesh
    allowed = 0.9 * misfit(free, heart.target)
    kept = optimize(heart.mesh, heart.target, settings, allowed)
    assert kept.valid
    assert not kept.regularized.any()
    assert 0.7 * allowed < misfit(kept.mesh, heart.target) <= allowed
    same = optimize(heart.mesh, heart.target, settings, 1.01 * misfit(free, heart.target)).mesh
    np.testing.assert_array_equal(same.dofs, free.dofs)


def test_material_points_keep_their_place_as_asked(left: Heart) -> None:
    faces = FaceDofMap(DofMap(left.mesh.topology), left.mesh.topology)

    def moved(place: float) -> float:
        settings = replace(left.settings(), place=place)
        optimized = optimize(left.mesh, left.target, settings).mesh
        motion = faces.control(optimized) - faces.control(left.mesh)
        return float(np.linalg.norm(motion[faces.rows["lv_endo"]], axis=-1).mean())

    free, usual, firm = (moved(place) for place in (0.0, left.settings().place, 1e3))
    assert firm < usual <= 1.01 * free


def test_two_runs_agree_bit_for_bit(heart: Heart) -> None:
    one, other = (optimize(heart.mesh, heart.target, heart.settings()).mesh for _ in range(2))
    np.testing.assert_array_equal(one.dofs, other.dofs)


@pytest.mark.parametrize("kind", ["left", "both"])
def test_moves_with_the_patient(kind: str, request: pytest.FixtureRequest) -> None:
    heart: Heart = request.getfixturevalue(kind)
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec([0.3, -0.2, 0.9]).as_matrix()
    motion[:3, 3] = [30, -20, 5]
    mask = (samples.lifelike_lv if kind == "left" else samples.biv)(COARSE).mask
    elsewhere = analyze(type(mask)(mask.voxels, motion @ mask.affine, mask.name))
    here = optimize(heart.mesh, heart.target, heart.settings()).mesh.transformed(motion)
    start = heart.mesh.transformed(motion)
    there = optimize(start, fit_target(elsewhere), heart.settings()).mesh
    xi = np.random.default_rng(0).uniform(size=(50, 3))
    np.testing.assert_allclose(there.evaluate(xi), here.evaluate(xi), atol=0.05)


def test_progress_can_cancel(heart: Heart) -> None:
    def stop(done: float) -> None:
        if done > 0:
            raise Cancelled

    with pytest.raises(Cancelled):
        optimize(heart.mesh, heart.target, heart.settings(), progress=stop)


@pytest.fixture(scope="module")
def usual() -> Personalization:
    """Both ventricles, through the whole pipeline."""
    return heartgen.personalize(samples.biv(COARSE).mask, elements=ELEMENTS)


def test_the_poorest_reaches_what_is_asked_for(usual: Personalization) -> None:
    least = usual.report.quality.min + 0.04
    raised = heartgen.personalize(usual.mask, elements=ELEMENTS, min_jacobian_ratio=least).report
    assert raised.quality.min >= least
    assert raised.quality.valid
    assert not any("poorest" in f.message for f in raised.findings)
    assert raised.quality.mean > usual.report.quality.mean - 0.01
    assert raised.accuracy.mean < 1.1 * usual.report.accuracy.mean


def test_where_all_reach_it_nothing_changes(heart: Heart) -> None:
    plain = optimize(heart.mesh, heart.target, heart.settings()).mesh
    least = float(jacobian_ratio(plain).min()) - 0.01
    same = optimize(heart.mesh, heart.target, heart.settings(), least=least).mesh
    np.testing.assert_array_equal(same.dofs, plain.dofs)


def test_a_relaxed_interior_raises_them_without_the_surfaces(usual: Personalization) -> None:
    mesh = usual.mesh
    relaxed = curve_transmural_lines(mesh)
    least = float(jacobian_ratio(relaxed).min()) + 0.02
    raised = curve_transmural_lines(mesh, least)
    assert jacobian_ratio(raised).min() >= least
    faces = mesh.topology.external
    assert np.array_equal(face_control(raised, faces), face_control(mesh, faces))


def test_what_is_out_of_reach_is_told() -> None:
    mask = samples.ideal_cup(COARSE).mask
    asked = heartgen.personalize(mask, elements=(1, 8, 4), min_jacobian_ratio=0.95).report
    assert asked.quality.valid
    (message,) = [f.message for f in asked.findings if "as asked for" in f.message]
    assert f"{asked.quality.min:.3f}, not 0.95 as asked for" in message


def test_the_best_round_is_kept(heart: Heart) -> None:
    asked: list[np.ndarray] = []
    rng = np.random.default_rng(0)

    def worse(mesh: HexMesh, weight: np.ndarray) -> HexMesh:
        asked.append(weight)
        return mesh.with_dofs(mesh.dofs + rng.normal(scale=2.0, size=mesh.dofs.shape))

    least = float(np.quantile(jacobian_ratio(heart.mesh), 0.3))
    ones = np.ones(heart.mesh.n_elements)
    assert raise_ratios(heart.mesh, least, ones, worse) is heart.mesh
    assert len(asked) == RAISED_ROUNDS
    assert np.all(np.diff(asked, axis=0) >= 0)
    assert asked[0].max() <= MOST_RAISED
    # Elements that are clearly good enough weigh what they did.
    assert np.all(asked[0][jacobian_ratio(heart.mesh) > 1.2 * least] == 1)


@pytest.mark.parametrize(
    ("choices", "words"),
    [
        ({"min_jacobian_ratio": 1.0}, "cannot be asked of every element"),
        ({"min_jacobian_ratio": -0.1}, "cannot be asked of every element"),
        ({"min_jacobian_ratio": float("nan")}, "cannot be asked of every element"),
        ({"min_jacobian_ratio": 0.3, "optimize": False}, "allow the optimization"),
    ],
)
def test_what_cannot_be_asked_for(choices: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        heartgen.Options(**choices)
