"""EX version 1 (.exnode and .exelem): the mesh for cmGui and tools of its time, exactly.

Versions of a node are whole sets of its eight parameters, and elements name parameters by their
place among these. There are no scale factors: derivatives are with respect to the elements' own xi.
mm, world (LPS).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.exf import NODESET, field_head, structure_comments
from heartgen.formats.exmodel import ExBlock, ExModel, ex_model
from heartgen.formats.groups import Group
from heartgen.formats.written import Written, write_texts
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.skeleton import COLLAPSED

NODES, ELEMENTS = ".exnode", ".exelem"
"""Endings of the two files."""

NAME = "heart"
"""Group of everything, with which files of that time begin."""

IDENTIFIERS = {1: "0 0 {}", 2: "0 {} 0", 3: "{} 0 0"}
"""How lines, faces and elements are numbered."""


def write_ex1(
    mesh: HexMesh,
    path: str | Path,
    fields: Iterable[MeshField] = (),
    groups: Mapping[str, NDArray[np.intp]] | None = None,
) -> Written:
    """Write a mesh as a pair of EX version 1 files; nodes are to be read before elements.

    Parameters
    ----------
    mesh : HexMesh
        Its basis is that of the coordinates in the file.
    path : path
        Of either file; the other has the same name and its own ending.
    fields : iterable of MeshField
        Fields on the mesh.
    groups : mapping of str to (n,) or (n, 2) int, optional
        As for `heartgen.formats.exf.write_exf`.

    Returns
    -------
    Written

    Raises
    ------
    HeartgenError
        If a file cannot be written.
    MeshError
        If a field or a group does not fit the mesh, or its name cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.formats import write_ex1
    >>> with TemporaryDirectory() as folder:
    ...     [path.name for path in write_ex1(mesh, Path(folder) / "mesh.exelem").files]
    ['mesh.exnode', 'mesh.exelem']
    """
    model = ex_model(mesh, fields, groups)
    texts = ((NODES, _node_file(model)), (ELEMENTS, _element_file(model)))
    return write_texts(
        {Path(path).with_suffix(ending): "\n".join(lines) + "\n" for ending, lines in texts}
    )


def _node_file(model: ExModel) -> Iterator[str]:
    """Nodes and their parameters, and which groups they are in."""
    yield f" Group name: {NAME}"
    yield from _nodes(model.geometry)
    if model.fields is not None:
        yield from _nodes(model.fields)
    for name, group in model.groups.items():
        if len(group.nodes):
            yield from (f" Group name: {name}", f" {NODESET}")
            yield from (" Shape. Dimension=0", " #Fields=0")
            yield from (f" Node: {node + 1}" for node in group.nodes)


def _nodes(block: ExBlock) -> Iterator[str]:
    """All nodes of a block; a new head where the number of versions changes."""
    n_labels, before = len(block.labels), 0
    for node, (counts, values) in enumerate(zip(block.counts, block.split(), strict=True)):
        versions = int(counts.max())
        if versions != before:
            yield from _node_head(block, versions)
            before = versions
        yield f" Node: {block.first + node + 1}"
        starts = np.cumsum(counts) - counts
        # A parameter with fewer versions than others is repeated in the rest of them.
        which = starts + np.minimum(np.arange(versions)[:, None], counts - 1)
        for component in (column for field in values for column in field.T):
            for version in component[which].reshape(versions, n_labels):
                yield "  " + " ".join(f"{number:.17g}" for number in version)


def _node_head(block: ExBlock, versions: int) -> Iterator[str]:
    """Fields of the nodes that follow."""
    yield f" #Fields={len(block.fields)}"
    place, n_derivatives = 1, len(block.labels) - 1
    labels = f" ({','.join(block.labels[1:])})" if n_derivatives else ""
    for number, field in enumerate(block.fields, 1):
        yield f" {field_head(number, field.name, field.kind, len(field.components))}"
        for component in field.components:
            derivatives = f"#Derivatives={n_derivatives}{labels}, #Versions={versions}"
            yield f"   {component}.  Value index={place}, {derivatives}"
            place += len(block.labels) * versions


def _element_file(model: ExModel) -> Iterator[str]:
    """Lines, faces and elements, and which groups they are in."""
    yield f" Group name: {NAME}"
    yield from structure_comments(model.structure)
    parts = model.skeleton
    yield from _head(1)
    yield from (_element(1, line) for line in range(parts.n_lines))
    yield from _head(2)
    for face, lines in enumerate(parts.lines):
        yield from (_element(2, face), "   Faces:")
        yield from (f"   {_identifier(1, line)}" for line in lines)
    yield from _elements(model.geometry, parts.faces)
    if model.fields is not None:
        yield from _elements(model.fields)
    for name, group in model.groups.items():
        yield from _group(name, group)


def _elements(block: ExBlock, faces: NDArray[np.intp] | None = None) -> Iterator[str]:
    """All elements; a new head where they take other parameters."""
    own, kinds, kind = block.own(), *block.kinds()
    for element, mine in enumerate(own):
        if element == 0 or kind[element] != kind[element - 1]:
            yield from _element_head(block, len(mine), kinds[kind[element]])
        yield _element(3, element)
        if faces is not None:
            yield "   Faces:"
            yield from (f"   {_identifier(2, face)}" for face in faces[element])
        if block.constants:
            yield "   Values:"
            for of in block.constants:
                yield from (f"    {value:.17g}" for value in of.values[element])
        if mine:
            yield from ("   Nodes:", f"    {' '.join(str(node + 1) for node in mine)}")


def _element_head(block: ExBlock, n_nodes: int, takes: NDArray[np.intp]) -> Iterator[str]:
    """Fields of the elements that follow: which parameters they take, (m, 1 + p)."""
    n_labels = len(block.labels)
    yield from _head(3, n_nodes, len(block.fields) + len(block.constants))
    for number, field in enumerate(block.fields, 1):
        yield f" {field_head(number, field.name, field.kind, len(field.components))}"
        for component in field.components:
            yield f"   {component}.  {block.basis}, no modify, standard node based."
            yield f"     #Nodes={n_nodes}"
            for node, *versions in takes.tolist():
                indices = (n_labels * v + label + 1 for label, v in enumerate(versions))
                yield f"      {node + 1}.  #Values={n_labels}"
                yield f"       Value indices: {' '.join(map(str, indices))}"
                yield f"       Scale factor indices: {' '.join(['0'] * n_labels)}"
    for number, constant in enumerate(block.constants, len(block.fields) + 1):
        kind = "field, rectangular cartesian"
        yield f" {field_head(number, constant.name, kind, constant.components)}"
        for k in range(constant.components):
            yield f"   {k + 1}.  constant*constant*constant, no modify, element based."


def _head(dimension: int, n_nodes: int = 0, n_fields: int = 0) -> Iterator[str]:
    """What elements of a dimension are introduced with."""
    yield f" Shape.  Dimension={dimension}, {'*'.join(['line'] * dimension)}"
    yield from (" #Scale factor sets=0", f" #Nodes={n_nodes}", f" #Fields={n_fields}")


def _element(dimension: int, number: int) -> str:
    return f" Element: {_identifier(dimension, number)}"


def _identifier(dimension: int, number: int) -> str:
    """Number as EX files count, from 1; 0 for what has collapsed."""
    return IDENTIFIERS[dimension].format(0 if number == COLLAPSED else number + 1)


def _group(name: str, group: Group) -> Iterator[str]:
    """Members of a group, dimension by dimension."""
    members = {1: group.lines, 2: group.faces, 3: group.elements}
    if any(map(len, members.values())):
        yield f" Group name: {name}"
    for dimension, of in members.items():
        if len(of):
            yield from _head(dimension)
            yield from (_element(dimension, number) for number in of)
