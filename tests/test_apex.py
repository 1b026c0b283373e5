"""The three kinds of apex through the whole pipeline, and out to other people's readers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import heartgen
from heartgen import samples
from heartgen.anatomy import Anatomy, analyze, cone_through
from heartgen.errors import HeartgenError, InputError
from heartgen.formats import write_exf, write_vtu
from heartgen.images import Mask
from heartgen.mesh.validity import certify
from heartgen.result import Personalization

pytestmark = pytest.mark.slow

COARSE = 2.0
"""Voxel size that keeps the tests quick, mm."""


@pytest.fixture(scope="module")
def mask() -> Mask:
    return samples.ideal_cup(COARSE).mask


@pytest.fixture(scope="module")
def anatomy(mask: Mask) -> Anatomy:
    return analyze(mask)


@pytest.fixture(scope="module")
def fitted(mask: Mask, anatomy: Anatomy) -> dict[str, Personalization]:
    return {
        apex: heartgen.personalize(mask, apex=apex, anatomy=anatomy)  # type: ignore[arg-type]
        for apex in ("collapsed", "hole", "patch")
    }


@pytest.fixture(scope="module")
def both() -> dict[str, Personalization]:
    mask = samples.biv(COARSE).mask
    known = analyze(mask)
    return {
        apex: heartgen.personalize(mask, apex=apex, anatomy=known)  # type: ignore[arg-type]
        for apex in ("hole", "patch")
    }


def test_every_apex_gives_a_valid_mesh_and_better_elements_than_a_pole(
    fitted: dict[str, Personalization],
) -> None:
    for apex, result in fitted.items():
        report = result.report
        assert report.quality.valid
        assert report.success
        assert report.options["apex"] == apex
        assert report.accuracy.mean < 0.15 * COARSE
        assert certify(result.template).all_valid
    quality = {apex: result.report.quality.apical_row for apex, result in fitted.items()}
    assert quality["collapsed"] < min(quality["hole"], quality["patch"])
    assert fitted["patch"].mesh.n_elements == 9 + 5 * 12


def test_both_ventricles_with_every_apex(both: dict[str, Personalization]) -> None:
    for result in both.values():
        assert result.report.quality.valid
        assert result.report.success
        assert result.report.accuracy.mean < 0.2 * COARSE
    assert both["patch"].mesh.n_elements == 2 * (9 + 7 * 12)
    assert set(both["hole"].mesh.topology.surfaces) == {
        "lv_endo",
        "rv_endo",
        "epi",
        "base",
        "apical_rim",
    }


def test_the_paper_s_four_steps_with_every_apex(mask: Mask, anatomy: Anatomy) -> None:
    for apex in ("hole", "patch"):
        report = heartgen.personalize(mask, apex=apex, optimize=False, anatomy=anatomy).report
        assert report.quality.valid
        assert report.success


def test_a_hole_keeps_its_radius_and_is_left_out_of_the_error(
    mask: Mask, anatomy: Anatomy, fitted: dict[str, Personalization]
) -> None:
    result = heartgen.personalize(mask, apex="hole", hole_radius=8.0, anatomy=anatomy)
    for radius, found in ((8.0, result), (anatomy.radius / 4, fitted["hole"])):
        elements = found.mesh.topology.surfaces["apical_rim"][:, 0]
        rim = found.mesh.evaluate(np.array([[0.0, 0.0, 0.0]]))[elements, 0]
        distance = np.linalg.norm(rim - rim.mean(0), axis=1)
        assert distance.mean() == pytest.approx(radius, rel=0.05)
        assert np.ptp(distance) < 0.1 * radius
        assert found.report.accuracy.by_surface["apical_rim"] < 0.15 * COARSE
        assert found.report.accuracy.max < 2 * COARSE
        assert any("apical hole" in f.message for f in found.report.findings)
    assert result.anatomy.wall_volume < fitted["hole"].anatomy.wall_volume < anatomy.wall_volume


def test_an_anatomy_with_a_hole_serves_for_another_apex(
    mask: Mask, fitted: dict[str, Personalization]
) -> None:
    again = heartgen.personalize(mask, anatomy=fitted["hole"].anatomy)
    np.testing.assert_array_equal(again.mesh.dofs, fitted["collapsed"].mesh.dofs)
    assert not any("apical hole" in f.message for f in again.report.findings)


def test_a_cone_is_recovered_from_its_rims() -> None:
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], -1)
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    endo, epi = 5 * ring @ turn.T + 3, (7 * ring - [0, 0, 8]) @ turn.T + 3
    cone = cone_through(endo, epi)
    assert cone.radius == pytest.approx(5)
    np.testing.assert_allclose(cone.depth(np.concatenate([endo, epi])), 0, atol=1e-12)
    assert cone.depth(np.full((1, 3), 3.0))[0] == pytest.approx(5 / np.hypot(1, 0.25))
    far = np.array([0, 0, 40.0]) @ turn.T + 3  # the cone has closed long before
    assert cone.depth(far[None])[0] < 0


@pytest.mark.parametrize("kind", ["left", "both"])
@pytest.mark.parametrize("apex", ["hole", "patch"])
def test_zinc_reads_the_same_places(
    kind: str, apex: str, fitted: Any, both: Any, tmp_path: Path
) -> None:
    context_of = pytest.importorskip("cmlibs.zinc.context").Context
    mesh = (fitted if kind == "left" else both)[apex].mesh
    write_exf(mesh, tmp_path / "mesh.exf")
    context = context_of("test")
    region = context.getDefaultRegion()
    assert region.readFile(str(tmp_path / "mesh.exf")) == 1
    assert context.getLogger().getNumberOfMessages() == 0
    module = region.getFieldmodule()
    coordinates, cache = module.findFieldByName("coordinates"), module.createFieldcache()
    xi = np.random.default_rng(0).random((6, 3))
    expected = mesh.evaluate(xi)
    solid = module.findMeshByDimension(3)
    assert solid.getSize() == mesh.n_elements
    for e in range(mesh.n_elements):
        for q, place in enumerate(xi):
            cache.setMeshLocation(solid.findElementByIdentifier(e + 1), place.tolist())
            _, found = coordinates.evaluateReal(cache, 3)
            np.testing.assert_allclose(found, expected[e, q], atol=1e-9)
    # Faces are shared: all but the outer ones lie between two elements.
    inner = (6 * mesh.n_elements - len(mesh.topology.external)) // 2
    faces = module.findMeshByDimension(2)
    assert faces.getSize() == inner + len(mesh.topology.external)
    if apex == "hole":
        group = module.findFieldByName("apical hole").castGroup()
        assert group.getMeshGroup(faces).getSize() == len(mesh.topology.surfaces["apical_rim"])


@pytest.mark.parametrize("apex", ["hole", "patch"])
def test_vtk_reads_the_same_places(
    apex: str, fitted: dict[str, Personalization], tmp_path: Path
) -> None:
    pyvista = pytest.importorskip("pyvista")
    mesh = fitted[apex].mesh
    write_vtu(mesh, tmp_path / "mesh.vtu")
    grid = pyvista.read(tmp_path / "mesh.vtu")
    ours = mesh.lagrange_points().reshape(-1, 3)
    where = np.asarray(grid.points)[grid.cells.reshape(mesh.n_elements, -1)[:, 1:]]
    for e, points in enumerate(where):
        ordered = points[np.lexsort(np.round(points, 6).T)]
        mine = ours[64 * e : 64 * (e + 1)]
        np.testing.assert_allclose(ordered, mine[np.lexsort(np.round(mine, 6).T)], atol=1e-6)


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"apex": "open"}, "collapsed, hole or patch"),
        ({"hole_radius": 4.0}, "no hole of 4.0 mm"),
        ({"apex": "patch", "hole_radius": 4.0}, "no hole"),
        ({"apex": "hole", "hole_radius": -1.0}, "positive"),
        ({"apex": "hole", "hole_radius": float("nan")}, "positive"),
        ({"apex": "patch", "elements": (1, 10, 6)}, "multiple of 4"),
    ],
)
def test_an_apex_that_cannot_be_is_refused(choices: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        heartgen.Options(**choices)


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        ({"apex": "hole", "hole_radius": 40.0}, "too wide"),
        ({"apex": "patch", "elements": (1, 12, 1)}, "at least 2 along"),
    ],
)
def test_an_apex_that_does_not_fit_the_heart_is_refused(
    choices: dict[str, Any], message: str, mask: Mask, anatomy: Anatomy
) -> None:
    with pytest.raises(HeartgenError, match=message):
        heartgen.personalize(mask, anatomy=anatomy, **choices)
