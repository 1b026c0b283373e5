"""Walls that cross are found, and nothing else is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numba as nb
import numpy as np
import pytest
import scipy.sparse as sp
from scipy.spatial.transform import Rotation

from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.closest import closest_points
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.overlap import _crossed, overlapping
from heartgen.mesh.subdivisions import apart, split, whole_faces
from heartgen.mesh.surface_faces import face_control, sample_faces
from heartgen.mesh.triangles import quads_cross
from heartgen.mesh.validity import certify, certify_jacobian
from heartgen.templates.biventricular import biventricular_template
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh, lv_template
from heartgen.warping import warp

SIDE = 10.0
"""Edge of the blocks, mm."""

TOUCH = 1e-8
"""Distance below which points are one, mm."""

COARSE = 2.0
"""Voxel size that keeps the tests quick, mm."""

HOLE = 6.0
"""Radius of the apical hole, mm."""


def blocks(*control: np.ndarray) -> HexMesh:
    """Elements with Bernstein coefficients (64, 3) of their own, all of whose faces are outside."""
    n = len(control)
    faces = np.stack([np.repeat(np.arange(n), 6), np.tile(np.arange(6), n)], -1)
    topology = replace(
        cup_topology((1, 3, 1)),
        extraction=sp.csr_array(sp.eye_array(64 * n)),
        index=np.zeros((n, 3), dtype=np.intp),
        surfaces={"outside": faces},
        collapsed=np.zeros((0, 2), dtype=np.intp),
        constant=np.ones(64 * n),
    )
    return HexMesh(np.concatenate(control), topology)


def bulging(bulge: float) -> np.ndarray:
    """A block whose lower face bulges down by so much in its middle, mm."""
    control = SIDE * lattice()
    grid = control.reshape(4, 4, 4, 3)
    grid[0, 1:3, 1:3, 2] -= bulge / 0.75**2  # the weight of these in the middle
    return control


def facing(gap: float) -> HexMesh:
    """Two bulges that face each other at a gap, or at a depth if that is negative, mm."""
    upper = bulging(2.5) + np.array([0.0, 0.0, gap])
    lower = bulging(3.0) * [1.0, -1.0, -1.0] + [0.0, SIDE, -5.5]
    return blocks(upper, lower)


def moved(mesh: HexMesh, seed: int, scale: float = 1.0) -> HexMesh:
    """The mesh somewhere else."""
    affine = np.eye(4)
    affine[:3, :3] = scale * Rotation.random(rng=np.random.default_rng(seed)).as_matrix()
    affine[:3, 3] = [300.0, -200.0, 100.0]
    return mesh.transformed(affine)


@nb.njit
def every_pair(patches, levels, touch):
    """Which faces cross, by all pairs of triangles whose boxes meet: without shortcuts."""
    n = len(patches)
    crossed = np.zeros(n, dtype=np.bool_)
    tree = whole_faces(patches)
    stack = np.empty((256, 2), dtype=np.int64)
    for one in range(n):
        for other in range(one, n):
            stack[0, 0], stack[0, 1] = one, other
            waiting = 1
            while waiting:
                waiting -= 1
                a, b = stack[waiting]
                if a != b and apart(tree[1], a, b):
                    continue
                if tree[4][a] == levels and tree[4][b] == levels:
                    if a != b and quads_cross(tree[0][a], tree[0][b], touch):
                        crossed[one] = crossed[other] = True
                        break
                    continue
                if tree[4][b] < tree[4][a]:
                    a, b = b, a
                tree = split(tree, a)
                tree = split(tree, b) if a == b else tree
                for c in range(4):
                    for d in range(c, 4) if a == b else range(1):
                        stack[waiting, 0] = tree[3][a] + c
                        stack[waiting, 1] = tree[3][a] + d if a == b else b
                        waiting += 1
    return crossed


@pytest.mark.parametrize("seed", range(4))
def test_a_hundredth_of_a_millimeter_tells_a_crossing_from_a_gap(seed: int) -> None:
    for gap, expected in ((1.0, False), (0.01, False), (-0.01, True), (-1.0, True)):
        mesh = moved(facing(gap), seed)
        assert certify_jacobian(mesh).all_valid
        assert overlapping(mesh).tolist() == [expected] * 2
        assert certify(mesh).all_valid is not expected


def test_the_depth_scales_with_the_mesh() -> None:
    for scale in (0.1, 30.0):
        for gap in (0.01, -0.01):
            mesh = moved(facing(gap), 1, scale)
            assert overlapping(mesh, 0.01 * scale).all() == (gap < 0)


def test_only_those_that_cross_are_named() -> None:
    far = SIDE * lattice() + [0.0, 40.0, 0.0]
    mesh = facing(-0.5)
    mesh = blocks(far, *mesh.control, far + np.array([0.0, 0.0, 2 * SIDE]))
    assert overlapping(mesh).tolist() == [False, True, True, False]
    # Grids that lie on each other: two plane faces cross in lines of both.
    through = SIDE * lattice() + [0.0, SIDE / 2, SIDE / 2]
    assert overlapping(blocks(SIDE * lattice(), through)).all()


def test_a_face_that_crosses_itself_is_found() -> None:
    control = SIDE * lattice()
    grid = control.reshape(4, 4, 4, 3)
    assert not overlapping(blocks(control)).any()
    grid[3, :, :, 0] = [0.0, 3 * SIDE, -2 * SIDE, SIDE]  # its upper face is a loop
    grid[3, :, 1:3, 2] += SIDE
    assert overlapping(blocks(control)).all()


def test_what_cannot_be_told_is_not_called_free() -> None:
    control = np.concatenate([[SIDE * lattice()], [SIDE * lattice() + 3 * SIDE]])
    for bad in (np.nan, np.inf, 1e9):
        broken = control.copy()
        broken[1, 0, 0] = bad
        assert overlapping(blocks(*broken)).tolist() == [False, True]
    assert not certify(blocks(control[0], np.full((64, 3), np.nan))).valid[1]


def pinched(oval: TruncatedEllipsoid) -> tuple[HexMesh, HexMesh]:
    """A cup, and the same with opposite walls moved by 1 mm towards each other near the base."""
    mesh = ellipsoid_mesh(oval, (1, 24, 8))
    points = mesh.evaluate(np.full((1, 3), 0.5))[:, 0]
    center = points[mesh.topology.index[:, 2] == 7].mean(0)

    def pinch(points: np.ndarray) -> np.ndarray:
        x, y, z = (points - [center[0], center[1], 0.0]).T
        toward = np.tanh(x / 5) * np.exp(-((y / 8) ** 2) - (z / 25) ** 2)
        return points - np.outer(toward, [1.0, 0.0, 0.0])

    return mesh, warp(mesh, pinch)


@pytest.mark.slow
def test_opposite_walls_of_a_cup_cross_from_where_they_touch(oval: TruncatedEllipsoid) -> None:
    mesh, moved_by_one = pinched(oval)
    change = moved_by_one.dofs - mesh.dofs

    def at(by: float) -> HexMesh:
        return mesh.with_dofs(mesh.dofs + by * change)

    for by, expected in ((0.0, 0), (8.0, 0), (20.0, 2), (30.0, 8)):
        certificate = certify(at(by))
        assert certificate.positive.all()
        assert expected <= certificate.overlapping.sum() <= 4 * expected
    free, crossing = 8.0, 20.0
    while crossing - free > 1e-4:
        middle = (free + crossing) / 2
        free, crossing = (free, middle) if overlapping(at(middle)).any() else (middle, crossing)
    last = at(free)
    faces = last.topology.surfaces["lv_endo"]
    x, y, _ = mesh.evaluate(np.full((1, 3), 0.5))[faces[:, 0], 0].T
    pinched_ones = (mesh.topology.index[faces[:, 0], 2] >= 4) & (abs(y + 2) < 10)
    left, right = (faces[pinched_ones & side] for side in (x < 0, x > 0))
    nearest = closest_points(last, right, sample_faces(last, left, 12)[0])
    at_gap = nearest.points[[nearest.distance.argmin()]]
    for side in (left, right) * 50:  # from wall to wall, until both are nearest
        nearest = closest_points(last, side, at_gap)
        at_gap = nearest.points
    assert 0 < nearest.distance[0] < 0.01


@pytest.mark.slow
def test_good_meshes_are_free_of_alarms(cup: HexMesh, disturbed: HexMesh) -> None:
    for mesh in (cup, disturbed, moved(cup, 2), cup.to_lagrange()):
        assert not overlapping(mesh).any()
        assert not overlapping(mesh.refined(2, 1, 3)).any()


@pytest.mark.slow
@pytest.mark.parametrize("make", [samples.ideal_cup, samples.lifelike_lv, samples.biv])
def test_templates_cross_only_where_they_fold(make: Callable[[float], samples.Sample]) -> None:
    anatomy = analyze(make(COARSE).mask)
    for apex in ("collapsed", "hole", "patch"):
        hole = HOLE if apex == "hole" else 0.0
        if anatomy.rv is None:
            mesh = lv_template(anatomy, (1, 12, 6), apex=apex, hole=hole)
        else:
            mesh = biventricular_template(anatomy, (2, 12, 8), apex=apex, hole=hole)
        certificate = certify(mesh)
        assert not np.any(certificate.overlapping & certificate.positive)
        in_pieces = overlapping(mesh.refined(1, 2, 2)).reshape(-1, 4).any(1)
        assert not np.any(in_pieces & certificate.positive)


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.3, 1.5, 4.0])
def test_shortcuts_change_nothing(cup: HexMesh, size: float) -> None:
    for seed in range(2):
        noise = np.random.default_rng(seed).standard_normal(cup.dofs.shape)
        mesh = cup.with_dofs(cup.dofs + size * noise)
        patches = np.ascontiguousarray(face_control(mesh, mesh.topology.external))
        expected = every_pair(patches, 4, TOUCH)
        none = np.zeros(len(patches), dtype=bool)
        np.testing.assert_array_equal(_crossed(patches, none, 4, TOUCH), expected)


@pytest.mark.slow
def test_thin_walls_are_no_crossings() -> None:
    for thickness in (0.02, 1e-4):
        thin = bulging(2.0).reshape(4, 4, 4, 3)
        thin[..., 2] = thin[:1, ..., 2] + thickness * np.arange(4)[:, None, None]
        for seed in range(3):
            assert certify(moved(blocks(thin.reshape(64, 3)), seed)).all_valid


def test_of_elements_known_to_fold_it_is_not_asked() -> None:
    mesh = facing(-0.5)
    assert overlapping(mesh).all()
    one, both = np.array([True, False]), np.array([True, True])
    assert overlapping(mesh, folded=one).all()
    assert not overlapping(mesh, folded=both).any()
