"""Named parts of a mesh, each with all that belongs to it: elements, faces, lines and nodes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.fields.catalog import AHA
from heartgen.fields.segments import SEGMENTS
from heartgen.mesh.corner_parameters import CORNERS
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.skeleton import COLLAPSED, Skeleton, face_corners
from heartgen.mesh.surface_faces import face_coefficients

SURFACES = {
    "lv_endo": "endocardium of left ventricle",
    "rv_endo": "endocardium of right ventricle",
    "epi": "epicardium",
    "base": "base of heart",
    "apical_rim": "apical hole",
}
"""What the field calls our surfaces: heart terms of scaffoldmaker, which has none for the cuts."""

WALL = "left ventricle myocardium"
PARTS = {
    "left ventricle": WALL,
    "septum": "interventricular septum",
    "right ventricle": "right ventricle myocardium",
}
PATCHES = {
    "rv_septum": "endocardium of right ventricle on septum",
    "rv_free_wall": "endocardium of right ventricle on free wall",
}
"""What the field calls our regions, and pieces of surfaces that it has no term for."""

APEX = "apex of heart"

TAKEN = ("coordinates",)
"""Names of fields, which a group in the same file may not have."""

FACES = 6
"""Faces of an element."""


@dataclass(frozen=True, eq=False)
class Group:
    """Numbers, counted from 0, of the members of a part; ascending.

    Attributes
    ----------
    elements, faces, lines, nodes : (n,) int
        Its members of each kind.
    """

    elements: NDArray[np.intp]
    faces: NDArray[np.intp]
    lines: NDArray[np.intp]
    nodes: NDArray[np.intp]


def named_groups(
    topology: Topology,
    parts: Skeleton,
    nodes: NDArray[np.intp],
    extra: Mapping[str, NDArray[np.intp]] | None = None,
) -> dict[str, Group]:
    """Groups of a mesh under the names the field gives them.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    parts : Skeleton
        Of that topology.
    nodes : (e, 8) or (e, 64) int
        Nodes of each element: at its corners, or on its lattice; xi1 fastest.
    extra : mapping of str to (n,) or (n, 2) int, optional
        More groups: elements, or faces as (element, face).

    Returns
    -------
    dict of str to Group
        Every named surface and region of the mesh, the node of the pole on the epicardium, all of
        a left ventricle as its myocardium, and the extra ones, which take precedence.

    Raises
    ------
    MeshError
        If an extra group names what the mesh does not have, or its name cannot be written.
    """
    extra = dict(extra or {})
    for name, of in extra.items():
        _check(name, of, topology)
    members = {SURFACES.get(name, name): faces for name, faces in topology.surfaces.items()}
    members |= {PARTS.get(name, name): elements for name, elements in topology.parts.items()}
    members |= {name: of for name, of in extra.items() if of.ndim == 1}
    members |= {PATCHES.get(name, name): faces for name, faces in topology.patches.items()}
    members |= {name: of for name, of in extra.items() if of.ndim > 1}
    if "rv_endo" not in topology.surfaces:
        members.setdefault(WALL, np.arange(topology.n_elements))
    groups = {name: _group(of, parts, nodes) for name, of in members.items()}
    if "epi" in topology.surfaces and len(topology.collapsed):
        on_epi, at_pole = (_nodes(f, nodes) for f in (topology.surfaces["epi"], topology.collapsed))
        none = np.zeros(0, dtype=np.intp)
        groups.setdefault(APEX, Group(none, none, none, np.intersect1d(on_epi, at_pole)))
    return groups


def segment_groups(fields: Iterable[MeshField]) -> dict[str, NDArray[np.intp]]:
    """Elements (n,) of each AHA segment, by a name with its number, if a field tells them.

    Parameters
    ----------
    fields : iterable of MeshField
        Fields on the mesh.
    """
    for field in fields:
        if field.name == AHA and field.per_element:
            segment = field.values[:, 0]
            return {
                f"AHA segment {number} {name}": np.flatnonzero(segment == number)
                for number, name in SEGMENTS.items()
                if np.any(segment == number)
            }
    return {}


def _check(name: str, members: NDArray[np.intp], topology: Topology) -> None:
    """Refuse a group that the mesh cannot have, or a name that a file cannot hold."""
    if not name or name != name.strip() or not name.isprintable() or name in TAKEN:
        raise MeshError(
            f"group {name!r}: a file cannot hold this name: use printable characters without "
            f"spaces at either end, and not {' or '.join(TAKEN)}"
        )
    of = np.asarray(members)
    shaped = of.ndim == 1 or (of.ndim == 2 and of.shape[1] == 2)
    if not shaped or of.dtype.kind not in "iu":
        raise MeshError(
            f"group {name!r}: {of.dtype} of shape {of.shape} names no part of a mesh: "
            "give element numbers (n,), or faces (n, 2) as (element, face)"
        )
    limit = topology.n_elements if of.ndim == 1 else np.array([topology.n_elements, FACES])
    if np.any(of < 0) or np.any(of >= limit):
        raise MeshError(
            f"group {name!r} goes beyond the {topology.n_elements} elements of the mesh: "
            f"count elements from 0 to {topology.n_elements - 1}, faces from 0 to {FACES - 1}"
        )


def _group(members: NDArray[np.intp], parts: Skeleton, nodes: NDArray[np.intp]) -> Group:
    """Elements (n,) or faces (n, 2), and all that bounds them."""
    if members.ndim == 1:
        elements = np.unique(members)
        faces = parts.faces[elements]
        own = nodes[elements]
    else:
        elements = np.zeros(0, dtype=np.intp)
        faces = parts.faces[members[:, 0], members[:, 1]]
        own = _nodes(members, nodes)
    faces = _existing(faces)
    return Group(elements, faces, _existing(parts.lines[faces]), np.unique(own))


def _existing(numbers: NDArray[np.intp]) -> NDArray[np.intp]:
    """Distinct numbers, without those that have collapsed."""
    return np.unique(numbers[numbers != COLLAPSED])


def _nodes(faces: NDArray[np.intp], nodes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Nodes of faces (n, 2)."""
    on_face = face_corners() if nodes.shape[1] == CORNERS else face_coefficients()
    return np.unique(nodes[faces[:, :1], on_face[faces[:, 1]]])
