"""What holds for all fields: ranges, continuity, and that they move with the heart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from heartgen.errors import InputError, MeshError
from heartgen.fields import FIELDS, heart_axes, make_fields
from heartgen.fields.catalog import FIBER, SHEET, SHEET_NORMAL
from heartgen.fields.frames import at_pole, wall_frames
from heartgen.fields.patch_coordinates import patch_of
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice, tabulate
from heartgen.mesh.connectivity import merge_coincident
from heartgen.mesh.field import MeshField
from heartgen.mesh.surface_faces import face_coefficients


def by_name(mesh: HexMesh, *names: str, **options) -> dict[str, MeshField]:
    return {field.name: field for field in make_fields(mesh, names or None, **options)}


def jump(mesh: HexMesh, values: np.ndarray, off_pole: bool = False) -> float:
    """Largest difference of values (e, 64, ...) between elements that share a lattice point."""
    shared = ~at_pole(mesh) if off_pole else np.ones(values.shape[:2], dtype=bool)
    number, first = merge_coincident(np.matmul(tabulate(lattice()), mesh.topology.generic)[shared])
    assert len(first) < len(number)
    return float(np.abs(values[shared] - values[shared][first][number]).max())


def on(mesh: HexMesh, field: MeshField, faces: np.ndarray) -> np.ndarray:
    """Values on the lattice points of faces."""
    return field.values[faces[:, :1], face_coefficients()[faces[:, 1]]]


@pytest.mark.slow
def test_coordinates_have_their_ranges_and_ends(mesh: HexMesh) -> None:
    fields = by_name(mesh, "coordinates")
    surfaces = mesh.topology.surfaces
    for name in ("transmural", "longitudinal"):
        values = fields[name].values
        assert values.min() == pytest.approx(0, abs=0.05 if name == "longitudinal" else 1e-12)
        assert values.max() == pytest.approx(1)
    assert np.abs(on(mesh, fields["transmural"], surfaces["lv_endo"])).max() < 1e-12
    assert np.abs(on(mesh, fields["transmural"], surfaces["epi"]) - 1).max() < 1e-12
    assert np.abs(on(mesh, fields["longitudinal"], surfaces["base"]) - 1).max() < 1e-12
    lowest = surfaces.get("apical_rim", mesh.topology.collapsed)
    assert not np.any(on(mesh, fields["longitudinal"], lowest))
    angle = fields["circumferential"].values[~at_pole(mesh)]
    assert np.abs(angle).max() < 2 * np.pi
    assert np.ptp(angle) > 2 * np.pi * 0.9


@pytest.mark.slow
def test_scalar_fields_are_continuous(mesh: HexMesh) -> None:
    fields = by_name(mesh)
    for name in ("transmural", "longitudinal", "curvature"):
        assert jump(mesh, fields[name].values, off_pole=name == "curvature") < 1e-9
    angle = fields["circumferential"].values
    assert jump(mesh, np.exp(1j * angle), off_pole=True) < 1e-9  # but for whole turns


def test_thickness_jumps_only_where_the_ventricles_meet(lv: HexMesh, biv: HexMesh) -> None:
    assert jump(lv, by_name(lv, "thickness")["wall thickness"].values) < 1e-9
    free = biv.topology.parts["right ventricle"]
    values = by_name(biv, "thickness")["wall thickness"].values.copy()
    assert np.median(values[free]) < 0.6 * np.median(values)
    values[free] = np.nan
    number, first = biv.topology.numbered(lattice())
    assert np.nanmax(np.abs(values.ravel() - values.ravel()[first][number.ravel()])) < 1e-9


def test_septum_lies_between_its_insertions(biv: HexMesh) -> None:
    fields = by_name(biv, "coordinates")
    septal = biv.topology.patches["rv_septum"]
    angle = on(biv, fields["circumferential"], septal)
    assert angle.min() == pytest.approx(-np.pi / 3)
    assert angle.max() == pytest.approx(np.pi / 3)
    # Away from the insertion line, the septum ends at 1 and the free wall starts at 0.
    depth = on(biv, fields["transmural"], septal)
    assert depth.max() == pytest.approx(1)
    free = on(biv, fields["transmural"], biv.topology.patches["rv_free_wall"])
    assert free.min() == pytest.approx(0)
    assert set(np.unique(fields["ventricle"].values)) == {0, 1}


def test_fields_move_with_the_heart(mesh: HexMesh) -> None:
    turn = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()
    affine = np.eye(4)
    affine[:3, :3], affine[:3, 3] = turn, [30.0, -12.0, 5.0]
    septal_direction = heart_axes(mesh).septal
    before = by_name(mesh, septal_direction=septal_direction)
    after = by_name(mesh.transformed(affine), septal_direction=turn @ septal_direction)
    for name, field in before.items():
        turns = name in (FIBER, SHEET, SHEET_NORMAL)
        values = field.values @ turn.T if turns else field.values
        assert np.abs(after[name].values - values).max() < 1e-6, name


def test_refined_mesh_has_the_same_coordinates(mesh: HexMesh) -> None:
    fine = mesh.refined(radial=2, circumferential=2, longitudinal=2)
    coarse, refined = by_name(mesh, "coordinates"), by_name(fine, "coordinates")
    corner = np.zeros((1, 3))  # the first piece of an element starts where the element does
    for name in ("longitudinal", "circumferential"):
        one, other = coarse[name].evaluate(corner), refined[name].evaluate(corner)[::8]
        assert np.abs(np.exp(1j * one) - np.exp(1j * other)).max() < 0.005


@pytest.mark.parametrize("name", ["patched", "biv_patched"])
def test_directions_turn_around_the_middle_of_a_patch(name: str, request) -> None:
    mesh = request.getfixturevalue(name)
    patch, axes = patch_of(mesh.topology), heart_axes(mesh)
    assert patch.side == 3
    points = mesh.lagrange_points()[patch.elements]
    away = patch.radius(lattice()) > 0.5
    center = points.reshape(-1, 3).mean(0)
    around = np.cross(axes.longitudinal, points - center)
    around /= np.linalg.norm(around, axis=-1, keepdims=True)
    found = wall_frames(mesh)[patch.elements][..., 0]
    cosine = np.einsum("eqx,eqx->eq", found, around)[away]
    assert cosine.min() > 0.7
    assert cosine.mean() > 0.95


def test_the_patch_goes_on_where_the_ring_ends(patched: HexMesh) -> None:
    fields = by_name(patched, "coordinates")
    patch = patch_of(patched.topology)
    level = fields["longitudinal"].values[patch.elements]
    assert 0 < level.min() < 0.05
    assert level.max() == pytest.approx(
        np.delete(fields["longitudinal"].values, patch.elements, 0).min()
    )
    axes = heart_axes(patched)
    outer = patch.radius(lattice()) > 0.6
    angle = fields["circumferential"].values[patch.elements][..., 0][outer]
    true = axes.angle(patched.lagrange_points()[patch.elements][outer])
    assert np.abs(np.angle(np.exp(1j * (angle - true)))).mean() < np.radians(25)


def test_names_choose_and_wrong_ones_are_refused(lv: HexMesh) -> None:
    assert set(by_name(lv, "aha")) == {"aha segment"}
    assert len(by_name(lv)) == sum(len(make_fields(lv, [name])) for name in FIELDS)
    with pytest.raises(InputError, match="choose among coordinates, aha, fibers"):
        make_fields(lv, ["strain"])


@pytest.mark.parametrize("direction", [(0.0, 0.0, 1.0), (0.0, 0.0, 0.0), (np.nan, 0.0, 0.0)])
def test_direction_that_tells_nothing_is_refused(land: HexMesh, direction) -> None:
    with pytest.raises(MeshError, match="does not tell where the septum is"):
        make_fields(land, septal_direction=direction)


def test_axes_of_a_ventricle_alone_are_assumed_or_given(land: HexMesh) -> None:
    axes = heart_axes(land)
    assert axes.known == "assumed"
    assert axes.septal == pytest.approx([-(0.5**0.5), -(0.5**0.5), 0], abs=1e-6)
    assert axes.length == pytest.approx(22.0, rel=1e-3)  # 17 mm below the equator, 5 above
    assert axes.longitudinal == pytest.approx([0, 0, 1], abs=1e-6)
    given = heart_axes(land, (0.0, 3.0, 1.0))
    assert given.known == "given"
    assert given.septal == pytest.approx([0, 1, 0], abs=1e-6)


def test_axes_of_both_ventricles_are_those_of_the_phantom(biv: HexMesh, biv_sample) -> None:
    axes, truth = heart_axes(biv), biv_sample.truth
    assert axes.known == "measured"
    assert axes.longitudinal @ truth.long_axis > np.cos(np.radians(4))
    low, high = truth.rv.insertions - axes.apex
    middle = low / np.linalg.norm(low) + high / np.linalg.norm(high)
    middle -= (middle @ axes.longitudinal) * axes.longitudinal
    assert axes.septal @ middle / np.linalg.norm(middle) > np.cos(np.radians(8))


def test_a_hole_at_the_apex_is_where_the_axis_ends(land: HexMesh) -> None:
    row = land.topology.index[:, 2]
    surfaces = dict(land.topology.surfaces)
    surfaces["lv_endo"] = surfaces["lv_endo"][row[surfaces["lv_endo"][:, 0]] > 0]
    holed = HexMesh(land.dofs, replace(land.topology, surfaces=surfaces))
    axes = heart_axes(holed)
    edge = land.evaluate(np.array([[0.0, 1.0, 0.0]]))[row == 0, 0, 2].mean()
    assert axes.apex == pytest.approx([0, 0, edge], abs=1e-3)
