"""The template of an ellipsoid is that ellipsoid, whatever its apex."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.integrate import quad
from scipy.linalg import expm

import heartgen
from heartgen.anatomy import Anatomy, analyze
from heartgen.fit_findings import template_limited
from heartgen.images import Mask
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.surface_faces import enclosed_volume, sample_faces
from heartgen.options import Apex
from heartgen.templates.ellipsoid import STRAIGHT, TruncatedEllipsoid, _positive, fit_ellipsoid
from heartgen.templates.lv import ellipsoid_mesh
from tests.templates.shapes import distance, radius

HOLE = 5.5
"""mm."""

SURFACES = ("lv_endo", "epi")

CUP = TruncatedEllipsoid(np.zeros(2), np.zeros(2), 22 * np.eye(2), 70.0, 0.5, 10.0, 10.0)
BENT = TruncatedEllipsoid(
    center=np.array([1.0, -2.0]),
    lean=np.array([0.05, -0.03]),
    section=np.array([[24.0, 1.5], [1.5, 20.0]]),
    axis=70.0,
    cut=0.5,
    wall=10.0,
    apex=6.0,
    taper=(-0.2, -0.1),
    bend=np.array([1e-3, -5e-4]),
)
BLUNT = TruncatedEllipsoid(
    np.zeros(2), np.zeros(2), 25 * np.eye(2), 50.0, 0.2, 9.0, 5.0, taper=(0.25, 0.2)
)
SWAYING = replace(CUP, sway=np.array([[1.0, 0], [0.1, 0.05], [2e-3, 2e-3], [1e-5, 1e-5], [0, 0]]))
SHAPES = {"cup": CUP, "bent": BENT, "blunt": BLUNT, "swaying": SWAYING}


def polar_at(shape: TruncatedEllipsoid, height: float, depth: int) -> float:
    return float(np.arccos(-(height + shape.cut * shape.axis) / shape.semi_axes(depth)[1]))


def inside(shape: TruncatedEllipsoid, depth: int, lowest: float = 0.0) -> float:
    """Volume within a surface above a polar angle, mm^3: lean and bend move sections sideways."""
    section, axis, end = shape.semi_axes(depth)

    def slab(polar: float) -> float:
        return float(shape.profile(np.array([polar]), depth)[0][0] ** 2 * axis * np.sin(polar))

    return float(np.pi * np.linalg.det(section) * quad(slab, lowest, end)[0])


def wall_volume(shape: TruncatedEllipsoid, mesh: HexMesh) -> float:
    """Volume of the wall, mm^3, without what a hole takes away: a frustum between its rims."""
    rim = mesh.topology.surfaces.get("apical_rim")
    if rim is None:
        return inside(shape, 1) - inside(shape, 0)
    ends = mesh.evaluate(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]]))[rim[:, 0], :, 2].mean(0)
    polar = [polar_at(shape, float(z), depth) for depth, z in enumerate(ends)]
    sections = [shape.semi_axes(d)[0] * shape.profile(np.array([polar[d]]), d)[0] for d in (0, 1)]

    def area(share: float) -> float:
        mixed = (1 - share) * sections[0] + share * sections[1]
        return float(np.pi * np.linalg.det(mixed))

    hole = (ends[0] - ends[1]) * quad(area, 0, 1)[0]
    return inside(shape, 1, polar[1]) - inside(shape, 0, polar[0]) - float(hole)


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole", "patch"])
@pytest.mark.parametrize("name", SHAPES)
def test_the_template_is_the_ellipsoid(name: str, apex: Apex) -> None:
    shape = SHAPES[name]
    mesh = ellipsoid_mesh(shape, (1, 12, 6), apex=apex, hole=HOLE)
    assert_allclose(enclosed_volume(mesh), wall_volume(shape, mesh), rtol=1e-3)
    for depth, surface in enumerate(SURFACES):
        points, _, weights = sample_faces(mesh, mesh.topology.surfaces[surface], 6)
        off = distance(shape, points, depth) / radius(shape, depth)
        assert off.max() < 5e-3
        assert np.average(off, weights=weights) < 5e-4


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole"])
@pytest.mark.parametrize("elements", [(1, 8, 4), (2, 12, 8), (1, 24, 12)])
def test_with_any_number_of_elements(elements: tuple[int, int, int], apex: Apex) -> None:
    mesh = ellipsoid_mesh(BENT, elements, apex=apex, hole=HOLE)
    assert_allclose(enclosed_volume(mesh), wall_volume(BENT, mesh), rtol=1e-3)
    for depth, surface in enumerate(SURFACES):
        points, _, _ = sample_faces(mesh, mesh.topology.surfaces[surface], 6)
        assert distance(BENT, points, depth).max() < 6e-3 * radius(BENT, depth)


@pytest.mark.slow
@pytest.mark.parametrize(("apex", "least"), [("collapsed", 0.7), ("hole", 0.8)])
def test_that_costs_no_quality(apex: Apex, least: float) -> None:
    assert jacobian_ratio(ellipsoid_mesh(CUP, (1, 12, 6), apex=apex, hole=HOLE)).mean() > least


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole"])
def test_mesh_lines_are_meridians_and_parallels(apex: Apex) -> None:
    """The lines of nodes that run along keep their angle, and those around keep their height."""
    mesh = ellipsoid_mesh(CUP, (1, 12, 6), apex=apex, hole=HOLE)
    t = np.linspace(0, 1, 7)
    for face in (0.0, 1.0):
        along = mesh.evaluate(np.stack([0 * t, t, 0 * t + face], -1))
        expected = 2 * np.pi / 12 * mesh.topology.index[:, 1]
        sin, cos = np.sin(expected)[:, None], np.cos(expected)[:, None]
        away = cos * along[..., 1] - sin * along[..., 0]
        assert np.abs(away).max() < 1e-9
        around = mesh.evaluate(np.stack([t, 0 * t + 1, 0 * t + face], -1))
        assert np.ptp(around[..., 2], axis=1).max() < 1e-9
        assert np.ptp(np.linalg.norm(around[..., :2], axis=-1), axis=1).max() < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole"])
def test_the_wall_may_be_linear_across(apex: Apex) -> None:
    mesh = ellipsoid_mesh(CUP, (2, 12, 6), graded=False, apex=apex, hole=HOLE)
    ends = mesh.evaluate(np.array([[0.3, 0.6, 0.0], [0.3, 0.6, 1.0]]))
    inner, outer = ends[:72, 0], ends[72:, 1]
    assert_allclose(ends[:72, 1], (inner + outer) / 2, atol=1e-9)


@pytest.mark.slow
@given(st.lists(st.floats(-2, 2), min_size=3, max_size=3))
def test_every_section_that_a_fit_may_try_is_positive_definite(p: list[float]) -> None:
    section = _positive(np.array(p))
    assert_allclose(
        section, expm(np.array([[p[0] + p[1], p[2]], [p[2], p[0] - p[1]]])), rtol=1e-9, atol=1e-9
    )
    assert np.linalg.eigvalsh(section).min() > 0


def swaying_cup(sideways: float) -> Mask:
    """A thick cup, 2 mm voxels, whose slender pool leaves the long axis to one side and back."""
    place = np.stack(np.meshgrid(*(np.arange(-40, 42, 2.0),) * 2, np.arange(-80, 14, 2.0)), -1)
    place = place.transpose(1, 0, 2, 3)
    x, y, z = np.moveaxis(place, -1, 0)
    middle = sideways * np.sin(2 * np.pi * z / 100)
    pool = ((x - middle) ** 2 + y**2) / 9.0**2 + np.minimum(z, 0) ** 2 / 68.0**2 < 1
    heart = (x**2 + y**2) / 25.0**2 + np.minimum(z, 0) ** 2 / 78.0**2 < 1
    affine = np.diag([2.0, 2.0, 2.0, 1.0])
    affine[:3, 3] = place[0, 0, 0]
    return heartgen.mask_from_array(heart & ~pool & (z < 0), affine)


def off_axis(anatomy: Anatomy, shape: TruncatedEllipsoid) -> float:
    """How far the endocardium's pole lies outside the pool, mm; inside is below zero."""
    pole = shape.points(np.zeros(1), np.full(1, 0.3), 0).mean(axis=0, keepdims=True)
    return float(anatomy.surfaces["lv_endo"].sample(anatomy.to_world(pole))[0][0])


@pytest.mark.slow
def test_the_endocardium_follows_a_pool_that_leaves_the_axis() -> None:
    anatomy = analyze(swaying_cup(7.0))
    shape = fit_ellipsoid(anatomy)
    assert shape.sway.any()
    assert off_axis(anatomy, shape) < off_axis(anatomy, replace(shape, sway=STRAIGHT)) - 1
    report = heartgen.personalize(swaying_cup(7.0), lod=1).report
    assert report.success
    assert report.accuracy.by_surface["lv_endo"] < 0.5


@pytest.mark.slow
def test_one_that_keeps_to_it_has_an_ellipsoid_alone() -> None:
    assert not fit_ellipsoid(analyze(swaying_cup(1.0))).sway.any()


@pytest.mark.slow
def test_what_an_ellipsoid_cannot_follow_is_told() -> None:
    assert fit_ellipsoid(analyze(swaying_cup(0.0))).limited == ()
    # A cone, whose tip is sharper than that of any of these.
    place = np.stack(np.meshgrid(*[np.arange(-44, 46, 2.0)] * 2, np.arange(-100, 6, 2.0)), -1)
    x, y, z = np.moveaxis(place.transpose(1, 0, 2, 3), -1, 0)
    radius = np.hypot(x, y)
    cone = (radius < 0.4 * (z + 96)) & (radius > 0.4 * (z + 76)) & (z < 0)
    mask = heartgen.mask_from_array(cone, np.diag([2.0, 2.0, 2.0, 1.0]))
    assert "pointedness" in fit_ellipsoid(analyze(mask)).limited
    (told,) = template_limited(("pointedness",))
    assert "pointedness" in told.message
    assert not told.serious
