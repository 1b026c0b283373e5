"""Every format, from every topology in both bases, as somebody else's reader sees it.

Of exact formats the volume is that of the mesh, of the others that of the cells it was cut into.
CHeart and openCARP have no reader in Python: their tables are read as such, and VTK's own shape
functions say how large the cells are. What they hold in detail is tested in the other files.
"""

from __future__ import annotations

import numpy as np
import pytest

from heartgen.formats import FORMATS, file_name, write_mesh
from heartgen.formats.resampling.cell_files import CellFormat
from heartgen.mesh.jacobian import volume
from heartgen.mesh.quadrature import EXACT, gauss_cube

from .cells import KIND_OF_TYPE, vtk_volumes
from .simple import MESHIO, written
from .test_foreign import READERS, gmsh_ends  # noqa: F401 - ends Gmsh after every test
from .test_solver_formats import VTK_FROM_CHEART

METERS = 1e9
"""mm^3 in a cubic meter, glTF's."""


def by_meshio(files):
    meshio = pytest.importorskip("meshio")
    found = meshio.read(next(f for f in files if f.suffix == ".inp"))
    return sum(vtk_volumes(MESHIO[b.type], found.points[b.data])[0].sum() for b in found.cells)


def by_pyvista(files):
    grid = pytest.importorskip("pyvista").read(files[0])
    points = np.asarray(grid.points)
    return sum(
        vtk_volumes(KIND_OF_TYPE[int(kind)], points[nodes])[0].sum()
        for kind, nodes in grid.cells_dict.items()
    )


def by_febio(files):
    model = pytest.importorskip("pyfebio.model")
    found = model.Model.from_xml(files[0].read_bytes()).mesh_
    points = np.array([[*map(float, n.text.split(","))] for n in found.nodes[0].all_nodes])
    kinds = {8: "hex8", 6: "wedge6"}
    cells = [
        [int(n) - 1 for n in e.text.split(",")] for d in found.elements for e in d.all_elements
    ]
    return sum(vtk_volumes(kinds[len(nodes)], points[None, nodes])[0].sum() for nodes in cells)


def by_trimesh(files):
    trimesh = pytest.importorskip("trimesh")
    whole = trimesh.load(files[0], force="mesh", process=False)
    whole.merge_vertices(merge_tex=True, merge_norm=True, digits_vertex=8)
    return whole.volume * (METERS if files[0].suffix == ".glb" else 1)


def as_opencarp(files):
    points = np.loadtxt(files[0].with_suffix(".pts"), skiprows=1) / 1000
    nodes = np.loadtxt(files[0].with_suffix(".elem"), skiprows=1, usecols=(1, 2, 3, 4), dtype=int)
    return vtk_volumes("tet4", points[nodes])[0].sum()


def as_cheart(files):
    points = np.loadtxt(files[0].with_suffix(".X"), skiprows=1)
    nodes = np.loadtxt(files[0].with_suffix(".T"), skiprows=1, dtype=int) - 1
    return vtk_volumes("tet10", points[nodes[:, VTK_FROM_CHEART["tet10"]]])[0].sum()


SIMPLE = {
    "vtu-cells": by_pyvista,
    "xdmf": by_pyvista,
    "inp": by_meshio,
    "feb": by_febio,
    "pts": as_opencarp,
    "cheart": as_cheart,
    **dict.fromkeys(("stl", "ply", "obj", "glb"), by_trimesh),
}


def by_quadrature(reader, files):
    xi, weights = gauss_cube((EXACT,) * 3)
    return float((reader(files).determinants(xi) @ weights).sum())


@pytest.mark.slow
@pytest.mark.parametrize("form", FORMATS)
def test_somebody_else_finds_the_volume(based, form, tmp_path):
    how = FORMATS[form].write
    if isinstance(how, CellFormat):
        outcome, cells = written(based, tmp_path, form, how.usual.kind)
        found = SIMPLE[form](outcome.files)
        expected = sum(
            vtk_volumes(b.kind.name, cells.points[b.nodes])[0].sum() for b in cells.cells
        )
        assert found == pytest.approx(expected, rel=1e-5 if form == "glb" else 1e-9)
    else:
        outcome = write_mesh(based, tmp_path / file_name("heart", form), format=form)
        found = by_quadrature(dict(READERS)[form], outcome.files)
        assert found == pytest.approx(volume(based), rel=1e-9)
