"""What EX files of any version say of a mesh and its fields.

Nodes have parameters, and elements say which of them they take.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.fields.catalog import FIBER_ANGLES
from heartgen.formats.groups import Group, named_groups, segment_groups
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.lagrange_nodes import shared_points
from heartgen.mesh.skeleton import Skeleton, skeleton

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
"""Labels of the parameters of a node, in the order of `heartgen.mesh.versions`."""

HERMITE, LAGRANGE = (f"{name}*{name}*{name}" for name in ("c.Hermite", "c.Lagrange"))
"""Names of the bases."""

COORDINATES = "coordinates"
"""Name of the geometric field, by which other software finds it."""

ANATOMICAL = ("fibre angle", "imbrication angle", "sheet angle")
"""Components of the field from which other software makes fiber axes."""

RESERVED = (COORDINATES, "xi", "cmiss_number")
"""Names that a field may not have."""


@dataclass(frozen=True, eq=False)
class ExField:
    """A field whose parameters are at nodes.

    Attributes
    ----------
    name, kind : str
        The kind as the files have it: what the field is, and its coordinate system.
    components : tuple of str
        Their names.
    values : (m, k) float64
        Parameters of the k components, ordered by node, derivative and version.
    """

    name: str
    kind: str
    components: tuple[str, ...]
    values: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ExBlock:
    """Nodes, the fields they carry, and how elements make use of these.

    Attributes
    ----------
    fields : tuple of ExField
        All with the same basis and versions.
    basis : str
        Of the elements, as the files name it.
    labels : tuple of str
        Of the p parameters of a node.
    first : int
        Number of the first node, counted from 0.
    counts : (n, p) int
        Versions of each parameter of each node.
    nodes : (e, m) int
        Numbers of the element's nodes, in the order of the basis.
    version : (e, m, p) int
        Version of each parameter there, counted from 0.
    backward : bool
        Elements name their nodes in the opposite order. Zinc takes fields of one basis that take
        the same places of an element's list of nodes to have the same nodes.
    constants : tuple of MeshField
        Fields that are constant in each element.
    """

    fields: tuple[ExField, ...]
    basis: str
    labels: tuple[str, ...]
    first: int
    counts: NDArray[np.intp]
    nodes: NDArray[np.intp]
    version: NDArray[np.intp]
    backward: bool = False
    constants: tuple[MeshField, ...] = ()

    def own(self) -> list[list[int]]:
        """Nodes that each element names; fewer than the basis has if the element collapses."""
        step = -1 if self.backward else 1
        return [list(dict.fromkeys(nodes[::step])) for nodes in self.nodes.tolist()]

    def kinds(self) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """What elements take, once for all that take the same.

        Returns
        -------
        takes : (k, m, 1 + p) int
            For each node of the basis its place in the element's list, and the versions.
        kind : (e,) int
            Which of these an element takes.
        """
        listed = zip(self.own(), self.nodes.tolist(), strict=True)
        local = [[own.index(node) for node in nodes] for own, nodes in listed]
        places = np.array(local, dtype=np.intp).reshape(*self.nodes.shape, 1)
        takes = np.concatenate([places, self.version], axis=2)
        kinds, kind = np.unique(takes, axis=0, return_inverse=True)
        return kinds, kind.ravel()

    def split(self) -> list[list[NDArray[np.float64]]]:
        """Parameters (m, k) of each node and field."""
        ends = np.cumsum(self.counts.sum(1))[:-1]
        of_fields = [np.split(field.values + 0.0, ends) for field in self.fields]  # no -0
        return [list(of_node) for of_node in zip(*of_fields, strict=True)]


@dataclass(frozen=True, eq=False)
class ExModel:
    """All that is in an EX file.

    Attributes
    ----------
    geometry : ExBlock
        The coordinates, mm, world (LPS).
    fields : ExBlock or None
        The other fields; None if there are none.
    skeleton : Skeleton
        Faces and lines.
    structure : (e, 3) int
        Place of each element: (radial, circumferential, longitudinal).
    groups : dict of str to Group
        Parts of the mesh by name.
    """

    geometry: ExBlock
    fields: ExBlock | None
    skeleton: Skeleton
    structure: NDArray[np.intp]
    groups: dict[str, Group]


def ex_model(
    mesh: HexMesh,
    fields: Iterable[MeshField] = (),
    groups: Mapping[str, NDArray[np.intp]] | None = None,
) -> ExModel:
    """What an EX file is to say of a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    fields : iterable of MeshField
        Fields on the mesh.
    groups : mapping of str to (n,) or (n, 2) int, optional
        More groups, see `heartgen.formats.groups.named_groups`; a field of AHA segments makes a
        group of each.

    Returns
    -------
    ExModel

    Raises
    ------
    MeshError
        If a field or group does not fit the mesh, or its name cannot be written.
    """
    fields = fitting(fields, mesh.n_elements)
    geometry = _hermite(mesh) if mesh.topology.basis == "hermite" else _lagrange(mesh)
    parts = skeleton(mesh.topology)
    named = named_groups(
        mesh.topology, parts, geometry.nodes, {**segment_groups(fields), **(groups or {})}
    )
    for field in fields:
        if "," in field.name or field.name in (*RESERVED, *named):
            raise MeshError(
                f"field {field.name!r}: an EX file cannot hold a field of this name: give it one "
                "without commas that no group has"
            )
    return ExModel(
        geometry=geometry,
        fields=_fields(mesh, fields, len(geometry.counts)) if fields else None,
        skeleton=parts,
        structure=mesh.topology.index,
        groups=named,
    )


def _coordinates(values: NDArray[np.float64]) -> tuple[ExField, ...]:
    kind = "coordinate, rectangular cartesian"
    return (ExField(COORDINATES, kind, ("x", "y", "z"), values),)


def _hermite(mesh: HexMesh) -> ExBlock:
    versions = mesh.topology.versions
    return ExBlock(
        fields=_coordinates(np.asarray(versions.weights @ mesh.dofs)),
        basis=HERMITE,
        labels=LABELS,
        first=0,
        counts=versions.counts,
        nodes=mesh.topology.nodes,
        version=versions.version,
    )


def _lagrange(mesh: HexMesh) -> ExBlock:
    number, first = mesh.topology.numbered(lattice())
    values = mesh.lagrange_points().reshape(-1, 3)[first]
    return _on_lattice(number, _coordinates(values))


def _fields(mesh: HexMesh, fields: tuple[MeshField, ...], first_node: int) -> ExBlock:
    number, first = shared_points(mesh.topology, fields)
    at_nodes = tuple(
        ExField(field.name, *_kind(field), field.values.reshape(-1, field.components)[first])
        for field in fields
        if not field.per_element
    )
    constants = tuple(field for field in fields if field.per_element)
    return _on_lattice(number, at_nodes, first_node, constants)


def _kind(field: MeshField) -> tuple[str, tuple[str, ...]]:
    """What a field is called in an EX file, and its components."""
    if field.name == FIBER_ANGLES and field.components == len(ANATOMICAL):
        return "anatomical, fibre", ANATOMICAL
    return "field, rectangular cartesian", tuple(str(k + 1) for k in range(field.components))


def _on_lattice(
    number: NDArray[np.intp],
    fields: tuple[ExField, ...],
    first: int = 0,
    constants: tuple[MeshField, ...] = (),
) -> ExBlock:
    """Fields of the cubic Lagrange basis; without any, the block has no nodes."""
    if not fields:
        number = number[:, :0]
    return ExBlock(
        fields=fields,
        basis=LAGRANGE,
        labels=LABELS[:1],
        first=first,
        counts=np.ones((number.max(initial=-1) + 1, 1), dtype=np.intp),
        nodes=first + number,
        version=np.zeros((*number.shape, 1), dtype=np.intp),
        backward=first > 0,
        constants=constants,
    )
