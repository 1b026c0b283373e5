"""Fibers: frames, and the analytic rule of a published benchmark."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.solids import land_fibers
from heartgen.errors import InputError
from heartgen.fields import FiberRule, fiber_frames, rule_from_text
from heartgen.fields.fibers import helix_angle
from heartgen.fields.frames import frames_at, wall_frames
from heartgen.fields.wall import wall_of
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.quadrature import gauss_cube
from heartgen.mesh.surface_faces import face_coefficients
from tests.fields.test_fields import jump

TILTED = FiberRule(transverse=(20.0, -10.0), sheet=(-65.0, 25.0))


@pytest.mark.slow
@pytest.mark.parametrize("rule", [FiberRule(), TILTED], ids=["default", "tilted"])
def test_frames_are_orthonormal_and_right_handed(mesh: HexMesh, rule: FiberRule) -> None:
    for frames in (fiber_frames(mesh, rule), wall_frames(mesh)):
        assert np.abs(frames.swapaxes(-1, -2) @ frames - np.eye(3)).max() < 1e-12
        assert np.abs(np.linalg.det(frames) - 1).max() < 1e-12


def test_frames_are_continuous_off_the_pole(mesh: HexMesh) -> None:
    assert jump(mesh, fiber_frames(mesh, TILTED), off_pole=True) < 1e-9
    assert jump(mesh, wall_frames(mesh), off_pole=True) < 1e-9


def test_frames_turn_slowly_within_elements(mesh: HexMesh) -> None:
    frames = wall_frames(mesh)[mesh.topology.index[:, 2] > 0].reshape(-1, 4, 4, 4, 3, 3)
    for axis in (1, 2, 3):
        neighbors = np.moveaxis(frames, axis, 0)
        turned = np.einsum("n...xd,n...xd->n...", neighbors[1:], neighbors[:-1])
        angle = np.degrees(np.arccos(np.clip((turned - 1) / 2, -1, 1)))
        assert np.percentile(angle, 99) < 45  # degrees in a third of an element


def test_directions_point_around_up_and_outward(land: HexMesh) -> None:
    xi = gauss_cube((2, 2, 2))[0]
    points, frames = land.evaluate(xi), frames_at(land, xi)
    radial = points * [1, 1, 0]
    radial /= np.linalg.norm(radial, axis=-1, keepdims=True)
    around = np.cross([0, 0, 1.0], radial)
    assert np.einsum("eqx,eqx->eq", frames[..., 0], around).min() > 0.99
    assert frames[..., 2, 1].min() > 0
    assert np.einsum("eqx,eqx->eq", frames[..., 2], radial).min() > 0


def test_pole_has_directions_of_its_neighborhood(land: HexMesh) -> None:
    xi = lattice()
    pole = xi[:, 1] == 0
    near = xi[pole]
    near[:, 1] = 1e-3
    apical = land.topology.index[:, 2] == 0
    at, beside = wall_frames(land)[apical][:, pole], frames_at(land, near)[apical]
    assert np.abs(at - beside).max() < 0.02


def test_fibers_of_the_ideal_ellipsoid_follow_the_analytic_rule(land: HexMesh) -> None:
    fibers = fiber_frames(land, FiberRule(helix=(90.0, -90.0)))[..., 0]
    away = land.topology.index[:, 2] > 0
    expected = land_fibers(land.lagrange_points()[away].reshape(-1, 3))
    cosine = np.einsum("nx,nx->n", fibers[away].reshape(-1, 3), expected)
    angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
    assert angle.mean() < 0.3
    assert angle.max() < 1.5


def test_angles_at_the_surfaces_are_those_of_the_rule(lv: HexMesh) -> None:
    rule = FiberRule(helix=(50.0, -70.0))
    frames, wall = fiber_frames(lv, rule), wall_frames(lv)
    for surface, angle in (("lv_endo", 50.0), ("epi", -70.0)):
        faces = lv.topology.surfaces[surface]
        at = faces[:, :1], face_coefficients()[faces[:, 1]]
        local = np.einsum("...xd,...x->...d", wall[at], frames[at][..., 0])
        assert np.degrees(np.arctan2(local[..., 1], local[..., 0])) == pytest.approx(angle)
        assert np.abs(local[..., 2]).max() < 1e-12


def test_transverse_and_sheet_angles_turn_about_the_right_axes(lv: HexMesh) -> None:
    wall = wall_frames(lv)
    frames = fiber_frames(lv, FiberRule((0, 0), (0, 0), transverse=(15, 15), sheet=(30, 30)))
    local = np.einsum("...xd,...xf->...df", wall, frames)
    assert np.degrees(np.arcsin(local[..., 2, 0])) == pytest.approx(15)
    # The sheet direction turns about the fiber, from the transmural to the longitudinal one.
    assert local[..., 1, 1] == pytest.approx(np.sin(np.radians(30)))


def test_right_ventricle_has_its_own_angles_all_around(biv: HexMesh) -> None:
    rule = FiberRule()
    wall = wall_of(biv)
    helix = helix_angle(wall, rule)
    inside = wall.right == 1
    for patch, angle in (("rv_septum", -90.0), ("rv_free_wall", 90.0)):
        faces = biv.topology.patches[patch]
        at = faces[:, :1], face_coefficients()[faces[:, 1]]
        assert inside[at].any()
        assert helix[at][inside[at]] == pytest.approx(angle)
    assert helix[wall.septum].max() == pytest.approx(60)
    assert jump(biv, helix[..., None]) < 1e-9


@pytest.mark.parametrize("pair", [(60.0,), (np.nan, 0.0), (0.0, 270.0)])
def test_angles_that_are_none_are_refused(pair) -> None:
    with pytest.raises(InputError, match="right helix angles"):
        FiberRule(right_helix=pair)


def test_rule_is_read_from_text() -> None:
    rule = rule_from_text("helix=50/-70, sheet=-65/25")
    assert rule == FiberRule(helix=(50.0, -70.0), sheet=(-65.0, 25.0))
