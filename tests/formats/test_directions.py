"""Fibers and sheets are orthonormal in every file that samples them."""

from __future__ import annotations

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from heartgen.fields import make_fields
from heartgen.formats import Resampling, file_name, write_mesh
from heartgen.formats.directions import FIBER, SHEET, SHEET_NORMAL, orthonormal, restored
from heartgen.formats.resampling import resample
from heartgen.formats.resampling.data import sample
from heartgen.mesh import MeshField

NAMES = (FIBER, SHEET, SHEET_NORMAL)

DEGREES = 1e-3
"""How far from a right angle directions may be."""


def off(*axes):
    """Largest deviation from right angles (degrees) and from length 1 of directions (n, 3)."""
    axes = np.stack(axes, -1)
    products = np.swapaxes(axes, -1, -2) @ axes
    lengths = np.sqrt(np.einsum("nii->ni", products))
    angles = np.degrees(np.arcsin(np.abs(products[:, *np.triu_indices(axes.shape[-1], 1)])))
    return angles.max(initial=0), np.abs(lengths - 1).max()


def assert_orthonormal(*axes):
    angle, length = off(*axes)
    assert angle < DEGREES
    assert length < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hex8", "hex20", "hex27", "tet4", "tet10"])
def test_data_of_points_and_cells_are_orthonormal(heart, kind):
    cells, fields = resample(heart, Resampling(kind, (2, 2, 2))), make_fields(heart, ["fibers"])
    data = sample(cells, fields)
    assert_orthonormal(*(data.cells[name] for name in NAMES))
    assert_orthonormal(*data.directions())
    inside = [data.points[name] for name in NAMES if name in data.points]
    if inside:
        assert_allclose(np.linalg.norm(inside, axis=-1), 1, rtol=0, atol=1e-9)


def test_cubics_alone_are_far_from_a_right_angle(usual):
    """What the above would not find if there were nothing to do."""
    fiber, sheet, _ = make_fields(usual, ["fibers"])
    xi = np.random.default_rng(0).random((20, 3))
    axes = [field.evaluate(xi).reshape(-1, 3) for field in (fiber, sheet)]
    axes = [axis / np.linalg.norm(axis, axis=1, keepdims=True) for axis in axes]
    assert off(*axes)[0] > 100 * DEGREES


@pytest.mark.slow
def test_opencarp_has_right_angles(heart, tmp_path):
    path = tmp_path / file_name("heart", "pts")
    write_mesh(heart, path, make_fields(heart), "pts")
    found = np.loadtxt(path.with_suffix(".lon"), skiprows=1)
    assert_orthonormal(found[:, :3], found[:, 3:])


@pytest.mark.slow
def test_febio_has_right_angles(heart, tmp_path):
    path = tmp_path / file_name("heart", "feb")
    write_mesh(heart, path, make_fields(heart, ["fibers"]), "feb")
    text = path.read_text()
    axes = [
        np.array([row.split(",") for row in re.findall(f"<{tag}>(.*?)</{tag}>", text)], float)
        for tag in "ad"
    ]
    assert_orthonormal(*axes)


@pytest.mark.slow
def test_abaqus_has_right_angles(heart, tmp_path):
    path = tmp_path / file_name("heart", "inp")
    write_mesh(heart, path, make_fields(heart, ["fibers"]), "inp")
    (table,) = re.findall(r"\*DISTRIBUTION, .*?\n(.*?)\n\*", path.read_text(), re.S)
    rows = [line.split(",") for line in table.splitlines()]
    found = np.array([row[1:] for row in rows if row[0].strip()], float)
    assert_orthonormal(found[:, :3], found[:, 3:6])


@pytest.mark.slow
@pytest.mark.parametrize("form", ["vtu-cells", "xdmf"])
def test_grids_have_right_angles(heart, form, tmp_path):
    pv = pytest.importorskip("pyvista")
    path = tmp_path / file_name("heart", form)
    write_mesh(heart, path, make_fields(heart, ["fibers"]), form)
    grid = pv.read(path)
    for data in (grid.point_data, grid.cell_data):
        there = [np.asarray(data[name]) for name in NAMES if name in data]
        if there:
            assert_orthonormal(*there)


@pytest.mark.parametrize("form", ["vtu", "vtk"])
def test_points_of_cubic_cells_have_right_angles(heart, form, tmp_path):
    pv = pytest.importorskip("pyvista")
    path = tmp_path / file_name("heart", form)
    write_mesh(heart, path, make_fields(heart, ["fibers"]), form)
    grid = pv.read(path)
    assert_orthonormal(*(np.asarray(grid.point_data[name]) for name in NAMES))


def test_mfem_has_right_angles(heart, tmp_path):
    path = tmp_path / file_name("heart", "mfem")
    write_mesh(heart, path, make_fields(heart, ["fibers"]), "mfem")
    files = [path.with_name(f"{path.stem}-{name.replace(' ', '_')}.gf") for name in NAMES]
    axes = [np.loadtxt(file, skiprows=5) for file in files]
    assert_orthonormal(*axes)


def test_fields_that_are_not_orthonormal_stay_as_they_are(usual):
    places = usual.lagrange_points()
    fields = [MeshField(FIBER, 3 * places), MeshField(SHEET, places[..., ::-1])]
    sampled = {field.name: field.values[:, 0] for field in fields}
    kept = restored(fields, sampled)
    assert all(kept[name] is sampled[name] for name in sampled)


def test_parallel_and_absent_directions():
    along, nothing = np.array([[0.0, 0.0, 2.0]]), np.zeros((1, 3))
    assert_orthonormal(*orthonormal([along, along, along]))
    assert_allclose(orthonormal([along, nothing])[1], nothing)
    assert_allclose(orthonormal([nothing, along])[1], along / 2)


def test_fibers_keep_their_direction():
    rng = np.random.default_rng(0)
    given = [rng.standard_normal((50, 3)) for _ in range(3)]
    fiber, sheet, normal = orthonormal(given)
    assert_allclose(np.cross(fiber, given[0]), 0, rtol=0, atol=1e-12)
    assert_allclose(np.einsum("nx,nx->n", np.cross(given[0], given[1]), sheet), 0, atol=1e-12)
    assert np.all(np.einsum("nx,nx->n", given[2], normal) > 0)
