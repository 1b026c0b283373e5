"""Fairness: what lines of the mesh there are, and how they turn where the answer is known."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import heartgen
from heartgen import samples
from heartgen.anatomy import Anatomy, analyze
from heartgen.fairness import CIRCUMFERENTIAL, LONGITUDINAL, assess_fairness, mesh_lines
from heartgen.formats.assembled import NamedSets, assembled
from heartgen.mesh import HexMesh
from heartgen.mesh.bases import lagrange_extraction
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.biventricular_topology import RvAttachment, biventricular_topology
from heartgen.mesh.connectivity import corner_nodes, merge_coincident
from heartgen.options import Apex
from heartgen.result import Personalization
from heartgen.templates import lv_template
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh

COARSE = 2.0
"""Voxel size that keeps the tests quick, mm."""

SHAPE = (1, 12, 6)

APEXES: tuple[Apex, ...] = ("collapsed", "hole", "patch")

WAVES, PER_WAVE, HIGH = 2, 10, 3
"""Of the plate: waves along it, elements in each, elements across."""


@pytest.fixture(scope="module")
def round_cup() -> TruncatedEllipsoid:
    """A body of revolution."""
    return TruncatedEllipsoid(
        center=np.zeros(2),
        lean=np.zeros(2),
        section=20 * np.eye(2),
        axis=50.0,
        cut=0.4,
        wall=10.0,
        apex=8.0,
        taper=(0.0, 0.0),
        bend=np.zeros(2),
    )


@pytest.fixture(scope="module")
def anatomy() -> Anatomy:
    return analyze(samples.ideal_cup(COARSE).mask)


@pytest.fixture(scope="module")
def both() -> Personalization:
    return heartgen.personalize(samples.biv(COARSE).mask)


def disturbed(mesh: HexMesh, size: float = 0.3) -> HexMesh:
    noise = np.random.default_rng(3).standard_normal(mesh.dofs.shape)
    return mesh.with_dofs(mesh.dofs + size * noise)


def without_row(mesh: HexMesh, row: int) -> HexMesh:
    """The mesh, of whose surfaces a row of elements does not count."""
    index = mesh.topology.index
    surfaces = {n: f[index[f[:, 0], 2] != row] for n, f in mesh.topology.surfaces.items()}
    return HexMesh(mesh.dofs, replace(mesh.topology, surfaces=surfaces))


def wriggles(mesh: HexMesh, direction: int) -> np.ndarray:
    lines = mesh_lines(mesh)
    return np.sort(lines.wriggle[lines.direction == direction])


def counted(mesh: HexMesh) -> tuple[int, int]:
    """Lines around, lines along."""
    direction = mesh_lines(mesh).direction
    return int(np.sum(direction == CIRCUMFERENTIAL)), int(np.sum(direction == LONGITUDINAL))


def plate(amplitude: float, radius: float) -> HexMesh:
    """A plate, rolled to a cylinder; lines along it are sines ``amplitude sin(x)``, x in mm."""
    around = WAVES * PER_WAVE
    step = np.array([2 * np.pi / PER_WAVE, 1.0, 0.1])
    place = np.array([(i, j, 0) for j in range(HIGH) for i in range(around)])
    flat = (place[:, None] + lattice()).reshape(-1, 3) * step
    number, first = merge_coincident(flat)
    x, y, depth = flat[first].T
    height = y + amplitude * np.sin(x)
    angle, away = x / radius, radius + depth
    points = np.stack([away * np.sin(angle), height, away * np.cos(angle)], -1)
    extraction = lagrange_extraction(number, len(first))
    index = place[:, [2, 0, 1]]
    nodes = corner_nodes(extraction)
    mesh = assembled(
        points, extraction, nodes, np.ones(len(points)), "lagrange", index, NamedSets({}, {}, {})
    )
    inner = np.stack([np.arange(len(place)), np.full(len(place), 4)], -1)
    return HexMesh(mesh.dofs, replace(mesh.topology, surfaces={"lv_endo": inner}))


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole"])
def test_meridians_and_circles_of_latitude_have_no_wriggle(
    round_cup: TruncatedEllipsoid, apex: Apex
) -> None:
    mesh = ellipsoid_mesh(round_cup, SHAPE, apex=apex, hole=5.0)
    assert wriggles(mesh, LONGITUDINAL).max() < 1e-6
    assert wriggles(mesh, CIRCUMFERENTIAL).max() < 0.5


@pytest.mark.parametrize("radius", [6.0, 1e6])
@pytest.mark.parametrize("amplitude", [0.05, 0.4, 1.0])
def test_waves_on_a_plane_and_on_a_cylinder_turn_as_their_tangents_do(
    amplitude: float, radius: float
) -> None:
    # On what can be unrolled, k_g ds is the change of the tangent's angle atan(a cos x), which
    # swings by 2 atan(a) twice a wave and ends where it began.
    mesh = plate(amplitude, radius)
    assert counted(mesh) == (HIGH + 1, WAVES * PER_WAVE + 1)
    expected = WAVES * 4 * np.degrees(np.arctan(amplitude))
    assert wriggles(mesh, CIRCUMFERENTIAL) == pytest.approx(expected, rel=0.01)
    assert wriggles(mesh, LONGITUDINAL) == pytest.approx(0, abs=1e-5)


@pytest.mark.slow
@settings(max_examples=15)
@given(
    turn=st.tuples(*3 * [st.floats(-3, 3)]),
    shift=st.tuples(*3 * [st.floats(-200, 200)]),
    scale=st.sampled_from([0.01, 1.0, 30.0]),
    mirror=st.booleans(),
    apex=st.sampled_from(APEXES),
)
def test_pose_scale_and_side_do_not_matter(
    round_cup: TruncatedEllipsoid,
    turn: tuple[float, ...],
    shift: tuple[float, ...],
    scale: float,
    mirror: bool,
    apex: Apex,
) -> None:
    mesh = disturbed(ellipsoid_mesh(round_cup, SHAPE, apex=apex, hole=5.0))
    affine = np.eye(4)
    side = np.diag([-1.0 if mirror else 1.0, 1.0, 1.0])
    affine[:3, :3] = scale * Rotation.from_rotvec(turn).as_matrix() @ side
    affine[:3, 3] = shift
    there, here = (asdict(assess_fairness(m)) for m in (mesh.transformed(affine), mesh))
    assert there == pytest.approx(here, abs=1e-3)


@pytest.mark.parametrize("apex", APEXES)
def test_lines_stay_when_elements_are_split(round_cup: TruncatedEllipsoid, apex: Apex) -> None:
    mesh = disturbed(ellipsoid_mesh(round_cup, SHAPE, apex=apex, hole=5.0))
    deeper = mesh.refined(radial=2)
    for direction in (CIRCUMFERENTIAL, LONGITUDINAL):
        assert wriggles(deeper, direction) == pytest.approx(wriggles(mesh, direction), abs=1e-6)
    if apex != "patch":  # within which either direction makes new lines of either kind
        split = mesh.refined(circumferential=3), mesh.refined(longitudinal=3)
        for direction, finer in enumerate(split):
            ours = wriggles(mesh, direction)
            assert wriggles(finer, direction) == pytest.approx(ours, rel=0.02, abs=0.1)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(1, 12, 6), (3, 8, 4)])
def test_every_apex_has_its_lines(
    round_cup: TruncatedEllipsoid, shape: tuple[int, int, int]
) -> None:
    _, around, along = shape
    side = around // 4
    expected: dict[Apex, tuple[int, int]] = {
        "collapsed": (2 * along, 2 * around),
        "hole": (2 * (along + 1), 2 * around),
        # The border of the patch is a ring; a line along it goes on in the column where it ends.
        "patch": (2 * (along + side - 1), 2 * around),
    }
    for apex, number in expected.items():
        mesh = ellipsoid_mesh(round_cup, shape, apex=apex, hole=5.0)
        assert counted(mesh) == number, apex


@pytest.mark.parametrize("apex", ["collapsed", "hole"])
def test_both_ventricles_have_their_lines(apex: Apex) -> None:
    shape, opening = (2, 12, 8), RvAttachment(5, 3, 1)
    topology = biventricular_topology(shape, opening, apex=apex)
    random = np.random.default_rng(1).standard_normal((topology.extraction.shape[1], 3))
    _, around, along = shape
    rows, columns = along - opening.row, opening.columns
    # Septum and free wall have the insertion line in common.
    right = (2 * rows + 1, 2 * (columns - 1) + 2)
    rings = along + (apex == "hole")
    assert counted(HexMesh(random, topology)) == (2 * rings + right[0], 2 * around + right[1])


@pytest.mark.slow
def test_lines_are_chains_of_edges(both: Personalization) -> None:
    lines, mesh = mesh_lines(both.mesh), both.mesh
    element, face, direction, end = lines.edges.T
    xi = np.zeros((2, len(element), 3))
    xi[:, :, 2] = face - 4
    for side in (0, 1):
        xi[side, np.arange(len(element)), direction] = side
        xi[side, np.arange(len(element)), 1 - direction] = end
    start, stop = (
        np.array([mesh.evaluate(x[None])[e, 0] for e, x in zip(element, ends, strict=True)])
        for ends in xi
    )
    within = lines.line[1:] == lines.line[:-1]
    assert np.abs(stop[:-1] - start[1:])[within].max() < 1e-9
    assert np.all(direction[1:][within] == direction[:-1][within])
    assert np.all(lines.turning >= np.abs(lines.net) - 1e-9)
    assert len(lines.wriggle) == lines.n_lines == len(lines.direction)


@pytest.mark.slow
def test_basis_and_files_do_not_matter(both: Personalization, tmp_path: Path) -> None:
    expected = pytest.approx(asdict(assess_fairness(both.mesh)), abs=0.02)
    assert asdict(assess_fairness(both.mesh.to_lagrange())) == expected
    assert asdict(assess_fairness(both.mesh.to_lagrange().to_hermite())) == expected
    for name in ("mesh.vtu", "mesh.exf"):
        heartgen.write_mesh(both.mesh, tmp_path / name)
        assert asdict(assess_fairness(heartgen.read_mesh(tmp_path / name))) == expected


@pytest.mark.slow
def test_normals_are_those_of_the_patient(anatomy: Anatomy) -> None:
    # Of ellipsoids, but for the apex, whose thickness does not make its epicardium one.
    template = lv_template(anatomy, SHAPE)
    good = assess_fairness(template, anatomy)
    assert good.normal_mean is not None
    assert good.normal_p95 is not None
    assert good.normal_mean < good.normal_p95
    above = assess_fairness(without_row(template, 0), anatomy)
    assert above.normal_mean is not None
    assert above.normal_p95 is not None
    assert above.normal_mean < 2
    assert above.normal_p95 < 4
    bad = assess_fairness(disturbed(template, 1.0), anatomy)
    assert bad.normal_mean is not None
    assert bad.normal_mean > 3 * good.normal_mean
    assert assess_fairness(template).normal_mean is None


@pytest.mark.slow
def test_normals_against_an_interpolated_surface_are_not_told(anatomy: Anatomy) -> None:
    stack = replace(anatomy, slices=object())  # type: ignore[arg-type]
    assert assess_fairness(lv_template(anatomy, SHAPE), stack).normal_mean is None


@pytest.mark.slow
def test_report_tells_fairness_before_and_after_the_optimization(both: Personalization) -> None:
    report = both.report
    assert report.fairness == assess_fairness(both.mesh, both.anatomy)
    assert report.unoptimized_fairness == assess_fairness(both.enhanced)
    again = json.loads(report.to_json())
    assert again["fairness"] == asdict(report.fairness)
    assert f"along {report.fairness.longitudinal_median:.0f}" in str(report)
