"""The frame of the wall: at every point circumferential, longitudinal and transmural directions."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER, lattice, tabulate
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.sharing import coincident, probe
from heartgen.mesh.surfaces import face_coefficients

Array = NDArray[np.float64]


def wall_frames(mesh: HexMesh) -> Array:
    """Directions of the wall on the lattice of each element.

    The circumferential direction is that of the local coordinate around, the transmural one is
    normal to the sheet of equal transmural coordinate, and the longitudinal one is at right angles
    to both, towards the base. Where elements meet in a crease, as on the insertion line of the
    right ventricle, the frame is the mean of theirs. At the pole, where circumferential directions
    meet, each element keeps its own.

    Parameters
    ----------
    mesh : HexMesh

    Returns
    -------
    (e, 64, 3, 3) float64
        Columns: circumferential, longitudinal, transmural; orthonormal, right-handed.
    """
    return nearest_rotation(averaged(_frames(*_tangents(mesh)), mesh))


def frames_at(mesh: HexMesh, xi: Array) -> Array:
    """Directions of the wall at local coordinates (q, 3) off the pole, (e, q, 3, 3)."""
    gradient = mesh.gradient(xi)
    return _frames(gradient[..., 0], gradient[..., 1])


def averaged(values: Array, mesh: HexMesh) -> Array:
    """Mean of values (e, 64, ...) wherever lattice points of elements are one, but for the pole."""
    shared = ~at_pole(mesh)
    number, first = coincident(probe(mesh.topology).evaluate(lattice())[shared])
    total = np.zeros((len(first), *values.shape[2:]))
    np.add.at(total, number, values[shared])
    count = np.bincount(number).reshape(-1, *[1] * (values.ndim - 2))
    out = values.copy()
    out[shared] = (total / count)[number]
    return out


def at_pole(mesh: HexMesh) -> NDArray[np.bool_]:
    """Lattice points (e, 64) on collapsed faces."""
    out = np.zeros((mesh.n_elements, ORDER**3), dtype=bool)
    faces = mesh.topology.collapsed
    out[faces[:, :1], face_coefficients()[faces[:, 1]]] = True
    return out


def nearest_rotation(matrices: Array) -> Array:
    """Orthonormal, right-handed matrices (..., 3, 3) that are closest to the given ones."""
    u, _, v = np.linalg.svd(matrices)
    u[..., -1] *= np.linalg.det(u @ v)[..., None]
    return np.asarray(u @ v)


def _tangents(mesh: HexMesh) -> tuple[Array, Array]:
    """Tangents (e, 64, 3) along xi1 and xi2; at the pole, that of xi1 as it is close to it."""
    xi = lattice()
    around, along = (np.matmul(tabulate(xi, d), mesh.control) for d in ((1, 0, 0), (0, 1, 0)))
    opening = np.matmul(tabulate(xi, (1, 1, 0)), mesh.control)
    pole = at_pole(mesh)
    around[pole] = opening[pole]  # of a length that grows with the distance from the pole
    return around, along


def _frames(around: Array, along: Array) -> Array:
    """Frames (..., 3, 3) from the tangents (..., 3) of a sheet of equal transmural coordinate."""
    circumferential = _unit(around)
    transmural = _unit(np.cross(around, along))
    longitudinal = np.cross(transmural, circumferential)
    return np.stack([circumferential, longitudinal, transmural], -1)


def _unit(vectors: Array) -> Array:
    """Vectors (..., 3) of length 1."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))
