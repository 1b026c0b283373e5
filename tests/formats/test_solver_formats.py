"""Meshes of simple cells for solvers: Abaqus, FEBio, openCARP and CHeart, read back."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from .cells import open_edges
from .simple import MESHIO, assert_same_cells, fields_of, written

# --- Abaqus --------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hex8", "hex20", "tet4", "tet10"])
def test_meshio_reads_abaqus(heart, kind, tmp_path, monkeypatch):
    meshio = pytest.importorskip("meshio")
    monkeypatch.setitem(meshio.abaqus._abaqus.num_nodes_per_cell, "wedge15", 15)  # it forgot
    monkeypatch.setitem(meshio._mesh.topological_dimension, "wedge15", 3)
    outcome, cells = written(heart, tmp_path, "inp", kind, fields_of(heart))
    assert "no place for the fields height, segment" in outcome.notes[1]
    found = meshio.read(tmp_path / "heart.inp")
    blocks = [(MESHIO[block.type], block.data) for block in found.cells]
    assert_same_cells(found.points, blocks, cells)
    starts = np.cumsum([0] + [len(nodes) for _, nodes in blocks])
    for name, members in cells.parts.items():
        label = name.upper().replace(" ", "_")
        parts = found.cell_sets[label]
        read = np.concatenate(
            [s + np.asarray(p, dtype=int) for s, p in zip(starts, parts, strict=False)]
        )
        assert_array_equal(np.sort(read), members)
    for name in heart.topology.surfaces:
        nodes = np.unique(np.concatenate([f.ravel() for f in cells.facets(name)]))
        assert_array_equal(np.sort(found.point_sets[name.upper()]), nodes)


ABAQUS_FACES = {
    8: [(1, 2, 3, 4), (5, 8, 7, 6), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 8, 4), (4, 8, 5, 1)],
    6: [(1, 2, 3), (4, 6, 5), (1, 4, 5, 2), (2, 5, 6, 3), (3, 6, 4, 1)],
    4: [(1, 2, 3), (1, 4, 2), (2, 4, 3), (3, 4, 1)],
}
"""Nodes of the faces S1, S2, ... in Abaqus's manual."""


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["hex8", "tet4"])
def test_surfaces_of_abaqus_are_those_of_the_mesh(heart, kind, tmp_path):
    _, cells = written(heart, tmp_path, "inp", kind)
    nodes = [n for block in cells.cells for n in block.nodes.tolist()]
    sets, surfaces, current = {}, {}, None
    for line in (tmp_path / "heart.inp").read_text().splitlines():
        if line.startswith("*"):
            options = dict(o.strip().split("=") for o in line.split(",")[1:] if "=" in o)
            kinds = {"*ELSET": sets, "*SURFACE": surfaces}
            current = kinds.get(line.split(",")[0])
            key = options.get("ELSET") or options.get("NAME")
            if current is not None:
                current[key] = []
        elif current is not None:
            current[key] += [word.strip() for word in line.split(",") if word.strip()]
    for name in heart.topology.surfaces:
        listed = surfaces[f"{name.upper()}_FACES"]
        found = set()
        for members, side in zip(listed[::2], listed[1::2], strict=True):
            for cell in map(int, sets[members]):
                of = nodes[cell - 1]
                face = ABAQUS_FACES[len(of)][int(side[1:]) - 1]
                found.add(frozenset(of[n - 1] for n in face))
        expected = {frozenset(f) for facets in cells.facets(name) for f in facets.tolist()}
        assert found == expected


def test_fibers_are_an_orientation_in_abaqus(usual, tmp_path):
    _, cells = written(usual, tmp_path, "inp", "tet4", fields_of(usual))
    lines = (tmp_path / "heart.inp").read_text().splitlines()
    start = lines.index("*DISTRIBUTION, NAME=FIBER_AXES, LOCATION=ELEMENT, TABLE=FIBER_TABLE") + 2
    rows = np.array([list(map(float, r.split(","))) for r in lines[start : start + cells.n_cells]])
    assert_array_equal(rows[:, 0], 1 + np.arange(cells.n_cells))
    assert_allclose(np.linalg.norm(rows[:, 1:4], axis=1), 1, atol=1e-12)
    assert_allclose(np.einsum("mx,mx->m", rows[:, 1:4], rows[:, 4:]), 0, atol=1e-12)


# --- FEBio ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "kind"),  # the model takes penta15 for tet15
    [("small", "hex8"), ("small", "tet10"), ("bricks", "hex20"), ("bricks", "tet4")],
)
def test_febio_file_is_read_by_its_model(name, kind, tmp_path, request):
    model = pytest.importorskip("pyfebio.model")
    mesh = request.getfixturevalue(name)
    _, cells = written(mesh, tmp_path, "feb", kind, fields_of(mesh)[:2])
    found = model.Model.from_xml((tmp_path / "heart.feb").read_bytes()).mesh_
    points = np.array([[*map(float, n.text.split(","))] for n in found.nodes[0].all_nodes])
    assert_allclose(points, cells.points, rtol=0, atol=1e-9)
    nodes = [n for block in cells.cells for n in block.nodes.tolist()]
    read = {
        e.id: [int(n) - 1 for n in e.text.split(",")]
        for d in found.elements
        for e in d.all_elements
    }
    assert [read[number] for number in sorted(read)] == nodes
    sides = {surface.name: surface for surface in found.surfaces}
    for surface in mesh.topology.surfaces:
        facets = [
            [int(n) - 1 for n in facet.text.split(",")]
            for of in ("tri3", "tri6", "quad4", "quad8", "quad9")
            for facet in getattr(sides[surface], f"all_{of}")
        ]
        assert facets == [f for group in cells.facets(surface) for f in group.tolist()]


@pytest.mark.slow
def test_febio_has_a_domain_for_each_region_and_kind(biv, tmp_path):
    _, cells = written(biv, tmp_path, "feb", "hex8")
    root = ET.parse(tmp_path / "heart.feb").getroot()
    domains = {d.get("name"): [int(e.get("id")) - 1 for e in d] for d in root.iter("Elements")}
    assert set(domains) == {
        "left ventricle hex8", "left ventricle penta6", "septum hex8", "right ventricle hex8"
    }  # fmt: skip
    assert domains["septum hex8"] == cells.parts["septum"].tolist()
    assert sorted(c for of in domains.values() for c in of) == list(range(cells.n_cells))


def test_febio_hex27_has_its_faces_in_febios_order(bricks, tmp_path):
    _, cells = written(bricks, tmp_path, "feb", "hex27")
    root = ET.parse(tmp_path / "heart.feb").getroot()
    nodes = np.array([[*map(int, e.text.split(","))] for e in root.iterfind(".//Elements/elem")])
    points = cells.points[nodes - 1]
    faces = [(0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7), (0, 1, 2, 3), (4, 5, 6, 7)]
    for n, face in enumerate(faces):  # as its own source has them
        straight = points[:, list(face)].mean(1)
        others = np.linalg.norm(points[:, 20:26] - straight[:, None], axis=-1)
        assert_array_equal(others.argmin(1), n)


def test_febio_holds_axes_and_fields(usual, tmp_path):
    _, cells = written(usual, tmp_path, "feb", "tet4", fields_of(usual))
    root = ET.parse(tmp_path / "heart.feb").getroot()
    axes = root.find(".//ElementData[@type='mat_axis']")
    assert axes.get("elem_set") == root.find(".//Elements").get("name")
    fiber = np.array([[*map(float, e.find("a").text.split(","))] for e in axes])
    assert_allclose(np.linalg.norm(fiber, axis=1), 1, atol=1e-12)
    segment = root.find(".//ElementData[@name='segment']")
    assert [float(e.text) for e in segment] == cells.cells[0].element.tolist()


# --- openCARP ------------------------------------------------------------------------------------


def test_opencarp_files_hold_the_mesh_in_micrometers(biv, tmp_path):
    outcome, cells = written(biv, tmp_path, "pts", "tet4", fields_of(biv))
    points = np.loadtxt(tmp_path / "heart.pts", skiprows=1)
    table = [line.split() for line in (tmp_path / "heart.elem").read_text().splitlines()]
    assert table[0] == [str(len(table) - 1)]
    assert {row[0] for row in table[1:]} == {"Tt"}
    nodes = np.array([row[1:] for row in table[1:]], dtype=int)
    assert_array_equal(nodes[:, 4], cells.part_numbers())
    assert_same_cells(points / 1000, [("tet4", nodes[:, :4])], cells)
    lines = (tmp_path / "heart.lon").read_text().splitlines()
    assert lines[0] == "1"
    assert_allclose(np.linalg.norm(np.loadtxt(lines[1:]), axis=1), 1, atol=1e-12)
    assert len(lines) == cells.n_cells + 1
    surfaces = [np.loadtxt(f, skiprows=1, usecols=(1, 2, 3), dtype=int) for f in outcome.files
                if f.suffix == ".surf"]  # fmt: skip
    assert len(surfaces) == len(biv.topology.surfaces)
    assert open_edges(surfaces) == 0
    assert "no place for the fields height, segment" in outcome.notes[1]


def test_opencarp_gets_no_fibers_if_there_are_none(usual, tmp_path):
    outcome, _ = written(usual, tmp_path, "pts", "tet4")
    assert ".lon" not in {file.suffix for file in outcome.files}


# --- CHeart --------------------------------------------------------------------------------------

VTK_FROM_CHEART = {
    "hex8": [0, 1, 3, 2, 4, 5, 7, 6],
    "tet4": [0, 1, 2, 3],
    "tet10": [0, 1, 2, 3, 4, 6, 5, 7, 8, 9],
}
"""Place in CHeart's order of each of VTK's nodes, as converters have it."""


@pytest.mark.parametrize(
    ("name", "kind"), [("usual", "tet4"), ("patch", "tet10"), ("hole", "hex8"), ("patch", "hex8")]
)
def test_cheart_files_hold_the_mesh(name, kind, tmp_path, request):
    mesh = request.getfixturevalue(name)
    outcome, cells = written(mesh, tmp_path, "cheart", kind)
    assert [f.name for f in outcome.files] == ["heart.X", "heart.T", "heart.B"]
    points = np.loadtxt(tmp_path / "heart.X", skiprows=1)
    nodes = np.loadtxt(tmp_path / "heart.T", skiprows=1, dtype=int) - 1
    assert (tmp_path / "heart.X").read_text().splitlines()[0] == f"{len(points)} 3"
    assert (tmp_path / "heart.T").read_text().splitlines()[0] == f"{len(nodes)} {len(points)}"
    assert_same_cells(points, [(kind, nodes[:, VTK_FROM_CHEART[kind]])], cells)
    boundary = np.loadtxt(tmp_path / "heart.B", skiprows=1, dtype=int)
    assert len(boundary) == sum(len(f) for f in cells.surfaces.values())
    for row in boundary:
        assert set(row[1:-1] - 1) <= set(nodes[row[0] - 1])
    patches = list(cells.surfaces)
    for patch, surface in enumerate(patches, start=1):
        of = set((boundary[boundary[:, -1] == patch, 1:-1] - 1).ravel())
        assert of == set(np.concatenate([f.ravel() for f in cells.facets(surface)]))
        assert f"{patch} {surface}" in outcome.notes[1]


def test_cheart_hex27_is_a_lattice_after_its_corners(bricks, tmp_path):
    straight = bricks.with_dofs(np.round(bricks.dofs))
    _, cells = written(straight, tmp_path, "cheart", "hex27")
    nodes = np.loadtxt(tmp_path / "heart.T", skiprows=1, dtype=int) - 1
    lattice = 2 * (cells.points[nodes[0]] / 3)  # the first brick has its axes along x, y, z
    corners, others = lattice[:8], lattice[8:]
    for part in (corners, others):
        assert_array_equal(np.lexsort(np.round(part).T), np.arange(len(part)))
    assert set(np.round(corners).ravel()) == {0, 2}
