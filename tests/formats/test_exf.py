"""EX files, read by zinc: the field's own reader."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from heartgen.errors import MeshError
from heartgen.formats import write_exf
from heartgen.mesh.quadrature import gauss_cube
from heartgen.mesh.surface_faces import evaluate_faces

Context = pytest.importorskip("cmlibs.zinc.context").Context
Node = pytest.importorskip("cmlibs.zinc.node").Node

CLOSE = 1e-9
"""mm; the files are exact, zinc's sums are rounded."""

DERIVATIVES = {
    (0, 0, 0): Node.VALUE_LABEL_VALUE,
    (1, 0, 0): Node.VALUE_LABEL_D_DS1,
    (0, 1, 0): Node.VALUE_LABEL_D_DS2,
    (1, 1, 0): Node.VALUE_LABEL_D2_DS1DS2,
    (0, 0, 1): Node.VALUE_LABEL_D_DS3,
    (1, 0, 1): Node.VALUE_LABEL_D2_DS1DS3,
    (0, 1, 1): Node.VALUE_LABEL_D2_DS2DS3,
    (1, 1, 1): Node.VALUE_LABEL_D3_DS1DS2DS3,
}


class Reading:
    """What zinc finds in a file."""

    def __init__(self, path):
        self.context = Context("test")
        self.region = self.context.getDefaultRegion()
        self.ok = self.region.readFile(str(path)) == 1
        log = self.context.getLogger()
        self.messages = [log.getMessageTextAtIndex(i + 1) for i in range(log.getNumberOfMessages())]
        self.module = self.region.getFieldmodule()
        self.coordinates = self.module.findFieldByName("coordinates").castFiniteElement()
        self.nodes = self.module.findNodesetByName("nodes")

    def mesh(self, dimension):
        return self.module.findMeshByDimension(dimension)

    def sizes(self):
        return [self.nodes.getSize(), *(self.mesh(d).getSize() for d in (1, 2, 3))]

    def group(self, name, dimension):
        group = self.module.findFieldByName(name).castGroup()
        assert group.isValid(), name
        whole = self.mesh(dimension) if dimension else self.nodes
        part = group.getMeshGroup(whole) if dimension else group.getNodesetGroup(whole)
        if not part.isValid():
            return []
        each = part.createElementiterator() if dimension else part.createNodeiterator()
        return members(each)

    def evaluate(self, elements, xi, field=None):
        """(elements, xi, 3)."""
        field, cache = field or self.coordinates, self.module.createFieldcache()
        out = np.full((len(elements), len(xi), 3), np.nan)
        for e, element in enumerate(elements):
            for q, place in enumerate(xi.tolist()):
                cache.setMeshLocation(element, place)
                answer, out[e, q] = field.evaluateReal(cache, 3)
                assert answer == 1
        return out

    def parameter(self, node, label, version=1):
        cache = self.module.createFieldcache()
        cache.setNode(self.nodes.findNodeByIdentifier(node))
        answer, values = self.coordinates.getNodeParameters(cache, -1, label, version, 3)
        return np.array(values) if answer == 1 else None


def members(iterator):
    out = []
    while (member := iterator.next()).isValid():
        out.append(member)
    return out


@pytest.fixture
def written(tmp_path):
    def write(mesh, **options):
        write_exf(mesh, tmp_path / "mesh.exf", **options)
        reading = Reading(tmp_path / "mesh.exf")
        assert reading.ok
        assert reading.messages == []
        return reading

    return write


def all_elements(reading):
    return members(reading.mesh(3).createElementiterator())


def as_set(points):
    """Points in an order of their own, for comparison as sets."""
    points = np.asarray(points).reshape(-1, 3)
    return points[np.lexsort(np.round(points, 6).T)]


# --- geometry ------------------------------------------------------------------------------------


@pytest.mark.slow
def test_every_place_of_every_element_is_ours(mesh, written):
    reading = written(mesh)
    xi = np.random.default_rng(0).random((12, 3))
    assert_allclose(
        reading.evaluate(all_elements(reading), xi), mesh.evaluate(xi), rtol=0, atol=CLOSE
    )


def test_no_element_folds(mesh, written):
    reading = written(mesh)
    xi, _ = gauss_cube((4, 4, 4))
    elements = all_elements(reading)
    columns = [
        reading.evaluate(
            elements, xi, reading.module.createFieldDerivative(reading.coordinates, d + 1)
        )
        for d in range(3)
    ]
    jacobian = np.stack(columns, -1)
    assert_allclose(jacobian, mesh.gradient(xi), rtol=0, atol=CLOSE)
    assert np.linalg.det(jacobian).min() > 0


def test_elements_with_other_axes_meet_at_shared_nodes(turned, written):
    reading = written(turned)
    assert reading.sizes() == [12, 20, 11, 2]
    xi = np.random.default_rng(1).random((20, 3))
    assert_allclose(
        reading.evaluate(all_elements(reading), xi), turned.evaluate(xi), rtol=0, atol=CLOSE
    )
    faces = reading.group("epicardium", 2)
    middle = np.full((1, 2), 0.5)
    expected, _ = evaluate_faces(turned, turned.topology.surfaces["epi"], middle)
    assert_allclose(as_set(reading.evaluate(faces, middle)), as_set(expected), rtol=0, atol=CLOSE)


def test_other_formats_that_zinc_writes_from_it_are_exact(usual, written, tmp_path):
    # FieldML keeps neither scale factors, nor sums, nor implied zeros: the file needs none.
    original = written(usual)
    assert original.region.writeFile(str(tmp_path / "mesh.fieldml")) == 1
    converted = Reading(tmp_path / "mesh.fieldml")
    assert converted.ok
    xi = np.random.default_rng(2).random((5, 3))
    assert_allclose(
        converted.evaluate(all_elements(converted), xi), usual.evaluate(xi), rtol=0, atol=CLOSE
    )


def test_nothing_is_implied(usual, tmp_path):
    write_exf(usual, tmp_path / "mesh.exf")
    text = (tmp_path / "mesh.exf").read_text()
    assert set(re.findall(r"#Scale factor sets=(\d+)", text)) == {"0"}
    labels = set(re.findall(r"(?:Value labels: )(.*)", text))
    assert labels
    assert not any(re.search(r"zero|\+|\*", label) for label in labels)


# --- nodes and their parameters ------------------------------------------------------------------


def cup_dofs(mesh):
    """Degrees of freedom (layer, radial derivative, surface one, space) of a cup."""
    radial, around, along = mesh.topology.shape
    return mesh.dofs.reshape(radial + 1, 2, 3 + 4 * around * along, 3)


def test_parameters_of_a_node_are_the_degrees_of_freedom_to_the_bit(usual, written):
    reading = written(usual)
    dofs = cup_dofs(usual)
    per_layer = 1 + (dofs.shape[2] - 3) // 4
    for layer in range(len(dofs)):
        for node in range(1, per_layer):
            for (d1, d2, d3), label in DERIVATIVES.items():
                value = reading.parameter(layer * per_layer + node + 1, label)
                assert_array_equal(value, dofs[layer, d3, 3 + 4 * (node - 1) + d1 + 2 * d2])
                assert reading.parameter(layer * per_layer + node + 1, label, version=2) is None


def test_pole_is_one_node_with_one_tangent_plane(usual, written):
    reading = written(usual)
    dofs, around = cup_dofs(usual), usual.topology.shape[1]
    per_layer = 1 + (dofs.shape[2] - 3) // 4
    angle = 2 * np.pi * np.arange(around) / around
    for layer in range(len(dofs)):
        pole = layer * per_layer + 1
        assert_array_equal(reading.parameter(pole, Node.VALUE_LABEL_VALUE), dofs[layer, 0, 0])
        assert_array_equal(reading.parameter(pole, Node.VALUE_LABEL_D_DS3), dofs[layer, 1, 0])
        assert_array_equal(reading.parameter(pole, Node.VALUE_LABEL_D_DS1), np.zeros(3))
        assert_array_equal(reading.parameter(pole, Node.VALUE_LABEL_D2_DS1DS3), np.zeros(3))
        for d3, label in enumerate([Node.VALUE_LABEL_D_DS2, Node.VALUE_LABEL_D2_DS2DS3]):
            a, b = dofs[layer, d3, 1:3]
            expected = np.outer(np.cos(angle), a) + np.outer(np.sin(angle), b)
            versions = [reading.parameter(pole, label, v + 1) for v in range(around)]
            assert_allclose(versions, expected, rtol=0, atol=CLOSE)
            assert reading.parameter(pole, label, around + 1) is None


# --- faces, lines, groups ------------------------------------------------------------------------


def test_mesh_is_one_piece_without_holes(mesh, written):
    reading = written(mesh)
    radial, around, along = mesh.topology.shape
    nodes, lines, faces, elements = sizes = reading.sizes()
    assert nodes == (radial + 1) * (1 + around * along)
    assert elements == mesh.n_elements
    assert nodes - lines + faces - elements == 1  # Euler characteristic of a ball
    reading.module.defineAllFaces()
    assert reading.sizes() == sizes, "zinc had faces or lines to add"


def test_lines_are_the_edges_of_the_elements(mesh, written):
    reading = written(mesh)
    edges = []
    for axis in range(3):
        for end in [(0, 0), (0, 1), (1, 0), (1, 1)]:
            xi = np.insert(np.array([end, end, end], dtype=float), axis, [0, 0.5, 1], axis=1)
            start, middle, stop = mesh.evaluate(xi).transpose(1, 0, 2)
            edges.append(middle[np.linalg.norm(stop - start, axis=1) > CLOSE])  # not collapsed
    middles = np.concatenate(edges)
    _, once = np.unique(np.round(middles, 6), axis=0, return_index=True)
    lines = members(reading.mesh(1).createElementiterator())
    found = reading.evaluate(lines, np.array([[0.5]]))
    assert_allclose(as_set(found), as_set(middles[once]), rtol=0, atol=CLOSE)


def test_surfaces_have_the_names_of_the_field(mesh, written):
    reading = written(mesh)
    middle = np.full((1, 2), 0.5)
    for ours, theirs in {
        "lv_endo": "endocardium of left ventricle",
        "epi": "epicardium",
        "base": "base of heart",
    }.items():
        faces = mesh.topology.surfaces[ours]
        group = reading.group(theirs, 2)
        assert len(group) == len(faces)
        expected, _ = evaluate_faces(mesh, faces, middle)
        assert_allclose(
            as_set(reading.evaluate(group, middle)), as_set(expected), rtol=0, atol=CLOSE
        )
        assert reading.group(theirs, 3) == []
        assert len(reading.group(theirs, 0)) == len(np.unique(corner_nodes(mesh, faces)))
        # A disk (endo, epi) or a ring (base).
        euler = len(reading.group(theirs, 0)) - len(reading.group(theirs, 1)) + len(group)
        assert euler == (0 if ours == "base" else 1)


def corner_nodes(mesh, faces):
    """Corner nodes of faces (f, 2), by the positions of their corners."""
    unit = np.array([[u, v] for v in (0.0, 1.0) for u in (0.0, 1.0)])
    points, _ = evaluate_faces(mesh, faces, unit)
    return np.unique(np.round(points.reshape(-1, 3), 6), axis=0, return_inverse=True)[1]


def test_wall_and_apex_are_named(mesh, written):
    reading = written(mesh)
    counts = [len(reading.group("left ventricle myocardium", d)) for d in range(4)]
    assert counts == reading.sizes()
    (apex,) = reading.group("apex of heart", 0)
    radial = mesh.topology.shape[0]
    at_apex = np.flatnonzero((mesh.topology.index == [radial - 1, 0, 0]).all(1))
    expected = mesh.evaluate(np.array([[0.0, 0.0, 1.0]]))[at_apex[0], 0]
    place = reading.parameter(apex.getIdentifier(), Node.VALUE_LABEL_VALUE)
    assert_allclose(place, expected, rtol=0, atol=CLOSE)
    around = reading.parameter(apex.getIdentifier(), Node.VALUE_LABEL_D_DS1)
    assert_array_equal(around, np.zeros(3))


def test_more_groups_may_be_given(usual, written):
    elements = np.flatnonzero(usual.topology.index[:, 2] == 5)
    patch = usual.topology.surfaces["epi"][[7, 3, 3]]
    groups = {'ring 1: "basal"/all': elements, "scar": patch, "epicardium": patch[:1]}
    reading = written(usual, groups=groups)
    ring = reading.group('ring 1: "basal"/all', 3)
    assert [element.getIdentifier() - 1 for element in ring] == elements.tolist()
    assert len(reading.group("scar", 2)) == 2
    assert len(reading.group("epicardium", 2)) == 1


@pytest.mark.parametrize(
    ("name", "members", "message"),
    [
        ("far", np.array([3]), "beyond the 3 elements"),
        ("below", np.array([-1]), "beyond the 3 elements"),
        ("seventh", np.array([[0, 6]]), "faces from 0 to 5"),
        ("floats", np.array([0.0]), "float64"),
        ("mask", np.array([True, False, True]), "bool"),
        ("triples", np.array([[0, 1, 2]]), r"\(1, 3\)"),
        ("two\nlines", np.array([0]), "cannot hold this name"),
        (" padded", np.array([0]), "cannot hold this name"),
        ("", np.array([0]), "cannot hold this name"),
        ("coordinates", np.array([0]), "cannot hold this name"),
    ],
)
def test_a_group_the_mesh_cannot_have_is_refused(small, tmp_path, name, members, message):
    with pytest.raises(MeshError, match=message):
        write_exf(small, tmp_path / "mesh.exf", groups={name: members})
    assert list(tmp_path.iterdir()) == []


def test_right_ventricle_takes_the_name_of_the_wall_away(usual, written):
    # All elements are the left ventricle's only if there is no right one.
    surfaces = {**usual.topology.surfaces, "rv_endo": usual.topology.surfaces["epi"][:4]}
    both = replace(usual, topology=replace(usual.topology, surfaces=surfaces))
    reading = written(both)
    assert len(reading.group("endocardium of right ventricle", 2)) == 4
    assert not reading.module.findFieldByName("left ventricle myocardium").isValid()
