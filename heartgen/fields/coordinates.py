"""Material coordinates: where in the heart a point is, the same for corresponding points of all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.axes import HeartAxes
from heartgen.fields.coordinate_lines import length_share, lengths, lines
from heartgen.fields.patch_coordinates import PatchCoordinates, patch_of
from heartgen.mesh.bernstein import ORDER, lattice
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.surface_faces import face_coefficients

Array = NDArray[np.float64]

SEPTAL = 2 * np.pi / 3
"""Angle given to the septum, whatever the right ventricle's width: that of its AHA segments."""

BORDER = 1e-9
"""Of the radius in the patch below 1, on the border."""


def longitudinal(mesh: HexMesh) -> Array:
    """Longitudinal coordinate: 0 at the apex to 1 at the base.

    Each row of elements, and each level within it, has one value: the share of the length from
    apex to base at which it lies on average.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    (e, 64) float64
        At the Lagrange nodes of each element.
    """
    topology = mesh.topology
    patch = patch_of(topology)
    ring = np.ones(mesh.n_elements, dtype=bool)
    if patch is not None:
        ring[patch.elements] = False
    share = length_share(mesh, 1, ring).reshape(-1, ORDER, ORDER, ORDER)
    row = topology.index[:, 2]
    profile = np.zeros((int(row.max()) + 1, ORDER))
    for r in np.unique(row[ring]):
        profile[r] = share[ring & (row == r)].mean((0, 1, 3))
    out = np.broadcast_to(profile[row][:, None, :, None], share.shape).reshape(len(share), -1)
    if patch is None:
        return out
    first = _patch_share(mesh, patch, ring)
    out = first + (1 - first) * out
    out[patch.elements] = first * patch.radius(lattice())
    return out


def circumferential(mesh: HexMesh, axes: HeartAxes) -> Array:
    """Circumferential coordinate: 0 in the middle of the septum, growing towards the anterior wall.

    It grows evenly with the columns of elements. With a right ventricle its insertion lies at pi/3
    (anterior) and -pi/3 (inferior); without, columns are turned to where the axes have the septum.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    axes : HeartAxes
        Say where the septum is.

    Returns
    -------
    (e, 64) float64, rad
        At the Lagrange nodes of each element; between -pi and pi in the middle of an element, and
        continuous within it.
    """
    topology = mesh.topology
    middle, column = (_columns(topology, xi) for xi in (np.full((1, 3), 0.5), lattice()))
    if _has_right(topology):
        angle, center = _by_insertion(column, topology), _by_insertion(middle, topology)
    else:
        offset = _turn(column, mesh, axes)
        angle, center = (2 * np.pi / topology.shape[1] * c + offset for c in (column, middle))
    center = _wrapped(center)
    return np.asarray(center + _wrapped(angle - center))


def _has_right(topology: Topology) -> bool:
    return len(topology.parts.get("septum", ())) > 0


def _columns(topology: Topology, xi: Array) -> Array:
    """Column coordinate (e, q) at local coordinates (q, 3)."""
    out = topology.index[:, 1, None] + xi[:, 0]
    patch = patch_of(topology)
    if patch is not None:
        out[patch.elements] = patch.column(xi)
    return out


def _patch_share(mesh: HexMesh, patch: PatchCoordinates, ring: NDArray[np.bool_]) -> float:
    """Share of the way from apex to base that lies in the patch, on average."""
    xi = lattice()
    points, layer = mesh.evaluate(xi)[patch.elements], mesh.topology.index[patch.elements, 0]
    border = patch.radius(xi) > 1 - BORDER
    within = []
    for r in np.unique(layer):
        for xi3 in np.unique(xi[:, 2]):
            circle = points[border & (layer == r)[:, None] & (xi[:, 2] == xi3)]
            within.append(np.linalg.norm(circle - circle.mean(0), axis=1).mean())
    ends = lengths(mesh, 1)[ring][:, xi[:, 1] == 1]
    beyond = ends.mean(1).sum() / len(lines(mesh.topology, 1, ring))
    return float(np.mean(within) / (np.mean(within) + beyond))


def _wrapped(angle: Array) -> Array:
    """Angles between -pi and pi."""
    return np.asarray(angle - 2 * np.pi * np.round(angle / (2 * np.pi)))


def _by_insertion(column: Array, topology: Topology) -> Array:
    """Angle from the column coordinate: the septum's columns have their own share of it."""
    septal = topology.index[topology.parts["septum"], 1]
    first, count = int(septal.min()), int(np.ptp(septal)) + 1
    around = topology.shape[1]
    from_first = np.mod(column - first, around)
    inside = SEPTAL * (from_first / count - 0.5)
    beside = SEPTAL / 2 + (2 * np.pi - SEPTAL) * (from_first - count) / (around - count)
    return np.where(from_first <= count, inside, beside)


def _turn(column: Array, mesh: HexMesh, axes: HeartAxes) -> float:
    """Angle by which even columns are to be turned to agree with the axes on average, rad."""
    faces = mesh.topology.surfaces["lv_endo"]
    on = faces[:, :1], face_coefficients()[faces[:, 1]]
    true = axes.angle(mesh.lagrange_points()[on].reshape(-1, 3))
    even = 2 * np.pi / mesh.topology.shape[1] * column[on].ravel()
    return float(np.angle(np.exp(1j * (true - even)).sum()))
