"""What a file says of a mesh, put together as a `HexMesh`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.formats.groups import PARTS, PATCHES, SURFACES
from heartgen.mesh.bernstein import ORDER
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import COEFFICIENTS, HexMesh, Topology
from heartgen.mesh.skeleton import COLLAPSED, skeleton
from heartgen.mesh.surface_faces import face_coefficients
from heartgen.renamed import SURFACES as FORMER

FLAT = 1e-9
"""Side, relative to the extent of the mesh, below which a face has collapsed to a line."""

OTHER = "other"
"""Surface of the external faces that no named surface has."""


@dataclass(frozen=True)
class MeshFile:
    """What was read.

    Attributes
    ----------
    mesh : HexMesh
        mm, world (LPS), as the file is taken to be.
    fields : tuple of MeshField
        On the mesh.
    notes : tuple of str
        What the file holds that was not read.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.formats import read_mesh_file
    >>> with TemporaryDirectory() as folder:
    ...     path = heartgen.write_mesh(mesh, Path(folder) / "mesh.exf").files[0]
    ...     read = read_mesh_file(path)
    >>> read.mesh.n_elements, read.fields, read.notes
    (72, (), ())
    """

    mesh: HexMesh
    fields: tuple[MeshField, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class NamedSets:
    """The parts of a mesh that have names, by ours.

    Attributes
    ----------
    surfaces, parts, patches : mapping of str to array of int
        As the attributes of `heartgen.mesh.Topology`.
    """

    surfaces: Mapping[str, NDArray[np.intp]]
    parts: Mapping[str, NDArray[np.intp]]
    patches: Mapping[str, NDArray[np.intp]]


def assembled(
    dofs: NDArray[np.float64],
    extraction: sp.csr_array,
    nodes: NDArray[np.intp],
    constant: NDArray[np.float64],
    basis: Literal["hermite", "lagrange"],
    index: NDArray[np.intp] | None,
    named: NamedSets,
) -> HexMesh:
    """Put a mesh together; parameters as the attributes of `HexMesh` and `Topology`.

    Parameters
    ----------
    dofs : (n, 3) float64
        mm, world (LPS).
    extraction : (64 e, n) sparse
        Bernstein coefficients of all elements from the degrees of freedom.
    nodes : (e, 8) int
        Corner nodes of each element, xi1 fastest.
    constant : (n,) float64
        Degrees of freedom of the function 1.
    basis : {"hermite", "lagrange"}
        What the degrees of freedom are.
    index : (e, 3) int or None
        None if the file does not tell: the elements then stand in one row.
    named : NamedSets
        External faces that no surface has are made one named `OTHER`.
    """
    if index is None:
        index = np.zeros((len(nodes), 3), dtype=np.intp)
        index[:, 1] = np.arange(len(nodes))
    control = np.asarray(extraction @ dofs).reshape(-1, COEFFICIENTS, 3)
    extent = float(np.ptp(control.reshape(-1, 3), axis=0).max())
    radial, around, along = (int(n) for n in index.max(axis=0) + 1)
    topology = Topology(
        extraction=extraction,
        shape=(radial, around, along),
        index=index,
        surfaces=dict(named.surfaces),
        collapsed=_collapsed(control, FLAT * extent),
        nodes=nodes,
        constant=constant,
        straightening=None,
        parts=dict(named.parts),
        patches=dict(named.patches),
        basis=basis,
        generic_dofs=dofs / extent if basis == "hermite" else None,
    )
    other = _unnamed(topology)
    if len(other):
        topology.surfaces[OTHER] = other  # type: ignore[index]  # our own dict, see above
    return HexMesh(dofs, topology)


def our_name(name: str) -> str:
    """Our name of a part that a file calls by the field's.

    Parameters
    ----------
    name : str
        As it stands in the file.
    """
    known = {theirs: ours for of in (SURFACES, PARTS, PATCHES) for ours, theirs in of.items()}
    return known.get(name, FORMER.get(name, name))


def named_faces(
    groups: Mapping[str, NDArray[np.intp]], outside: set[tuple[int, int]]
) -> tuple[dict[str, NDArray[np.intp]], dict[str, NDArray[np.intp]]]:
    """Tell surfaces from pieces of surfaces.

    Parameters
    ----------
    groups : mapping of str to (n, 2) int
        Named faces.
    outside : set of (int, int)
        All external faces.

    Returns
    -------
    surfaces, patches : dict of str to (n, 2) int
        Of groups with names that are not ours, those are surfaces that are external and share no
        face with a surface before them.
    """
    surfaces = {name: faces for name, faces in groups.items() if name in SURFACES}
    patches = {}
    taken = {(int(e), int(f)) for faces in surfaces.values() for e, f in faces}
    for name, faces in groups.items():
        if name in SURFACES:
            continue
        own = {(int(e), int(f)) for e, f in faces}
        if name not in PATCHES and own <= outside - taken:
            surfaces[name] = faces
            taken |= own
        else:
            patches[name] = faces
    return surfaces, patches


def _collapsed(control: NDArray[np.float64], flat: float) -> NDArray[np.intp]:
    """Faces (m, 2) whose coefficients are within this distance all along one direction."""
    faces = control[:, face_coefficients()].reshape(len(control), 6, ORDER, ORDER, 3)
    sides = [np.ptp(faces, axis=axis).max(axis=(-2, -1)) for axis in (2, 3)]
    return np.argwhere(np.minimum(*sides) < flat)


def _unnamed(topology: Topology) -> NDArray[np.intp]:
    """External faces (n, 2) that no surface has."""
    faces = skeleton(topology).faces
    lone = np.bincount(faces[faces != COLLAPSED], minlength=1) == 1
    outside = (faces != COLLAPSED) & lone[np.maximum(faces, 0)]
    for of in (*topology.surfaces.values(), topology.collapsed):
        outside[of[:, 0], of[:, 1]] = False
    return np.argwhere(outside)
