"""EX version 3 (.exf): the mesh as OpenCMISS, zinc and scaffoldmaker tools read it, exactly.

Every element says which versions of which nodal parameters it takes, with unit scaling: there are
no scale factors, sums or implied zeros, so that the widest set of tools can read or convert the
file. The frame is that of heartgen: mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.files import Written, write_text
from heartgen.formats.groups import Group, named_groups
from heartgen.formats.nodal import NodalParameters, nodal_parameters
from heartgen.formats.skeleton import COLLAPSED, Skeleton, skeleton
from heartgen.mesh.hexmesh import HexMesh

LABELS = (
    "value",
    "d/ds1",
    "d/ds2",
    "d2/ds1ds2",
    "d/ds3",
    "d2/ds1ds3",
    "d2/ds2ds3",
    "d3/ds1ds2ds3",
)
"""Labels of the parameters of a node, in the order of `heartgen.formats.nodal`."""

FIELD = "1) coordinates, coordinate, rectangular cartesian, real, #Components=3"
BASIS = "c.Hermite*c.Hermite*c.Hermite, no modify, standard node based."

COMPONENTS = "xyz"

NODESET = "!#nodeset nodes"
MESHES = (
    "!#mesh mesh1d, dimension=1, nodeset=nodes",
    "!#mesh mesh2d, dimension=2, face mesh=mesh1d, nodeset=nodes",
    "!#mesh mesh3d, dimension=3, face mesh=mesh2d, nodeset=nodes",
)


def write_exf(
    mesh: HexMesh, path: str | Path, groups: Mapping[str, NDArray[np.intp]] | None = None
) -> Written:
    """Write a mesh as an EX version 3 file.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Its folder is created if absent.
    groups : mapping of str to (n,) or (n, 2) int, optional
        More named groups, of elements or of faces (element, face). The surfaces, the apex and the
        myocardium of a left ventricle are always there, under the names scaffoldmaker gives them.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If the file cannot be written.
    MeshError
        If a group names what the mesh does not have, or its name cannot be written.
    """
    parameters, parts = nodal_parameters(mesh), skeleton(mesh.topology)
    named = named_groups(mesh.topology, parts, groups)
    lines = [
        "EX Version: 3",
        "Region: /",
        "! Coordinates in mm, world (LPS); derivatives with respect to the elements' own xi.",
        *_nodes(parameters),
        *_lines_and_faces(parts),
        *_elements(mesh.topology.nodes, parameters.version, parts.faces),
        *(line for name, group in named.items() for line in _group(name, group)),
    ]
    return write_text("\n".join(lines) + "\n", path)


def _nodes(parameters: NodalParameters) -> Iterator[str]:
    """All nodes; those with equally many versions share a template."""
    yield NODESET
    kinds, kind = np.unique(parameters.counts, axis=0, return_inverse=True)
    for k, counts in enumerate(kinds):
        yield from _node_template(k, counts)
    ends = np.cumsum(parameters.counts.sum(1))
    for node, values in enumerate(np.split(parameters.values, ends[:-1])):
        if node == 0 or kind[node] != kind[node - 1]:
            yield f"Node template: node{kind[node] + 1}"
        yield f"Node: {node + 1}"
        for component in values.T:
            yield " " + " ".join(f"{number:.17g}" for number in component + 0.0)  # no -0


def _node_template(kind: int, counts: NDArray[np.intp]) -> Iterator[str]:
    """How many versions of each parameter (8,) a node has."""
    labels = (f"{label}({n})" if n > 1 else label for label, n in zip(LABELS, counts, strict=True))
    values = f"#Values={counts.sum()} ({','.join(labels)})"
    yield from (f"Define node template: node{kind + 1}", "Shape. Dimension=0", "#Fields=1", FIELD)
    yield from (f" {component}. {values}" for component in COMPONENTS)


def _lines_and_faces(parts: Skeleton) -> Iterator[str]:
    """All lines and faces. They have no fields of their own: they take the elements'."""
    yield MESHES[0]
    yield from _template_head("line", dimension=1)
    yield "Element template: line"
    yield from (f"Element: {line + 1}" for line in range(parts.n_lines))
    yield MESHES[1]
    yield from _template_head("face", dimension=2)
    yield "Element template: face"
    for face, lines in enumerate(parts.lines):
        yield from (f"Element: {face + 1}", " Faces:", _numbers(lines))


def _elements(
    nodes: NDArray[np.intp], versions: NDArray[np.intp], faces: NDArray[np.intp]
) -> Iterator[str]:
    """All elements; those that take the same versions share a template."""
    yield MESHES[2]
    own = [list(dict.fromkeys(corners)) for corners in nodes.tolist()]  # fewer than 8 if collapsed
    local = [[mine.index(c) for c in corners] for mine, corners in zip(own, nodes, strict=True)]
    takes = np.concatenate([np.array(local)[..., None], versions], axis=2)
    kinds, kind = np.unique(takes, axis=0, return_inverse=True)
    for k, corners in enumerate(kinds):
        yield from _element_template(k, corners[:, 0], corners[:, 1:])
    for element, mine in enumerate(own):
        if element == 0 or kind[element] != kind[element - 1]:
            yield f"Element template: element{kind[element] + 1}"
        yield from (f"Element: {element + 1}", " Faces:", _numbers(faces[element]))
        yield from (" Nodes:", _numbers(np.array(mine)))


def _element_template(
    kind: int, local: NDArray[np.intp], version: NDArray[np.intp]
) -> Iterator[str]:
    """Which of an element's nodes (8,) and which versions (8, 8) its corners take."""
    n_nodes = int(local.max()) + 1
    yield from _template_head(f"element{kind + 1}", dimension=3, n_nodes=n_nodes, n_fields=1)
    yield FIELD
    for component in COMPONENTS:
        yield from (f" {component}. {BASIS}", f"  #Nodes={n_nodes}")
        for node, versions in zip(local, version, strict=True):
            labels = (f"{n}({v + 1})" if v else n for n, v in zip(LABELS, versions, strict=True))
            yield from (
                f"  {node + 1}. #Values={len(LABELS)}",
                f"   Value labels: {' '.join(labels)}",
            )


def _template_head(name: str, dimension: int, n_nodes: int = 0, n_fields: int = 0) -> Iterator[str]:
    """What a template starts with, for an element of any dimension."""
    yield f"Define element template: {name}"
    yield f"Shape. Dimension={dimension}, {'*'.join(['line'] * dimension)}"
    yield from ("#Scale factor sets=0", f"#Nodes={n_nodes}", f"#Fields={n_fields}")


def _group(name: str, group: Group) -> Iterator[str]:
    """Members of a group, dimension by dimension."""
    yield f"Group name: {name}"
    if len(group.nodes):
        yield from (NODESET, "Node group:", _ranges(group.nodes))
    for mesh, members in zip(MESHES, (group.lines, group.faces, group.elements), strict=True):
        if len(members):
            yield from (mesh, "Element group:", _ranges(members))


def _numbers(numbers: NDArray[np.intp]) -> str:
    """Numbers as EX files count them, from 1; -1 for what has collapsed."""
    return " " + " ".join(map(str, np.where(numbers == COLLAPSED, -1, numbers + 1)))


def _ranges(numbers: NDArray[np.intp]) -> str:
    """Ascending numbers as EX files count them, runs written first..last."""
    runs = np.split(numbers + 1, np.flatnonzero(np.diff(numbers) > 1) + 1)
    return ",".join(f"{run[0]}..{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)
