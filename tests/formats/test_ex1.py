"""EX version 1 files, read by zinc beside the same mesh in version 3."""

from __future__ import annotations

import pytest

from heartgen.formats import write_ex1, write_exf

Context = pytest.importorskip("cmlibs.zinc.context").Context


def read(*paths):
    context = Context("test")
    region = context.getDefaultRegion()
    for path in paths:
        assert region.readFile(str(path)) == 1
    assert context.getLogger().getNumberOfMessages() == 0
    return context, region.getFieldmodule()


def group_sizes(module):
    """Members of each group by dimension."""
    sizes, iterator = {}, module.createFielditerator()
    while (field := iterator.next()).isValid():
        group = field.castGroup()
        if not group.isValid():
            continue
        parts = [group.getNodesetGroup(module.findNodesetByName("nodes"))]
        parts += [group.getMeshGroup(module.findMeshByDimension(d)) for d in (1, 2, 3)]
        sizes[field.getName()] = [part.getSize() if part.isValid() else 0 for part in parts]
    return sizes


@pytest.mark.parametrize("ending", [".exnode", ".exelem"])
def test_both_files_are_written_whichever_is_named(small, tmp_path, ending):
    written = write_ex1(small, (tmp_path / "mesh").with_suffix(ending))
    assert [file.name for file in written.files] == ["mesh.exnode", "mesh.exelem"]


@pytest.mark.parametrize("basis", ["hermite", "lagrange"])
def test_nodes_elements_and_groups_are_those_of_version_3(usual, tmp_path, basis):
    mesh = usual.to_lagrange() if basis == "lagrange" else usual
    groups = {"scar": mesh.topology.surfaces["epi"][[7, 3]]}
    old = read(*write_ex1(mesh, tmp_path / "mesh.exelem", groups=groups).files)
    new = read(*write_exf(mesh, tmp_path / "mesh.exf", groups=groups).files)
    everything = group_sizes(old[1])
    found = {name: sizes for name, sizes in everything.items() if name != "heart"}
    assert found == group_sizes(new[1])
    assert everything["heart"][3] == mesh.n_elements


def test_a_file_of_that_age_has_no_versions_of_single_derivatives(usual, tmp_path):
    nodes, elements = (file.read_text() for file in write_ex1(usual, tmp_path / "m.exnode").files)
    assert "#Versions=12" in nodes
    assert "Value labels" not in elements
    assert "Value indices: 1 2 3 4 5 6 7 8\n" in elements
