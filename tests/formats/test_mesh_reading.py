"""Meshes read back: what was written, and what other software writes."""

from __future__ import annotations

from contextlib import suppress

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import heartgen
from heartgen.errors import InputError
from heartgen.formats import (
    READERS,
    convert,
    file_name,
    read_mesh,
    read_mesh_file,
    write_ex1,
    write_exf,
    write_mesh,
)
from heartgen.mesh import MeshField
from heartgen.mesh.bases import deviation
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.jacobian import volume
from heartgen.mesh.surface_faces import enclosed_volume
from heartgen.mesh.validity import certify

CLOSE = 1e-9
"""mm"""


def some_fields(mesh):
    around = mesh.topology.index[:, 1].max() + 1
    turn = (mesh.topology.index[:, 1, None] + lattice()[None, :, 0]) / around
    return [
        MeshField("turn", turn[..., None]),
        MeshField("place", mesh.lagrange_points()),
        MeshField("segment", np.arange(mesh.n_elements) % 17),
    ]


def as_set(faces):
    return {tuple(face) for face in faces.tolist()}


@pytest.mark.slow
@pytest.mark.parametrize("form", ["exf", "ex1", "vtu"])
def test_what_is_read_is_what_was_written(based, tmp_path, form):
    fields = some_fields(based)
    path = write_mesh(based, tmp_path / file_name("mesh", form), fields, form).files[0]
    found = read_mesh_file(path)
    assert found.notes == ()
    mesh, ours, theirs = found.mesh, based.topology, found.mesh.topology
    assert deviation(mesh, based) < CLOSE
    assert theirs.basis == (ours.basis if form.startswith("ex") else "lagrange")
    assert_array_equal(theirs.index, ours.index)
    assert as_set(theirs.collapsed) == as_set(ours.collapsed)
    for kind in ("surfaces", "patches"):
        named, expected = getattr(theirs, kind), getattr(ours, kind)
        assert {n: as_set(f) for n, f in named.items()} == {
            n: as_set(f) for n, f in expected.items()
        }
    assert {n: set(e.tolist()) for n, e in theirs.parts.items()} == {
        n: set(e.tolist()) for n, e in ours.parts.items()
    }
    assert [field.name for field in found.fields] == [field.name for field in fields]
    for field, wanted in zip(found.fields, fields, strict=True):
        assert_allclose(field.values, wanted.values, rtol=0, atol=CLOSE)


@pytest.mark.slow
def test_a_mesh_that_was_read_is_as_good_as_ours(heart, tmp_path):
    write_mesh(heart, tmp_path / "mesh.exf")
    write_mesh(heart, tmp_path / "mesh.vtu")
    for name in ("mesh.exf", "mesh.vtu"):
        mesh = heartgen.read_mesh(tmp_path / name)
        assert certify(mesh).all_valid == certify(heart).all_valid
        assert volume(mesh) == pytest.approx(volume(heart), rel=1e-12)
        assert enclosed_volume(mesh) == pytest.approx(enclosed_volume(heart), rel=1e-12)
        assert_allclose(mesh.topology.extraction @ mesh.topology.constant, 1, atol=1e-12)
    hermite = mesh.to_hermite()
    assert hermite.topology.basis == "hermite"
    assert deviation(hermite, heart) < CLOSE


@pytest.mark.slow
def test_exf_to_mesh_to_exf_is_identical(based, tmp_path):
    fields = some_fields(based)
    groups = {
        "scar": based.topology.surfaces["epi"][[7, 3]],
        "ring": np.flatnonzero(based.topology.index[:, 2] == 1),
    }
    write_exf(based, tmp_path / "mesh.exf", fields, groups)
    convert(tmp_path / "mesh.exf", tmp_path / "again.exf")
    assert (tmp_path / "again.exf").read_bytes() == (tmp_path / "mesh.exf").read_bytes()


@pytest.mark.slow
def test_ex1_holds_all_that_exf_does(usual, tmp_path):
    write_exf(usual, tmp_path / "mesh.exf", some_fields(usual))
    write_ex1(usual, tmp_path / "mesh.exelem", some_fields(usual))
    convert(tmp_path / "mesh.exnode", tmp_path / "again.exf")
    assert (tmp_path / "again.exf").read_bytes() == (tmp_path / "mesh.exf").read_bytes()


def test_bezier_cells_are_read(usual, tmp_path):
    write_mesh(usual, tmp_path / "mesh.vtu", some_fields(usual), "vtu-bezier")
    found = read_mesh_file(tmp_path / "mesh.vtu")
    assert deviation(found.mesh, usual) < CLOSE
    assert_allclose(found.fields[1].values, usual.lagrange_points(), atol=CLOSE)


def test_turned_elements_are_read(turned, tmp_path):
    write_exf(turned, tmp_path / "mesh.exf")
    assert deviation(read_mesh(tmp_path / "mesh.exf"), turned) < CLOSE


# --- files of other software ---------------------------------------------------------------------


@pytest.mark.slow
def test_what_zinc_writes_is_read(based, tmp_path):
    zinc = pytest.importorskip("cmlibs.zinc.context")
    fields = some_fields(based)
    write_exf(based, tmp_path / "mesh.exf", fields)
    context = zinc.Context("test")  # kept: with it goes the region
    region = context.getDefaultRegion()
    assert region.readFile(str(tmp_path / "mesh.exf")) == 1
    assert region.writeFile(str(tmp_path / "zinc.exf")) == 1
    found = read_mesh_file(tmp_path / "zinc.exf")
    assert deviation(found.mesh, based) < CLOSE
    assert set(found.mesh.topology.surfaces) == set(based.topology.surfaces)
    read = {field.name: field.values for field in found.fields}
    for field in fields:
        assert_allclose(read[field.name], field.values, rtol=0, atol=CLOSE)


NODES = """EX Version: 3
Region: /
!#nodeset nodes
Define node template: node1
Shape. Dimension=0
#Fields=1
1) coordinates, coordinate, rectangular cartesian, real, #Components=3
 x. #Values=8 (value,d/ds1,d/ds2,d2/ds1ds2,d/ds3,d2/ds1ds3,d2/ds2ds3,d3/ds1ds2ds3)
 y. #Values=8 (value,d/ds1,d/ds2,d2/ds1ds2,d/ds3,d2/ds1ds3,d2/ds2ds3,d3/ds1ds2ds3)
 z. #Values=8 (value,d/ds1,d/ds2,d2/ds1ds2,d/ds3,d2/ds1ds3,d2/ds2ds3,d3/ds1ds2ds3)
Node template: node1
"""

ALL = "value d/ds1 d/ds2 d2/ds1ds2 d/ds3 d2/ds1ds3 d2/ds2ds3 d3/ds1ds2ds3"


def foreign_file(path, first, factors):
    """One element of eight nodes with scale factors.

    `first` tells how its first node is taken: nodes, labels and scale factors of each entry.
    """
    values = np.random.default_rng(0).standard_normal((8, 3, 8))
    lines, zeros = [NODES.rstrip()], ",".join("0" for _ in factors)
    for node, components in enumerate(values, 1):
        lines += [f"Node: {node}", *(" ".join(map(repr, map(float, c))) for c in components)]
    lines += [
        "!#mesh mesh3d, dimension=3, nodeset=nodes",
        "Define element template: element1",
        "Shape. Dimension=3, line*line*line",
        "#Scale factor sets=1",
        f' scaling1, #Scale factors={len(factors)}, identifiers="element_general({zeros})"',
        *("#Nodes=8", "#Fields=1"),
        "1) coordinates, coordinate, rectangular cartesian, real, #Components=3",
    ]
    for component in "xyz":
        lines.append(
            f" {component}. c.Hermite*c.Hermite*c.Hermite, no modify, standard node based."
            " scale factor set=scaling1"
        )
        lines.append("  #Nodes=8")
        others = [(node, ALL, "0 0 0 0 0 0 0 0") for node in range(2, 9)]
        for nodes, labels, indices in (*first, *others):
            lines += [f"  {nodes}. #Values={len(labels.split())}", f"   Value labels: {labels}"]
            lines += [f"   Scale factor indices: {indices}"]
    lines += ["Element template: element1", "Element: 7", " Nodes:", " 1 2 3 4 5 6 7 8"]
    lines += [" Scale factors:", " " + " ".join(map(str, factors))]
    path.write_text("\n".join(lines) + "\n")


SCALED = {
    "arc length": ([(1, ALL, "0 1 2 1*2 3 1*3 2*3 1*2*3")], [2.0, 3.0, 0.5]),
    "rotated": (
        [
            (
                1,
                "value d/ds3 d/ds2 d2/ds2ds3 d/ds1 d2/ds1ds3 d2/ds1ds2 d3/ds1ds2ds3",
                "0 0 0 0 1 1 1 1",
            )
        ],
        [-1.0],
    ),
    "sums at a pole": (
        [
            (1, "value", "0"),
            (0, "zero", "0"),
            ("1+1", "d/ds1+d/ds2 d/ds1+d/ds2", "1+2 3*2+3*1"),
            (1, "d/ds3", "0"),
            (0, "zero", "0"),
            ("1+2", "d2/ds1ds3+d2/ds2ds3", "1+0"),
            (1, "d2/ds1ds3", "2*3"),
        ],
        [0.8, 0.6, -0.5],
    ),
}


@pytest.mark.parametrize("case", SCALED)
def test_scale_factors_and_sums_are_zincs(tmp_path, case):
    zinc = pytest.importorskip("cmlibs.zinc.context")
    foreign_file(tmp_path / "mesh.exf", *SCALED[case])
    context = zinc.Context("test")
    assert context.getDefaultRegion().readFile(str(tmp_path / "mesh.exf")) == 1
    module = context.getDefaultRegion().getFieldmodule()
    field, cache = module.findFieldByName("coordinates"), module.createFieldcache()
    element = module.findMeshByDimension(3).findElementByIdentifier(7)
    mesh = read_mesh(tmp_path / "mesh.exf")
    xi = np.random.default_rng(1).random((10, 3))
    for at, place in zip(xi.tolist(), mesh.evaluate(xi)[0], strict=True):
        cache.setMeshLocation(element, at)
        assert_allclose(field.evaluateReal(cache, 3)[1], place, rtol=0, atol=1e-12)
    assert set(mesh.topology.surfaces) == {"other"}


@pytest.mark.parametrize("compressor", ["None", "ZLib"])
@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended"])
@pytest.mark.parametrize("order", ["LittleEndian", "BigEndian"])
def test_every_encoding_that_vtk_writes_is_read(usual, tmp_path, compressor, mode, order):
    io = pytest.importorskip("vtkmodules.vtkIOXML")
    write_mesh(usual, tmp_path / "mesh.vtu", some_fields(usual))
    reader, writer = io.vtkXMLUnstructuredGridReader(), io.vtkXMLUnstructuredGridWriter()
    reader.SetFileName(str(tmp_path / "mesh.vtu"))
    writer.SetInputConnection(reader.GetOutputPort())
    getattr(writer, f"SetCompressorTypeTo{compressor}")()
    getattr(writer, f"SetDataModeTo{mode}")()
    getattr(writer, f"SetByteOrderTo{order}")()
    writer.SetBlockSize(2**13)  # so that arrays have several
    for encoded in (False, True):
        writer.SetEncodeAppendedData(encoded)
        writer.SetHeaderTypeToUInt64() if encoded else writer.SetHeaderTypeToUInt32()
        writer.SetFileName(str(tmp_path / "vtk.vtu"))
        writer.Write()
        found = read_mesh_file(tmp_path / "vtk.vtu")
        assert deviation(found.mesh, usual) < CLOSE
        assert_allclose(found.fields[1].values, usual.lagrange_points(), atol=CLOSE)


def test_the_order_of_edges_before_vtk_9_1_is_known(usual, tmp_path):
    io = pytest.importorskip("vtkmodules.vtkIOXML")
    write_mesh(usual, tmp_path / "mesh.vtu")
    text = (tmp_path / "mesh.vtu").read_text().replace('version="2.2"', 'version="1.0"')
    (tmp_path / "old.vtu").write_text(text)
    reader = io.vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "old.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    core = pytest.importorskip("vtkmodules.vtkCommonCore")
    place, weights = [0.0] * 3, [0.0] * 64
    mesh = read_mesh(tmp_path / "old.vtu")
    xi = np.random.default_rng(0).random((4, 3))
    for at, ours in zip(xi.tolist(), mesh.evaluate(xi)[20], strict=True):
        grid.GetCell(20).EvaluateLocation(core.reference(0), at, place, weights)
        assert_allclose(place, ours, atol=CLOSE)
    assert deviation(mesh, usual) > 1


# --- files that are none -------------------------------------------------------------------------


@pytest.mark.parametrize("name", [f"mesh{ending}" for ending in READERS])
@pytest.mark.parametrize("content", [b"", b"hello\n", b"\xff\xfe\x00", b"<VTKFile type='Image'/>"])
def test_what_is_no_mesh_is_a_sentence(tmp_path, name, content):
    with pytest.raises(InputError, match=name[:4]):
        read_mesh(tmp_path / name)
    for ending in (".exnode", ".exelem"):
        (tmp_path / "mesh").with_suffix(ending).write_bytes(content)
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=r"mesh\.\w+: .*: (give|the)"):
        read_mesh(tmp_path / name)


@pytest.mark.parametrize("form", ["exf", "vtu"])
def test_a_damaged_file_is_a_sentence_or_a_mesh(small, tmp_path, form):
    path = tmp_path / f"mesh.{form}"
    write_mesh(small, path, some_fields(small))
    whole, chance = path.read_bytes(), np.random.default_rng(0)
    for _ in range(60):
        start, length = chance.integers(len(whole)), chance.integers(1, 200)
        path.write_bytes(whole[:start] + whole[start + length :])
        with suppress(InputError):
            read_mesh_file(path)


def test_other_cells_and_fields_are_told(small, tmp_path):
    write_mesh(small, tmp_path / "mesh.exf")
    text = (tmp_path / "mesh.exf").read_text()
    linear = text.replace("c.Hermite*c.Hermite*c.Hermite", "c.Hermite*c.Hermite*l.simplex(3)")
    (tmp_path / "other.exf").write_text(linear)
    with pytest.raises(InputError, match=r"the basis .* is not known"):
        read_mesh(tmp_path / "other.exf")
    polar = text.replace("rectangular cartesian", "prolate spheroidal, focus=35")
    (tmp_path / "polar.exf").write_text(polar)
    with pytest.raises(InputError, match="prolate spheroidal"):
        read_mesh(tmp_path / "polar.exf")
    grid = (tmp_path / "mesh.vtu", tmp_path / "hex.vtu")
    write_mesh(small, grid[0])
    grid[1].write_text(grid[0].read_text().replace("UnstructuredGrid", "PolyData"))
    with pytest.raises(InputError, match="it holds PolyData"):
        read_mesh(grid[1])
    with pytest.raises(InputError, match=r"end.* in \.exf or"):
        read_mesh(tmp_path / "mesh.stl")
