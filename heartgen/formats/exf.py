"""EX version 3 (.exf): the mesh as OpenCMISS, zinc and scaffoldmaker tools read it, exactly.

Every element says which versions of which nodal parameters it takes, with unit scaling: there are
no scale factors, sums or implied zeros, so that the widest set of tools can read or convert the
file. Fields are cubic on nodes of their own, which are there twice where a field jumps. The frame
is that of heartgen: mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.exmodel import ExBlock, ExModel, ex_model
from heartgen.formats.groups import Group
from heartgen.formats.written import Written, write_text
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.skeleton import COLLAPSED, Skeleton

NODESET = "!#nodeset nodes"
MESHES = (
    "!#mesh mesh1d, dimension=1, nodeset=nodes",
    "!#mesh mesh2d, dimension=2, face mesh=mesh1d, nodeset=nodes",
    "!#mesh mesh3d, dimension=3, face mesh=mesh2d, nodeset=nodes",
)

STRUCTURE = "! Places of the elements (radial, circumferential, longitudinal):"
"""Comment that is followed by lines of these, `PER_LINE` to a line, separated by semicolons."""

PER_LINE = 12


def write_exf(
    mesh: HexMesh,
    path: str | Path,
    fields: Iterable[MeshField] = (),
    groups: Mapping[str, NDArray[np.intp]] | None = None,
) -> Written:
    """Write a mesh as an EX version 3 file.

    Parameters
    ----------
    mesh : HexMesh
        Its basis is that of the coordinates in the file.
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Fields on the mesh.
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
        If a field or a group names what the mesh does not have, or its name cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.formats import write_exf
    >>> with TemporaryDirectory() as folder:
    ...     path = write_exf(mesh, Path(folder) / "mesh.exf").files[0]
    ...     path.read_text().splitlines()[0]
    'EX Version: 3'
    """
    return write_text(exf_text(ex_model(mesh, fields, groups)), path)


def exf_text(model: ExModel) -> str:
    """Content of the file.

    Parameters
    ----------
    model : ExModel
        What the file is to say.
    """
    lines = [
        "EX Version: 3",
        "Region: /",
        "! Coordinates in mm, world (LPS); derivatives with respect to the elements' own xi.",
        *structure_comments(model.structure),
        *_nodes(model.geometry, "node"),
        *_lines_and_faces(model.skeleton),
        *_elements(model.geometry, "element", model.skeleton.faces),
    ]
    if model.fields is not None:
        lines += [*_nodes(model.fields, "place"), *_elements(model.fields, "field")]
    lines += [line for name, group in model.groups.items() for line in _group(name, group)]
    return "\n".join(lines) + "\n"


def structure_comments(index: NDArray[np.intp]) -> Iterator[str]:
    """Places of elements as comments.

    Parameters
    ----------
    index : (e, 3) int
        Place of each element: (radial, circumferential, longitudinal).
    """
    yield STRUCTURE
    for start in range(0, len(index), PER_LINE):
        places = (" ".join(map(str, place)) for place in index[start : start + PER_LINE])
        yield f"! {'; '.join(places)}"


def _nodes(block: ExBlock, template: str) -> Iterator[str]:
    """All nodes; those with equally many versions share a template."""
    if not block.fields:
        return
    yield NODESET
    kinds, kind = np.unique(block.counts, axis=0, return_inverse=True)
    for k, counts in enumerate(kinds):
        yield from _node_template(block, f"{template}{k + 1}", counts)
    for node, values in enumerate(block.split()):
        if node == 0 or kind[node] != kind[node - 1]:
            yield f"Node template: {template}{kind[node] + 1}"
        yield f"Node: {block.first + node + 1}"
        for component in (column for field in values for column in field.T):
            yield " " + " ".join(f"{number:.17g}" for number in component)


def _node_template(block: ExBlock, name: str, counts: NDArray[np.intp]) -> Iterator[str]:
    """How many versions of each parameter (p,) a node has."""
    labels = (
        f"{label}({n})" if n > 1 else label for label, n in zip(block.labels, counts, strict=True)
    )
    values = f"#Values={counts.sum()} ({','.join(labels)})"
    yield from (f"Define node template: {name}", "Shape. Dimension=0")
    yield f"#Fields={len(block.fields)}"
    for number, field in enumerate(block.fields, 1):
        yield field_head(number, field.name, field.kind, len(field.components))
        yield from (f" {component}. {values}" for component in field.components)


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
    block: ExBlock, template: str, faces: NDArray[np.intp] | None = None
) -> Iterator[str]:
    """All elements; those that take the same versions share a template."""
    yield MESHES[2]
    own, kinds, kind = block.own(), *block.kinds()
    for k, takes in enumerate(kinds):
        n_nodes = len(own[int(np.argmax(kind == k))])
        yield from _element_template(block, f"{template}{k + 1}", n_nodes, takes)
    constants = [field.values for field in block.constants]
    for element, mine in enumerate(own):
        if element == 0 or kind[element] != kind[element - 1]:
            yield f"Element template: {template}{kind[element] + 1}"
        yield f"Element: {element + 1}"
        if faces is not None:
            yield from (" Faces:", _numbers(faces[element]))
        if constants:
            yield " Values:"
            yield from (f" {value:.17g}" for of in constants for value in of[element])
        if len(mine):
            yield from (" Nodes:", _numbers(np.array(mine)))


def field_head(number: int, name: str, kind: str, components: int) -> str:
    """The line that introduces a field.

    Parameters
    ----------
    number : int
        Of the field, from 1.
    name : str
        Of the field.
    kind : str
        What it is, and its coordinate system.
    components : int
        How many.
    """
    return f"{number}) {name}, {kind}, real, #Components={components}"


def _element_template(
    block: ExBlock, name: str, n_nodes: int, takes: NDArray[np.intp]
) -> Iterator[str]:
    """Which of an element's nodes and which versions its basis takes, (m, 1 + p)."""
    n_fields = len(block.fields) + len(block.constants)
    yield from _template_head(name, dimension=3, n_nodes=n_nodes, n_fields=n_fields)
    for number, field in enumerate(block.fields, 1):
        yield field_head(number, field.name, field.kind, len(field.components))
        for component in field.components:
            yield f" {component}. {block.basis}, no modify, standard node based."
            yield f"  #Nodes={n_nodes}"
            for node, *versions in takes.tolist():
                labels = (
                    f"{label}({v + 1})" if v else label
                    for label, v in zip(block.labels, versions, strict=True)
                )
                yield f"  {node + 1}. #Values={len(block.labels)}"
                yield f"   Value labels: {' '.join(labels)}"
    for number, constant in enumerate(block.constants, len(block.fields) + 1):
        kind = "field, rectangular cartesian"
        yield field_head(number, constant.name, kind, constant.components)
        for k in range(constant.components):
            yield f" {k + 1}. constant*constant*constant, no modify, element based."


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
