"""Surfaces as triangles: STL, PLY, OBJ and glTF, read by somebody else's reader."""

from __future__ import annotations

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

from .cells import vtk_volumes
from .simple import written


@pytest.mark.slow
@pytest.mark.parametrize("ending", ["stl", "ply", "obj", "glb"])
def test_surfaces_are_closed_and_hold_the_volume(heart, ending, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    _, cells = written(heart, tmp_path, ending, "tet4")
    whole = trimesh.load(tmp_path / f"heart.{ending}", force="mesh", process=False)
    whole.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=8)
    scale = 1e9 if ending == "glb" else 1
    expected = vtk_volumes("tet4", cells.points[cells.cells[0].nodes])[0].sum()
    assert whole.is_watertight
    assert whole.is_winding_consistent
    assert scale * whole.volume == pytest.approx(expected, rel=1e-5 if ending == "glb" else 1e-9)


def test_gltf_keeps_the_names_of_surfaces(biv, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    _, cells = written(biv, tmp_path, "glb", "tet4")
    scene = trimesh.load(tmp_path / "heart.glb", force="scene", process=False)
    found = {name: len(each.faces) for name, each in scene.geometry.items()}
    assert found == {name: len(faces) for name, faces in cells.surfaces.items()}


def test_obj_has_a_group_for_each_surface(biv, tmp_path):
    _, cells = written(biv, tmp_path, "obj", "tet4")
    groups = (tmp_path / "heart.obj").read_text().split("\ng ")[1:]
    found = {lines.splitlines()[0]: lines.count("\nf ") for lines in groups}
    assert found == {name: len(faces) for name, faces in cells.surfaces.items()}


def test_vtk_reads_the_solids_of_stl(biv, tmp_path):
    geometry = pytest.importorskip("vtkmodules.vtkIOGeometry")
    to_numpy = pytest.importorskip("vtkmodules.util.numpy_support").vtk_to_numpy
    _, cells = written(biv, tmp_path, "stl", "tet4")
    reader = geometry.vtkSTLReader()
    reader.SetFileName(str(tmp_path / "heart.stl"))
    reader.ScalarTagsOn()
    reader.Update()
    solids = to_numpy(reader.GetOutput().GetCellData().GetArray("STLSolidLabeling"))
    assert np.bincount(solids.astype(int)).tolist() == [len(f) for f in cells.surfaces.values()]
    names = [line for line in (tmp_path / "heart.stl").read_text().splitlines()
             if line.startswith("solid")]  # fmt: skip
    assert names == [f"solid {name}" for name in cells.surfaces]


def test_ply_numbers_the_surface_of_each_face(biv, tmp_path):
    meshio = pytest.importorskip("meshio")
    _, cells = written(biv, tmp_path, "ply", "tet4")
    numbers = np.concatenate(meshio.read(tmp_path / "heart.ply").cell_data["surface"])
    expected = [n for n, f in enumerate(cells.surfaces.values(), 1) for _ in f]
    assert numbers.tolist() == expected


def test_gltf_stands_upright_in_meters(usual, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    written(usual, tmp_path, "glb", "tet4")
    scene = trimesh.load(tmp_path / "heart.glb", force="scene", process=False)
    x, y, z = np.moveaxis(usual.lagrange_points(), -1, 0)
    low, high = scene.bounds
    assert_allclose(low, [x.min() / 1e3, z.min() / 1e3, -y.max() / 1e3], atol=1e-3)
    assert_allclose(high, [x.max() / 1e3, z.max() / 1e3, -y.min() / 1e3], atol=1e-3)
    size = int.from_bytes((tmp_path / "heart.glb").read_bytes()[12:16], "little")
    content = json.loads((tmp_path / "heart.glb").read_bytes()[20 : 20 + size])
    assert content["asset"]["version"] == "2.0"
