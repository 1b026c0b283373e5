from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

from heartgen.images.levelset import LevelSet
from heartgen.mesh.surface_faces import surface_area

pytest.importorskip("pyvista")

from heartgen.viewing import polydata

PIECES = 4
RADIUS = 9.0


@pytest.fixture(scope="module")
def ball():
    """Level function of a ball about the origin on a grid of 0.5 mm."""
    n = 49
    affine = np.diag([0.5, 0.5, 0.5, 1.0])
    affine[:3, 3] = -0.5 * (n - 1) / 2
    grid = np.indices((n, n, n)).reshape(3, -1).T @ affine[:3, :3] + affine[:3, 3]
    values = (np.linalg.norm(grid, axis=1) - RADIUS).astype(np.float32).reshape(n, n, n)
    return LevelSet(values, affine)


def point_regions(surface, faces):
    """Named surface of every point."""
    return np.repeat(surface["region"].reshape(faces, -1)[:, 0], (PIECES + 1) ** 2)


@pytest.mark.slow
def test_surface_has_every_face_in_pieces(result):
    topology = result.mesh.topology
    surface = polydata.mesh_surface(result.mesh, PIECES)
    faces = len(topology.external)
    assert surface.n_points == faces * (PIECES + 1) ** 2
    assert surface.n_cells == faces * PIECES**2
    counts = np.bincount(surface["region"])
    assert counts.tolist() == [PIECES**2 * len(part) for part in topology.surfaces.values()]
    assert 0 < surface["quality"].min() < surface["quality"].max() <= 1


def test_quality_of_a_face_is_that_of_its_element(result):
    surface = polydata.mesh_surface(result.mesh, PIECES)
    assert_allclose(surface["quality"].min(), result.report.quality.min)


def test_area_converges_to_that_of_the_curved_surface(result):
    exact = surface_area(result.mesh, result.mesh.topology.external)
    errors = [1 - polydata.mesh_surface(result.mesh, n).area / exact for n in (2, 4, 8)]
    assert 0 < errors[2] < errors[1] / 3 < errors[0] / 9
    assert errors[2] < 0.003


def test_normals_are_smooth_across_elements_and_point_outwards(result):
    surface = polydata.mesh_surface(result.mesh, PIECES)
    regions = point_regions(surface, len(result.mesh.topology.external))
    normals = surface.point_data.active_normals
    pairs = cKDTree(surface.points).query_pairs(1e-3, output_type="ndarray")
    pairs = pairs[regions[pairs[:, 0]] == regions[pairs[:, 1]]]
    cosine = np.einsum("nx,nx->n", normals[pairs[:, 0]], normals[pairs[:, 1]])
    assert len(pairs) > 1000
    assert cosine.min() > np.cos(np.radians(2))
    flat = surface.compute_cell_sizes().cell_data["Area"] > 1e-6
    facets = np.asarray(surface.face_normals)[flat]
    corners = surface.regular_faces[flat]
    assert np.einsum("cx,cx->c", facets, normals[corners].mean(1)).min() > 0.8


def test_edges_are_each_there_once(result):
    _, around, along = result.mesh.topology.shape
    lines = polydata.mesh_edges(result.mesh, PIECES)
    on_endo_and_epi = 2 * (around * along + around * along)
    assert lines.n_lines == on_endo_and_epi + around
    assert lines.n_points == lines.n_lines * (PIECES + 1)


def test_edges_lie_on_the_surface(result):
    lines = polydata.mesh_edges(result.mesh, 3)
    assert polydata.to_mesh(lines.points, result.mesh).max() < 1e-4


def test_distance_to_the_mask_is_that_to_its_surface(ball):
    radii = np.array([0.0, 5.0, 8.9, 9.0, 10.5, 30.0])
    points = radii[:, None] * np.array([[2.0, -1.0, 2.0]]) / 3
    assert_allclose(polydata.to_mask(points, ball), np.abs(radii - RADIUS), atol=0.02)


def test_a_fine_mask_is_thinned_out_and_stays_where_it_is(ball):
    whole, thin = polydata.mask_surface(ball), polydata.mask_surface(ball, limit=1000)
    assert whole.n_cells > 5000
    assert thin.n_cells <= 1000
    assert_allclose(np.linalg.norm(thin.points, axis=1), RADIUS, atol=0.1)
    outward = thin.points / np.linalg.norm(thin.points, axis=1, keepdims=True)
    normals = thin.point_data.active_normals
    assert np.einsum("nx,nx->n", normals, outward).min() > 0.9
