"""Meshes resampled to linear or quadratic cells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import InputError, MeshError
from heartgen.formats.resampling import Resampling, fidelity, resample
from heartgen.formats.resampling.data import sample
from heartgen.formats.resampling.jacobians import scaled_jacobian
from heartgen.formats.resampling.kinds import CHOICES, WEDGES
from heartgen.mesh import MeshField
from heartgen.mesh.closest import closest_points
from heartgen.mesh.jacobian import volume

from .cells import KIND_OF_TYPE, TYPES, open_edges, vtk_gradients, vtk_volumes

KINDS = (*CHOICES.values(), *WEDGES.values())


def volumes(cells):
    """Volume and least determinant of all cells, by VTK."""
    found = [vtk_volumes(b.kind.name, cells.points[b.nodes]) for b in cells.cells]
    return tuple(np.concatenate(part) for part in zip(*found, strict=True))


def vertices_of_facets(cells):
    """Rings of vertices of all faces on named surfaces."""
    return [
        facets[:, : {3: 3, 6: 3, 4: 4, 8: 4, 9: 4}[facets.shape[1]]]
        for name in cells.surfaces
        for facets in cells.facets(name)
    ]


# --- kinds of cells ------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_shape_functions_are_those_of_vtk(kind):
    xi = np.random.default_rng(0).random((6, 3)) / 3
    assert_allclose(kind.gradient(xi), vtk_gradients(kind.name, xi), rtol=0, atol=1e-12)
    assert_allclose(kind.shape(kind.reference), np.eye(len(kind.nodes)), rtol=0, atol=1e-12)
    assert_allclose(kind.shape(xi) @ kind.reference, xi, rtol=0, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_faces_look_outwards(kind):
    center = kind.reference[: kind.vertices].mean(0)
    for face in kind.faces:
        a, b, c = kind.reference[list(face[:3])]
        assert np.cross(b - a, c - b) @ (a - center) > 0


@pytest.mark.parametrize("name", ["hex8", "wedge6", "tet4"])
def test_scaled_jacobian_is_that_of_verdict(name):
    pv = pytest.importorskip("pyvista")
    kind = next(kind for kind in KINDS if kind.name == name)
    noise = 0.15 * np.random.default_rng(1).standard_normal((20, len(kind.nodes), 3))
    points = kind.reference + noise
    size = len(kind.nodes)
    conn = np.insert(np.arange(points.size // 3).reshape(-1, size), 0, size, axis=1).ravel()
    grid = pv.UnstructuredGrid(conn, np.full(20, TYPES[name][0]), points.reshape(-1, 3))
    theirs = np.asarray(grid.cell_quality("scaled_jacobian")["scaled_jacobian"])
    ours = scaled_jacobian(kind, points)
    if name == "hex8":  # Verdict also looks at the center of a hexahedron
        assert (theirs <= ours + 1e-9).all()
        ours, theirs = ours[theirs > ours - 1e-3], theirs[theirs > ours - 1e-3]
        assert len(ours) > 10
    assert_allclose(ours, theirs, rtol=0, atol=1e-6)


# --- geometry ------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", CHOICES)
def test_cells_fill_hearts_without_folds_or_gaps(heart, kind):
    check_cells(heart, resample(heart, Resampling(kind, (1, 2, 2))))


@pytest.mark.parametrize("kind", CHOICES)
def test_cells_fill_turned_elements_without_folds_or_gaps(bricks, kind):
    check_cells(bricks, resample(bricks, Resampling(kind, (2, 2, 2))))


def check_cells(mesh, cells):
    """All cells have a volume, and their faces on surfaces close."""
    size, least = volumes(cells)
    assert least.min() > 0
    measured = fidelity(mesh, cells)
    assert measured.volume == pytest.approx(size.sum() / volume(mesh), rel=1e-9)
    assert measured.volume == pytest.approx(1, abs=0.15)
    assert open_edges(vertices_of_facets(cells)) == 0
    corners = np.concatenate([np.sort(f[:, :3], axis=1) for f in vertices_of_facets(cells)])
    assert len(np.unique(corners, axis=0)) == len(corners), "a face is there twice"


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "order"), [("hex8", 2), ("tet4", 2), ("hex27", 3), ("tet10", 3)])
def test_error_falls_with_the_order_of_the_cells(usual, kind, order):
    coarse, fine = (fidelity(usual, resample(usual, Resampling(kind, (1, n, n)))) for n in (2, 4))
    assert coarse.mean / fine.mean > 0.8 * 2**order
    # Errors of volumes have signs: of parts in a million, two may cancel by chance.
    assert abs(fine.volume - 1) < max(abs(coarse.volume - 1) / (0.8 * 2**order), 1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("mesh", "kind"), [("usual", "hex27"), ("usual", "tet10"), ("biv", "tet4")]
)
def test_nodes_on_surfaces_are_on_the_exact_ones(mesh, kind, request):
    mesh = request.getfixturevalue(mesh)
    cells = resample(mesh, Resampling(kind, (1, 1, 1)))
    for name, faces in mesh.topology.surfaces.items():
        nodes = np.unique(np.concatenate([f.ravel() for f in cells.facets(name)]))
        assert closest_points(mesh, faces, cells.points[nodes]).distance.max() < 1e-6


@pytest.mark.slow
def test_distance_is_that_to_a_fine_tessellation(usual):
    pv = pytest.importorskip("pyvista")
    coarse, fine = (resample(usual, Resampling("tet4", (1, n, n))) for n in (1, 12))
    surface = [np.concatenate(c.facets("epi")) for c in (coarse, fine)]
    exact = pv.PolyData.from_regular_faces(fine.points, surface[1])
    middle = coarse.points[surface[0]].mean(1)
    theirs = np.abs(pv.PolyData(middle).compute_implicit_distance(exact)["implicit_distance"])
    ours = closest_points(usual, usual.topology.surfaces["epi"], middle).distance
    assert_allclose(ours, theirs, rtol=0, atol=0.03)
    only = replace(coarse, surfaces={"epi": coarse.surfaces["epi"]})
    assert ours.max() - 0.1 < fidelity(usual, only).max < 8


def test_straight_mesh_is_resampled_exactly(bricks):
    straight = bricks.with_dofs(np.round(bricks.dofs))
    measured = fidelity(straight, resample(straight, Resampling("hex8", (1, 1, 1))))
    assert measured.max < 1e-9
    assert measured.volume == pytest.approx(1, abs=1e-12)
    assert measured.quality_min == pytest.approx(1, abs=1e-9)
    assert str(measured).startswith("resampled to 2 hex8: 0.000 mm")


# --- topology ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_collapsed_elements_give_wedges_and_nothing_else_does(usual, biv, bricks, hole, patch):
    for mesh, columns in ((usual, 12), (biv, 24), (bricks, 0), (hole, 0), (patch, 0)):
        cells = resample(mesh, Resampling("hex20", (2, 2, 2)))
        counts = {block.kind.name: len(block.nodes) for block in cells.cells}
        assert counts.get("wedge15", 0) == 4 * columns
        assert sum(counts.values()) == 8 * mesh.n_elements
        assert all(len(set(cell)) == len(cell) for b in cells.cells for cell in b.nodes.tolist())


@pytest.mark.parametrize("kind", CHOICES)
def test_points_are_shared_whatever_the_shape(usual, kind):
    tiny = usual.with_dofs(1e-12 * usual.dofs)
    cells, same = (resample(m, Resampling(kind, (1, 1, 1))) for m in (usual, tiny))
    assert len(cells.points) == len(same.points)


def test_the_pocket_of_the_right_ventricle_stays_open(biv):
    cells = resample(biv, Resampling("tet4", (1, 1, 1)))
    assert len(cells.surfaces["rv_endo"]) == 2 * len(biv.topology.surfaces["rv_endo"])


def test_regions_are_those_of_the_mesh(biv):
    cells = resample(biv, Resampling("tet4", (1, 1, 1)))
    element = np.concatenate([block.element for block in cells.cells])
    assert sum(map(len, cells.parts.values())) == cells.n_cells
    for name, members in cells.parts.items():
        assert set(element[members]) == set(biv.topology.parts[name])
    numbers = cells.part_numbers()
    assert set(numbers[cells.parts["septum"]]) == {1 + list(cells.parts).index("septum")}


# --- fields --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", CHOICES)
def test_fields_are_at_points_unless_they_jump(usual, kind):
    cells = resample(usual, Resampling(kind, (1, 2, 2)))
    places = usual.lagrange_points()
    around = np.broadcast_to(np.linspace(0, 1, 4)[None, :], (16, 4)).ravel()  # xi1, it jumps
    fields = [
        MeshField("place", places),
        MeshField("segment", np.arange(72)),
        MeshField("xi1", np.broadcast_to(around[:, None], (72, 64, 1))),
    ]
    data = sample(cells, fields)
    assert set(data.points) == {"place"}
    assert data.jumping == {"segment", "xi1"}
    if kind in ("hex8", "tet4"):
        assert_allclose(data.points["place"], cells.points, rtol=0, atol=1e-9)
    element = np.concatenate([block.element for block in cells.cells])
    assert_array_equal(data.cells["segment"][:, 0], element)
    assert ((data.cells["xi1"] > 0) & (data.cells["xi1"] < 1)).all()


def test_axes_are_of_unit_length_and_independent(usual):
    cells = resample(usual, Resampling("tet4", (1, 1, 1)))
    data = sample(cells, [MeshField("fiber", 3 * usual.lagrange_points())])
    fiber, other = data.axes()
    assert_allclose(np.linalg.norm(fiber, axis=1), 1, rtol=0, atol=1e-12)
    assert_allclose(np.einsum("mx,mx->m", fiber, other), 0, rtol=0, atol=1e-12)
    assert sample(cells, []).axes() is None


# --- what is refused -----------------------------------------------------------------------------


@pytest.mark.parametrize("pieces", [(0, 1, 1), (1, 1), (1.5, 1, 1), (1, -1, 1)])
def test_pieces_are_three_whole_numbers(pieces):
    with pytest.raises(InputError, match="three whole numbers from 1"):
        Resampling("hex8", pieces)


def test_unknown_cells_are_refused():
    with pytest.raises(InputError, match="'hex64' are not known: choose hex8"):
        Resampling("hex64")


def test_cells_that_fold_are_refused(usual):
    crumpled = usual.with_dofs(
        usual.dofs + 8 * np.random.default_rng(2).standard_normal(usual.dofs.shape)
    )
    with pytest.raises(MeshError, match=r"\d+ of \d+ cells \(hex8 and wedge6\) would fold"):
        fidelity(crumpled, resample(crumpled, Resampling("hex8", (1, 1, 1))))


def test_cells_that_would_leave_gaps_are_refused(bricks):
    with pytest.raises(MeshError, match="do not meet in whole faces"):
        resample(bricks, Resampling("hex8", (1, 2, 2)))


def test_every_kind_is_known_to_vtk():
    assert {kind.name for kind in KINDS} == set(KIND_OF_TYPE.values())
