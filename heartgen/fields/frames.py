"""The frame of the wall: at every point circumferential, longitudinal and transmural directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.patch_coordinates import ASIDE, patch_of
from heartgen.mesh.bernstein import ORDER, lattice, tabulate
from heartgen.mesh.connectivity import merge_coincident
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.surface_faces import face_coefficients

Array = NDArray[np.float64]


def wall_frames(mesh: HexMesh) -> Array:
    """Directions of the wall at the Lagrange nodes of each element.

    The circumferential direction is that of the local coordinate around, the transmural one is
    normal to the sheet of equal transmural coordinate, and the longitudinal one is at right angles
    to both, towards the base. Where elements meet in a crease, as on the insertion line of the
    right ventricle, the frame is the mean of theirs. At the pole, where circumferential directions
    meet, each element keeps its own. In a square patch at the apex, it runs along smooth rings.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    (e, 64, 3, 3) float64
        Columns: circumferential, longitudinal, transmural; orthonormal, right-handed.
    """
    return nearest_rotation(averaged(_frames(*tangents(mesh, lattice())), mesh))


def frames_at(mesh: HexMesh, xi: Array) -> Array:
    """Directions of the wall at local coordinates (q, 3) off the pole, (e, q, 3, 3).

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    xi : (q, 3) float64
        Local coordinates in the unit cube.
    """
    return _frames(*tangents(mesh, xi))


def local_frames(mesh: HexMesh, xi: Array) -> Array:
    """Directions of the local coordinates at (q, 3), (e, q, 3, 3): of xi1, aside of it, normal.

    Those of `frames_at`, but for a square patch, in which xi1 does not run around.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    xi : (q, 3) float64
        Local coordinates in the unit cube.
    """
    return _frames(*_local_tangents(mesh, xi))


def averaged(values: Array, mesh: HexMesh) -> Array:
    """Mean of values (e, 64, ...) wherever lattice points of elements are one, but for the pole.

    Parameters
    ----------
    values : (e, 64, ...) float64
        At the lattice points of each element.
    mesh : HexMesh
        mm, world (LPS).
    """
    shared = ~at_pole(mesh)
    number, first = merge_coincident(np.matmul(tabulate(lattice()), mesh.topology.generic)[shared])
    total = np.zeros((len(first), *values.shape[2:]))
    np.add.at(total, number, values[shared])
    count = np.bincount(number).reshape(-1, *[1] * (values.ndim - 2))
    out = values.copy()
    out[shared] = (total / count)[number]
    return out


def at_pole(mesh: HexMesh) -> NDArray[np.bool_]:
    """Lattice points (e, 64) around which the directions turn: collapsed, or amid a patch.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    out = np.zeros((mesh.n_elements, ORDER**3), dtype=bool)
    faces = mesh.topology.collapsed
    out[faces[:, :1], face_coefficients()[faces[:, 1]]] = True
    patch = patch_of(mesh.topology)
    if patch is not None:
        out[patch.elements] |= patch.radius(lattice()) < 2 * ASIDE
    return out


def nearest_rotation(matrices: Array) -> Array:
    """Orthonormal, right-handed matrices (..., 3, 3) that are closest to the given ones.

    Parameters
    ----------
    matrices : (..., 3, 3) float64
        Of full rank.
    """
    u, _, v = np.linalg.svd(matrices)
    u[..., -1] *= np.linalg.det(u @ v)[..., None]
    return np.asarray(u @ v)


def tangents(mesh: HexMesh, xi: Array) -> tuple[Array, Array]:
    """Tangents (e, q, 3) around and along at local coordinates (q, 3), mm.

    They are those of xi1 and xi2, but for a square patch at the apex. On a collapsed face, that
    around is as it is close to it.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    xi : (q, 3) float64
        Local coordinates in the unit cube.
    """
    one, two = _local_tangents(mesh, xi)
    shares = around_shares(mesh.topology, xi)
    a, b = shares[..., :1], shares[..., 1:]
    return a * one + b * two, a * two - b * one


def _local_tangents(mesh: HexMesh, xi: Array) -> tuple[Array, Array]:
    """Tangents (e, q, 3) of xi1 and xi2; on a collapsed face, that of xi1 as it is close to it."""
    one, two = (np.matmul(tabulate(xi, d), mesh.control) for d in ((1, 0, 0), (0, 1, 0)))
    opening = np.matmul(tabulate(xi, (1, 1, 0)), mesh.control)
    for element, face in mesh.topology.collapsed:
        on = xi[:, face // 2] == face % 2
        one[element, on] = opening[element, on]  # of a length that grows with the distance
    return one, two


def around_shares(topology: Topology, xi: Array) -> Array:
    """Direction around, (e, q, 2), as shares of the tangents of xi1 and xi2.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    xi : (q, 3) float64
        Local coordinates in the unit cube.
    """
    out = np.zeros((topology.n_elements, len(xi), 2))
    out[..., 0] = 1
    patch = patch_of(topology)
    if patch is not None:
        out[patch.elements] = patch.directions(xi)
    return out


def _frames(around: Array, along: Array) -> Array:
    """Frames (..., 3, 3) from the tangents (..., 3) of a sheet of equal transmural coordinate."""
    circumferential = _unit(around)
    transmural = _unit(np.cross(around, along))
    longitudinal = np.cross(transmural, circumferential)
    return np.stack([circumferential, longitudinal, transmural], -1)


def _unit(vectors: Array) -> Array:
    """Vectors (..., 3) of length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
