"""Topology of both ventricles: what is shared, what is free, where it is smooth."""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.errors import MeshError
from heartgen.mesh import HexMesh
from heartgen.mesh.biventricular_topology import RvAttachment, biventricular_topology
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import enclosed_volume

CASES = {
    "paper": ((2, 9, 8), RvAttachment(4, 3, 1)),
    "fine": ((2, 12, 8), RvAttachment(5, 2, 1)),
    "three layers": ((3, 16, 10), RvAttachment(6, 3, 2)),
    "four layers, low opening": ((4, 12, 6), RvAttachment(4, 1, 2)),
    "least": ((2, 6, 2), RvAttachment(3, 1, 1)),
}

PLACES = np.vstack([[0.5, 0.5], np.random.default_rng(2).uniform(size=(5, 2))])

PLACES_INSIDE = np.random.default_rng(3).uniform(size=(7, 3))


@pytest.fixture(params=CASES, ids=CASES.get)
def case(request: pytest.FixtureRequest) -> tuple[RvAttachment, Topology]:
    shape, opening = CASES[request.param]
    return opening, biventricular_topology(shape, opening)


def random_mesh(topology: Topology) -> HexMesh:
    """Any degrees of freedom: what holds for them holds for every heart."""
    n = topology.extraction.shape[1]
    return HexMesh(np.random.default_rng(1).standard_normal((n, 3)), topology)


def faces_of(mesh: HexMesh) -> dict[tuple[int, int], tuple[np.ndarray, np.ndarray]]:
    """Places and derivatives across it of each face that has not collapsed."""
    collapsed = {tuple(f) for f in mesh.topology.collapsed.tolist()}
    out = {}
    for face in range(6):
        axis, end = divmod(face, 2)
        xi = np.full((len(PLACES), 3), float(end))
        xi[:, [a for a in range(3) if a != axis]] = PLACES
        places, slopes = mesh.evaluate(xi), mesh.gradient(xi)[..., axis]
        for element in range(mesh.n_elements):
            if (element, face) not in collapsed:
                out[element, face] = places[element], slopes[element]
    return out


def shared(mesh: HexMesh) -> tuple[list[list[tuple[int, int]]], dict]:
    """Faces that coincide at their middle, and all of them."""
    faces = faces_of(mesh)
    groups: dict[tuple[float, ...], list[tuple[int, int]]] = {}
    for key, (places, _) in faces.items():
        groups.setdefault(tuple(np.round(places[0], 8)), []).append(key)
    return list(groups.values()), faces


def test_faces_that_belong_to_one_element_are_the_named_ones(
    case: tuple[RvAttachment, Topology],
) -> None:
    _, topology = case
    groups, _ = shared(random_mesh(topology))
    assert max(map(len, groups)) == 2
    assert {g[0] for g in groups if len(g) == 1} == {tuple(f) for f in topology.external.tolist()}


@pytest.mark.parametrize("straight", [False, True])
def test_continuous_everywhere_and_smooth_away_from_the_insertion_line(
    case: tuple[RvAttachment, Topology], straight: bool
) -> None:
    opening, topology = case
    mesh = random_mesh(topology)
    if straight:
        mesh = mesh.with_dofs(topology.straightening @ mesh.dofs)
    groups, faces = shared(mesh)
    around = topology.shape[1]
    for first, second in (g for g in groups if len(g) == 2):
        np.testing.assert_allclose(faces[first][0], faces[second][0], atol=1e-10)
        if np.allclose(faces[first][1], faces[second][1], atol=1e-10):
            continue
        # Only faces that touch the insertion line may have a crease.
        _, column, row = topology.index[first[0]]
        element, face = first
        near_side = {(0, 0), (opening.columns - 1, 1)}
        if face // 2 == 0:
            assert (column, face % 2) in near_side | {
                (around - 1, 1),
                (opening.columns, 0),
            }
        elif face // 2 == 1:
            assert row == opening.row - face % 2
        else:
            beside = column in (around - 1, opening.columns) or row == opening.row - 1
            assert beside, (element, face)


def test_constant_and_straightening(case: tuple[RvAttachment, Topology]) -> None:
    _, topology = case
    np.testing.assert_allclose(topology.extraction @ topology.constant, 1, atol=1e-14)
    s = topology.straightening
    assert abs(s @ s - s).max() < 1e-13
    np.testing.assert_allclose(s @ topology.constant, topology.constant, atol=1e-13)
    mesh = random_mesh(topology)
    straight = mesh.with_dofs(s @ mesh.dofs)
    for name in ("lv_endo", "epi"):
        faces = topology.surfaces[name]
        a, b = (faces_of(m) for m in (mesh, straight))
        for face in map(tuple, faces.tolist()):
            np.testing.assert_array_equal(a[face][0], b[face][0])


def test_straight_elements_are_straight_across(case: tuple[RvAttachment, Topology]) -> None:
    opening, topology = case
    mesh = random_mesh(topology)
    mesh = mesh.with_dofs(topology.straightening @ mesh.dofs)
    xi = np.array([[0.3, 0.6, t] for t in (0.0, 0.25, 0.7, 1.0)])
    lines = mesh.evaluate(xi)[topology.parts["septum"]]
    ends = lines[:, -1] - lines[:, 0]
    for inner in (1, 2):
        off = np.cross(lines[:, inner] - lines[:, 0], ends)
        assert np.abs(off).max() < 1e-10
    assert opening.septal_layers >= 1


def test_volume_by_two_routes(case: tuple[RvAttachment, Topology]) -> None:
    _, topology = case
    mesh = random_mesh(topology)
    assert volume(mesh) == pytest.approx(enclosed_volume(mesh), rel=1e-9, abs=1e-9)


def test_refined_geometry_and_names(case: tuple[RvAttachment, Topology]) -> None:
    _, topology = case
    mesh = random_mesh(topology)
    fine = mesh.refined(radial=2, circumferential=1, longitudinal=2)
    halves = fine.evaluate(PLACES_INSIDE).reshape(mesh.n_elements, 2, 2, -1, 3)
    for k, j in np.ndindex(2, 2):
        whole = mesh.evaluate((PLACES_INSIDE + np.array([0, j, k])) / [1, 2, 2])
        assert np.abs(halves[:, k, j] - whole).max() < 1e-10
    assert volume(fine) == pytest.approx(volume(mesh), rel=1e-9, abs=1e-9)
    assert {k: 4 * len(v) for k, v in topology.parts.items()} == {
        k: len(v) for k, v in fine.topology.parts.items()
    }
    assert {k: 2 * len(v) for k, v in topology.patches.items()} == {
        k: len(v) for k, v in fine.topology.patches.items()
    }


@pytest.mark.parametrize(
    ("shape", "opening"),
    [
        ((1, 12, 8), RvAttachment(4, 2, 1)),
        ((2, 5, 8), RvAttachment(3, 2, 1)),
        ((2, 12, 8), RvAttachment(10, 2, 1)),
        ((2, 12, 8), RvAttachment(4, 0, 1)),
        ((2, 12, 8), RvAttachment(4, 8, 1)),
        ((2, 12, 8), RvAttachment(4, 2, 2)),
    ],
)
def test_too_coarse_meshes_are_refused(shape: tuple[int, int, int], opening: RvAttachment) -> None:
    with pytest.raises(MeshError, match="two ventricles"):
        biventricular_topology(shape, opening)
