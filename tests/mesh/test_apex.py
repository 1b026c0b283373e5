"""Laws of the cups with an apical hole or a square patch: what is shared, and how smoothly."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest

from heartgen import options
from heartgen.errors import MeshError
from heartgen.mesh import HexMesh
from heartgen.mesh.biventricular_topology import RvAttachment, biventricular_topology
from heartgen.mesh.connectivity import corner_nodes
from heartgen.mesh.grading import RowGrading
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.jacobian import jacobian_ratio, volume
from heartgen.mesh.surface_chart import Apex
from heartgen.mesh.surface_faces import enclosed_volume, sample_faces
from heartgen.mesh.validity import certify
from heartgen.templates.ellipsoid import TruncatedEllipsoid
from heartgen.templates.lv import ellipsoid_mesh
from heartgen.templates.spacing import best_spacing
from heartgen.warping import warp

CUPS = {
    "patch of 3x3": ((1, 12, 6), "patch"),
    "patch of 2x2": ((2, 8, 3), "patch"),
    "patch of one": ((1, 4, 2), "patch"),
    "patch of 5x5": ((1, 20, 2), "patch"),
    "hole": ((2, 5, 3), "hole"),
}
BOTH = {
    "patch": ((2, 12, 8), RvAttachment(5, 2, 1), "patch"),
    "patch, high opening": ((3, 8, 6), RvAttachment(3, 4, 2), "patch"),
    "hole": ((2, 9, 4), RvAttachment(4, 1, 1), "hole"),
}

HOLE = 6.0
"""Radius of the apical hole, mm."""

EDGE = np.array([0.5, 0.0, 0.13, 0.6, 1.0])
ACROSS = np.array([0.4, 0.0, 1.0, 0.7, 0.2])


def test_options_offer_every_kind_of_apex() -> None:
    assert get_args(options.Apex) == get_args(Apex)


@pytest.fixture(params=CUPS)
def cup(request: pytest.FixtureRequest) -> Topology:
    shape, apex = CUPS[request.param]
    return cup_topology(shape, (1.2, 0.9), apex)


@pytest.fixture(params=BOTH)
def both(request: pytest.FixtureRequest) -> Topology:
    shape, opening, apex = BOTH[request.param]
    return biventricular_topology(shape, opening, (1.2, 0.9), apex=apex)


def random_mesh(topology: Topology, seed: int = 1) -> HexMesh:
    """Any degrees of freedom: what holds for them holds for every heart."""
    n = topology.extraction.shape[1]
    return HexMesh(np.random.default_rng(seed).standard_normal((n, 3)), topology)


def pairs(topology: Topology) -> list[tuple[tuple[int, int], tuple[int, int], bool]]:
    """Faces that two elements share, and whether their first tangents run the same way."""
    mesh = random_mesh(topology)
    seen: dict[tuple[float, ...], list[tuple[int, int]]] = {}
    for face in range(6):
        middles = mesh.evaluate(on_face(face, np.array([[0.5, 0.5]])))[:, 0]
        for element, place in enumerate(middles):
            seen.setdefault(tuple(np.round(place, 8)), []).append((element, face))
    assert max(map(len, seen.values())) == 2
    single = {owners[0] for owners in seen.values() if len(owners) == 1}
    assert single == {tuple(f) for f in topology.external.tolist()}
    out = []
    for owners in seen.values():
        if len(owners) == 2:
            a, b = (mesh.evaluate(on_face(f, np.array([[0.0, 0.0]])))[e, 0] for e, f in owners)
            out.append((*owners, bool(np.allclose(a, b))))
    return out


def on_face(face: int, uv: np.ndarray) -> np.ndarray:
    """Local coordinates (q, 3) of parameters (q, 2) of a face: its directions in order."""
    axis, end = divmod(face, 2)
    xi = np.full((len(uv), 3), float(end))
    xi[:, [a for a in range(3) if a != axis]] = uv
    return xi


def meeting(mesh: HexMesh, first: tuple[int, int], second: tuple[int, int], same: bool) -> tuple:
    """Places, and all slopes, of both elements at the same points of the face they share."""
    uv = np.stack([EDGE, ACROSS], -1)
    other = uv if same else np.stack([1 - EDGE, ACROSS], -1)
    out = []
    for (element, face), at in ((first, uv), (second, other)):
        xi = on_face(face, at)
        out += [mesh.evaluate(xi)[element], mesh.gradient(xi)[element]]
    return tuple(out)


def kinks(mesh: HexMesh) -> dict[tuple[tuple[int, int], tuple[int, int]], np.ndarray]:
    """Of each shared face: factor k of the derivative along it that the outward ones add up to."""
    out = {}
    for first, second, same in pairs(mesh.topology):
        place, slope, other_place, other_slope = meeting(mesh, first, second, same)
        np.testing.assert_allclose(place, other_place, atol=1e-9)
        total = sum(
            (1 if face % 2 else -1) * s[..., face // 2]
            for (_, face), s in ((first, slope), (second, other_slope))
        )
        along = slope[..., 1 - first[1] // 2] if first[1] < 4 else np.ones_like(total)
        k = np.sum(total * along, axis=1) / np.sum(along**2, axis=1)
        np.testing.assert_allclose(total, k[:, None] * along, atol=1e-9)
        out[first, second] = k
    return out


def test_a_cup_meets_itself_with_prescribed_kinks_only(cup: Topology) -> None:
    found, again = (kinks(random_mesh(cup, seed)) for seed in (1, 2))
    kinked = 0
    for key, k in found.items():
        np.testing.assert_allclose(k, again[key], atol=1e-6)
        if np.abs(k).max() > 1e-9:
            kinked += 1
            # Only the sides of the patch and the first edges from its corners have one.
            rows = {int(cup.index[element, 2]) for element, _ in key}
            assert rows in ({0, 1}, {1})
    radial, around, _ = cup.shape
    assert kinked == (0 if "apical_rim" in cup.surfaces else radial * (around + 4))


def test_corners_of_a_patch_have_one_tangent_plane() -> None:
    mesh = random_mesh(cup_topology((1, 12, 3), apex="patch"))
    corners = corner_nodes(mesh.topology.extraction)
    slopes = mesh.gradient(
        np.array([[i, j, k] for k in (0, 1) for j in (0, 1) for i in (0, 1)]) * 1.0
    )
    patch = mesh.topology.index[:, 2] == 0
    meet = [n for n in np.unique(corners[patch]) if np.sum(corners == n) == 3]
    assert len(meet) == 2 * 4
    for node in meet:
        tangents = np.concatenate([s[:, :2].T for s in slopes[corners == node]])
        values = np.linalg.svd(tangents, compute_uv=False)
        assert values[1] > 1e-3
        assert values[2] < 1e-12


def test_functions_of_the_space_are_smooth_on_its_meshes(oval: TruncatedEllipsoid) -> None:
    mesh = ellipsoid_mesh(oval, (1, 12, 6), apex="patch")
    other = mesh.with_dofs(mesh.dofs + np.random.default_rng(3).standard_normal(mesh.dofs.shape))
    for first, second, same in pairs(mesh.topology):
        _, slope, _, far = meeting(mesh, first, second, same)
        _, function, _, beyond = meeting(other, first, second, same)
        np.testing.assert_allclose(
            function @ np.linalg.inv(slope), beyond @ np.linalg.inv(far), atol=1e-8
        )


def test_two_ventricles_are_smooth_but_for_the_insertion_line(both: Topology) -> None:
    mesh = random_mesh(both)
    opening_row = both.index[both.parts["right ventricle"], 2].min()
    reached = opening_row == 2 and "apex" not in both.surfaces
    for first, second, same in pairs(both):
        place, slope, other_place, other_slope = meeting(mesh, first, second, same)
        np.testing.assert_allclose(place, other_place, atol=1e-9)
        if max(both.index[e, 2] for e in (first[0], second[0])) >= opening_row - 1:
            continue
        if reached and first[1] // 2 == 2:
            continue  # the insertion line touches the patch: its layers may meet with a kink
        total = sum(
            (1 if face % 2 else -1) * s[..., face // 2]
            for (_, face), s in ((first, slope), (second, other_slope))
        )
        normal = np.cross(slope[..., (first[1] // 2 + 1) % 3], slope[..., (first[1] // 2 + 2) % 3])
        assert np.abs(np.sum(total * normal, axis=1)).max() < 1e-8


def test_laws_of_every_cup(cup: Topology) -> None:
    check_laws(cup)


@pytest.mark.parametrize("name", CUPS)
def test_laws_of_every_cup_whose_grading_changes_by_row(name: str) -> None:
    shape, apex = CUPS[name]
    random = np.random.default_rng(2)
    value, change = random.uniform([[[0.8]], [[-0.1]]], [[[1.3]], [[0.1]]], (2, shape[2] + 1, 2))
    topology = cup_topology(shape, RowGrading(value, change), apex)
    check_laws(topology)
    s, n = topology.straightening, topology.constant.size // (2 * (shape[0] + 1))
    for layer in (0, 2 * shape[0]):  # endocardium and epicardium stay, bit for bit
        own = s[layer * n : (layer + 1) * n]
        assert np.array_equal(own.indices, layer * n + np.arange(n))
        assert np.all(own.data == 1)


@pytest.mark.parametrize("name", CUPS)
def test_a_grading_that_does_not_change_is_that_of_the_whole_wall(name: str) -> None:
    shape, apex = CUPS[name]
    same = RowGrading(np.tile([1.2, 0.9], (shape[2] + 1, 1)), np.zeros((shape[2] + 1, 2)))
    one, other = (cup_topology(shape, g, apex).straightening for g in ((1.2, 0.9), same))
    assert abs(one - other).max() < 1e-15


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["hole", "patch"])
def test_a_grading_by_row_makes_better_elements(oval: TruncatedEllipsoid, apex: str) -> None:
    def quality(by_row: bool) -> float:
        spacing = best_spacing(oval, (1, 12, 6), True, apex, HOLE, by_row=by_row)
        mesh = ellipsoid_mesh(oval, (1, 12, 6), apex=apex, hole=HOLE)
        topology = cup_topology((1, 12, 6), spacing.grading, apex)
        return float(jacobian_ratio(mesh.with_dofs(topology.straightening @ mesh.dofs)).mean())

    assert quality(True) > quality(False) + 0.02


def test_laws_of_every_pair_of_ventricles(both: Topology) -> None:
    check_laws(both)


def check_laws(topology: Topology) -> None:
    """Volume by two routes, partition of unity, straightening, nodes, and refined elements."""
    mesh = random_mesh(topology)
    assert volume(mesh) == pytest.approx(enclosed_volume(mesh), rel=1e-9, abs=1e-9)
    np.testing.assert_allclose(topology.extraction @ topology.constant, 1, atol=1e-14)
    s = topology.straightening
    assert abs(s @ s - s).max() < 1e-13
    np.testing.assert_allclose(s @ topology.constant, topology.constant, atol=1e-13)
    places = np.stack([topology.nodes.ravel(), corner_nodes(topology.extraction).ravel()])
    assert (
        len(np.unique(places, axis=1).T) == len(np.unique(places[0])) == len(np.unique(places[1]))
    )
    assert len(np.unique(topology.index, axis=0)) == mesh.n_elements
    fine = mesh.refined(radial=1, circumferential=2, longitudinal=2)
    assert volume(fine) == pytest.approx(volume(mesh), rel=1e-9, abs=1e-9)
    assert len(np.unique(fine.topology.index, axis=0)) == fine.n_elements


@pytest.mark.slow
@pytest.mark.parametrize("apex", ["collapsed", "hole", "patch"])
def test_an_affine_map_is_reproduced_by_the_warp(oval: TruncatedEllipsoid, apex: str) -> None:
    mesh = ellipsoid_mesh(oval, (1, 12, 6), apex=apex, hole=HOLE)
    matrix = np.random.default_rng(4).standard_normal((3, 3))
    warped = warp(mesh, lambda points: points @ matrix.T + [1.0, 2.0, 3.0])
    expected = mesh.control @ matrix.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(warped.control, expected, atol=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(("elements", "close"), [((1, 12, 6), 0.1), ((2, 8, 5), 0.2)])
def test_every_topology_has_the_surfaces_of_the_ellipsoid(
    elements: tuple[int, int, int], close: float
) -> None:
    radii = {"lv_endo": np.array([22.0, 22.0, 55.0]), "epi": np.array([32.0, 32.0, 63.0])}
    shape = TruncatedEllipsoid(np.zeros(2), np.zeros(2), 22 * np.eye(2), 55.0, 0.5, 10.0, 8.0)
    volumes = {}
    for apex in ("collapsed", "hole", "patch"):
        mesh = ellipsoid_mesh(shape, elements, apex=apex, hole=HOLE)
        assert certify(mesh).all_valid
        volumes[apex] = volume(mesh)
        for name, axes in radii.items():
            faces = mesh.topology.surfaces[name]
            if apex != "patch":  # a pole and a rim show the element next to them less well
                faces = faces[mesh.topology.index[faces[:, 0], 2] > 0]
            points, _, _ = sample_faces(mesh, faces, 4)
            unit = (points + np.array([0, 0, 0.5 * 55.0])) / axes
            level = np.sum(unit**2, axis=1) - 1
            assert np.abs(level / np.linalg.norm(2 * unit / axes, axis=1)).max() < close
    # Between two ellipsoids, below z = 0.
    exact = sum(
        sign * np.pi * b * b * a * (2 / 3 + t - t**3 / 3)
        for sign, b, a in ((1, 32.0, 63.0), (-1, 22.0, 55.0))
        for t in [27.5 / a]
    )
    assert volumes["patch"] == pytest.approx(exact, rel=1e-3)
    assert volumes["collapsed"] == pytest.approx(exact, rel=2e-2)
    assert 0.97 * exact < volumes["hole"] < exact


@pytest.mark.slow
def test_the_hole_has_its_radius(oval: TruncatedEllipsoid) -> None:
    mesh = ellipsoid_mesh(oval, (1, 12, 6), apex="hole", hole=HOLE)
    rim = mesh.evaluate(np.array([[0.0, 0.0, 0.0]]))[mesh.topology.surfaces["apical_rim"][:, 0], 0]
    radius = np.linalg.norm(rim - rim.mean(0), axis=1)
    assert radius.mean() == pytest.approx(HOLE, rel=0.01)


@pytest.mark.parametrize("shape", [(1, 10, 6), (1, 12, 1), (1, 3, 4)])
def test_a_patch_that_cannot_be_is_refused(shape: tuple[int, int, int]) -> None:
    with pytest.raises(MeshError, match="multiple of 4"):
        cup_topology(shape, apex="patch")


def test_an_opening_into_the_patch_is_refused() -> None:
    with pytest.raises(MeshError, match="3 longitudinal"):
        biventricular_topology((2, 12, 8), RvAttachment(5, 1, 1), apex="patch")
