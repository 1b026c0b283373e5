"""Material coordinates: where in the heart a point is, the same for corresponding points of all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.axes import HeartAxes
from heartgen.fields.lines import length_share
from heartgen.mesh.bernstein import ORDER, lattice
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.surfaces import face_coefficients

Array = NDArray[np.float64]

SEPTAL = 2 * np.pi / 3
"""Angle given to the septum, whatever the right ventricle's width: that of its AHA segments."""


def longitudinal(mesh: HexMesh) -> Array:
    """Longitudinal coordinate: 0 at the apex to 1 at the base.

    Each row of elements, and each level within it, has one value: the share of the length from
    apex to base at which it lies on average.

    Parameters
    ----------
    mesh : HexMesh

    Returns
    -------
    (e, 64) float64
        On the lattice of each element.
    """
    share = length_share(mesh, 1).reshape(-1, ORDER, ORDER, ORDER)
    row = mesh.topology.index[:, 2]
    profile = np.array([share[row == r].mean((0, 1, 3)) for r in range(int(row.max()) + 1)])
    out = np.broadcast_to(profile[row][:, None, :, None], share.shape)
    return out.reshape(len(share), -1)


def circumferential(mesh: HexMesh, axes: HeartAxes) -> Array:
    """Circumferential coordinate: 0 in the middle of the septum, growing towards the anterior wall.

    It grows evenly with the columns of elements. With a right ventricle its insertion lies at pi/3
    (anterior) and -pi/3 (inferior); without, columns are turned to where the axes have the septum.

    Parameters
    ----------
    mesh : HexMesh
    axes : HeartAxes

    Returns
    -------
    (e, 64) float64, rad
        On the lattice of each element; between -pi and pi in the middle of an element, and
        continuous within it.
    """
    topology = mesh.topology
    column = topology.index[:, 1, None] + lattice()[:, 0]
    angle = _by_insertion(column, topology) if _has_right(topology) else _turned(column, mesh, axes)
    middle = angle[:, :: ORDER - 1].mean(1, keepdims=True)
    return np.asarray(angle - 2 * np.pi * np.round(middle / (2 * np.pi)))


def _has_right(topology: Topology) -> bool:
    return len(topology.parts.get("septum", ())) > 0


def _by_insertion(column: Array, topology: Topology) -> Array:
    """Angle from the column coordinate: the septum's columns have their own share of it."""
    septal = topology.index[topology.parts["septum"], 1]
    first, count = int(septal.min()), int(np.ptp(septal)) + 1
    around = topology.shape[1]
    from_first = column - first
    inside = SEPTAL * (from_first / count - 0.5)
    beside = SEPTAL / 2 + (2 * np.pi - SEPTAL) * (from_first - count) / (around - count)
    return np.where(from_first <= count, inside, beside)


def _turned(column: Array, mesh: HexMesh, axes: HeartAxes) -> Array:
    """Angle from the column coordinate: even, agreeing with the axes on average."""
    angle = 2 * np.pi / mesh.topology.shape[1] * column
    faces = mesh.topology.surfaces["lv_endo"]
    on = faces[:, :1], face_coefficients()[faces[:, 1]]
    true = axes.angle(mesh.lagrange_points()[on].reshape(-1, 3))
    return np.asarray(angle + np.angle(np.exp(1j * (true - angle[on].ravel())).sum()))
