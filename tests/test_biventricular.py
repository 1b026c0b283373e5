"""Both ventricles, from mask to mesh: what is measured, where it moves, what never crosses."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import heartgen
from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.images import Mask
from heartgen.mesh.closest import closest_points
from heartgen.mesh.projection import projector
from heartgen.mesh.surface_faces import face_control, face_signs, sample_faces, tabulate_face
from heartgen.mesh.validity import certify
from heartgen.result import Personalization
from heartgen.warping import GAUSS

pytestmark = pytest.mark.slow

COARSE = 2.0
"""Voxel size that keeps the tests quick, mm."""


@pytest.fixture(scope="module")
def sample() -> samples.Sample:
    return samples.biv(COARSE)


@pytest.fixture(scope="module")
def fitted(sample: samples.Sample) -> Personalization:
    return heartgen.personalize(sample.mask, lod=2)


def test_result_is_valid_good_and_described(fitted: Personalization) -> None:
    report = fitted.report
    assert report.quality.valid
    assert report.success
    assert report.quality.mean > 0.5
    assert report.quality.scaled_mean > 0.8
    assert report.accuracy.mean < 0.2 * COARSE
    assert set(report.accuracy.by_surface) == {"lv_endo", "rv_endo", "rv_apex", "epi", "base"}
    assert report.measurements.right is not None
    assert "rv_apex" in report.to_json()


def test_septum_and_free_wall_never_cross(fitted: Personalization) -> None:
    mesh = fitted.mesh
    septum, free = (mesh.topology.patches[name] for name in ("rv_septum", "rv_free_wall"))
    for one, other in ((septum, free), (free, septum)):
        points, _, _ = sample_faces(mesh, other, 6)
        near = closest_points(mesh, one, points)
        inside = np.all((near.uv > 1e-6) & (near.uv < 1 - 1e-6), axis=1)
        control = face_control(mesh, one)[near.face]
        tangents = (
            np.einsum("na,nax->nx", tabulate_face(near.uv, d), control) for d in ((1, 0), (0, 1))
        )
        outward = np.cross(*tangents) * face_signs()[one[near.face, 1], None]
        # The signed distance: the wall's outside is the pool.
        signed = np.einsum("nx,nx->n", points - near.points, outward)
        assert signed[inside].min() > 0


def test_free_wall_pushed_through_the_septum_is_found(fitted: Personalization) -> None:
    mesh = fitted.mesh
    free = mesh.topology.patches["rv_free_wall"]
    wall, septum = (
        sample_faces(mesh, mesh.topology.patches[name], 4)[0].mean(0)
        for name in ("rv_free_wall", "rv_septum")
    )
    toward = (septum - wall) / np.linalg.norm(septum - wall)
    projection = projector(mesh, GAUSS)
    points = projection.points.reshape(mesh.n_elements, -1, 3)
    off = points[np.unique(free[:, 0])] - wall
    off -= (off @ toward)[..., None] * toward
    # A shear of the free wall, least at the insertion line: it does not fold.
    share = np.exp(-np.sum((off / 12) ** 2, axis=-1))
    assert certify(mesh).all_valid
    for distance, crossing in ((5.0, False), (30.0, True)):
        moved = points.copy()
        moved[np.unique(free[:, 0])] += distance * share[..., None] * toward
        certificate = certify(mesh.with_dofs(projection.project(moved.reshape(-1, 3))))
        assert certificate.positive.all()
        assert certificate.overlapping.any() == crossing
        assert certificate.all_valid != crossing


def test_surfaces_do_not_leave_the_heart(fitted: Personalization) -> None:
    anatomy, mesh = fitted.anatomy, fitted.mesh
    points, _, _ = sample_faces(mesh, mesh.topology.surfaces["rv_endo"], 6)
    solid = anatomy.surfaces["epi"].sample(points)[0]
    # Where the wall is a voxel thin, the fit's own error may exceed it by a little.
    assert solid[anatomy.base.plane.height(points) < -COARSE].max() < 0.1 * COARSE


@pytest.mark.parametrize("elements", [(2, 9, 8), (3, 16, 10), (2, 6, 4)])
def test_elements_are_free(sample: samples.Sample, elements: tuple[int, int, int]) -> None:
    report = heartgen.personalize(sample.mask, elements=elements).report
    assert report.options["elements"] == elements
    assert report.quality.valid
    assert report.success


def test_motion_moves_the_mesh(sample: samples.Sample, fitted: Personalization) -> None:
    rotation = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    scale, shift = 0.1, np.array([40.0, -10.0, 5.0])
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = scale * rotation, shift
    mask = sample.mask
    other = heartgen.personalize(Mask(mask.voxels, affine @ mask.affine, "moved"), lod=2)
    xi = np.random.default_rng(0).uniform(size=(20, 3))
    expected = scale * fitted.mesh.evaluate(xi) @ rotation.T + shift
    assert np.abs(other.mesh.evaluate(xi) - expected).max() < 0.05 * scale


@pytest.mark.parametrize(("order", "flips"), [((2, 0, 1), ()), ((1, 0, 2), (0, 2))])
def test_order_of_image_axes_does_not_matter(
    sample: samples.Sample,
    fitted: Personalization,
    order: tuple[int, int, int],
    flips: tuple[int, ...],
) -> None:
    voxels = sample.mask.voxels.transpose(order)
    index = np.zeros((4, 4))
    index[3, 3] = 1
    for new, old in enumerate(order):
        index[old, new] = 1
    for axis in flips:
        voxels = np.flip(voxels, axis)
        turn = np.eye(4)
        turn[axis, axis], turn[axis, 3] = -1, voxels.shape[axis] - 1
        index = index @ turn
    other = Mask(np.ascontiguousarray(voxels), sample.mask.affine @ index, "same")
    xi = np.random.default_rng(0).uniform(size=(20, 3))
    mesh = heartgen.personalize(other, lod=2).mesh
    assert np.abs(mesh.evaluate(xi) - fitted.mesh.evaluate(xi)).max() < 0.05


@settings(max_examples=4, phases=(Phase.explicit, Phase.generate))
@given(
    rv_size=st.floats(1.0, 1.25),
    rv_wall=st.floats(3.0, 6.0),
    septum=st.floats(7.0, 14.0),
    tilt=st.floats(-12.0, 12.0),
    rv_apex=st.floats(15.0, 25.0),
)
def test_analysis_recovers_what_is_true(
    rv_size: float, rv_wall: float, septum: float, tilt: float, rv_apex: float
) -> None:
    sample = samples.biv(
        COARSE, rv_size=rv_size, rv_wall=rv_wall, septum=septum, tilt=tilt, rv_apex=rv_apex
    )
    truth = sample.truth
    assert truth.rv is not None
    anatomy = analyze(sample.mask)
    right = anatomy.rv
    assert right is not None
    assert right.wall_thickness == pytest.approx(rv_wall, abs=0.5 * COARSE)
    assert right.septal_thickness == pytest.approx(septum, abs=0.75 * COARSE)
    # Voxels of 2 mm do not hold the thin horns at the insertions.
    assert right.pool_volume == pytest.approx(truth.rv.cavity_volume, rel=0.08)
    assert anatomy.pool_volume == pytest.approx(truth.cavity_volume, rel=0.05)
    assert anatomy.wall_volume == pytest.approx(truth.wall_volume, rel=0.05)
    assert abs(anatomy.frame[:3, 2] @ truth.basal_plane[1]) > np.cos(np.radians(3))
    lowest = -float(anatomy.base.plane.height(truth.rv.apex[None])[0])
    assert -right.apex_level == pytest.approx(lowest, abs=3 * COARSE)  # its tip is thin


def test_both_ventricles_can_be_demanded(sample: samples.Sample) -> None:
    auto, told = (analyze(sample.mask, ventricles=v) for v in ("auto", "biv"))
    assert told.rv is not None
    np.testing.assert_array_equal(auto.frame, told.frame)


def test_real_hearts(shared_data: Path) -> None:
    for name in ("biv/cobiveco_geo2", "animal/UCSD_heart"):
        report = heartgen.personalize(
            heartgen.read_mask(shared_data / f"{name}.nii.gz"), lod=2
        ).report
        assert report.success
        assert report.quality.valid


def test_rounded_insertion_follows_the_right_apex() -> None:
    squared, rounded = both_insertions(samples.biv(1.0).mask)
    assert apex_error(rounded) < 0.85 * apex_error(squared)
    assert rounded.report.accuracy.mean < squared.report.accuracy.mean
    assert dip(rounded) > 1.2 * dip(squared) > 0
    assert rounded.report.quality.mean > squared.report.quality.mean - 0.02
    assert rounded.report.quality.valid


def test_rounded_insertion_halves_the_error_at_a_real_right_apex(shared_data: Path) -> None:
    squared, rounded = both_insertions(
        heartgen.read_mask(shared_data / "biv_cycle" / "bivme_patient1_f01.nii.gz")
    )
    assert apex_error(rounded) < 0.5 * apex_error(squared)
    assert dip(rounded) > 1.2 * dip(squared) > 0
    assert rounded.report.quality.valid


def both_insertions(mask: Mask) -> tuple[Personalization, Personalization]:
    """The same heart with a squared and with a rounded insertion line."""
    squared = heartgen.personalize(mask, lod=3, insertion="squared")
    return squared, heartgen.personalize(mask, lod=3, insertion="rounded")


def apex_error(result: Personalization) -> float:
    """Mean error at the right ventricle's apex, mm."""
    return result.report.accuracy.by_surface["rv_apex"]


def dip(result: Personalization) -> float:
    """How far the middle of the insertion line's lowest side lies below its ends, mm."""
    mesh, septum = result.mesh, result.mesh.topology.patches["rv_septum"]
    row = mesh.topology.index[septum[:, 0], 2]
    lowest = septum[row == row.min(), 0]
    lowest = lowest[np.argsort(mesh.topology.index[lowest, 1])]
    line = mesh.evaluate(np.array([[0.0, 0.0, 1.0], [0.5, 0.0, 1.0], [1.0, 0.0, 1.0]]))[lowest]
    height = result.anatomy.to_heart(line.reshape(-1, 3))[:, 2]
    return float((height[0] + height[-1]) / 2 - height[len(height) // 2])
