"""Meshes of solids of which everything is known, as closely as their elements allow."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import tabulate
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.quadrature import gauss_cube

GAUSS = (6, 6, 5)
"""Points per element at which a mesh is fitted: more than its 4 coefficients per direction."""

LAND = (7.0, 17.0, 3.0, 5.0)
"""Sizes of the ventricle of Land et al. (2015, doi:10.1098/rspa.2015.0641), mm, see `ellipsoid`."""


HALVINGS = 60
"""Of the interval in which a depth is searched: to rounding."""


def ellipsoid(
    radius: float, length: float, wall: float, top: float, elements: tuple[int, int, int]
) -> HexMesh:
    """Mesh of a shell between two truncated ellipsoids of revolution.

    Parameters
    ----------
    radius, length : float
        Semi-axes of the inner one, mm; those of the outer one are larger by the wall.
    wall : float
        mm.
    top : float
        Height of the base over the equator, mm.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).

    Returns
    -------
    HexMesh
        Its equator at z = 0, the apex below: the best fit in the sense of least squares.
    """
    topology = cup_topology(elements)
    xi, _ = gauss_cube(GAUSS)
    place = (topology.index[:, None, [1, 2, 0]] + xi) / np.array(elements)[[1, 2, 0]]
    angle, along, depth = 2 * np.pi * place[..., 0], place[..., 1], place[..., 2]
    across, axis = radius + wall * depth, length + wall * depth
    polar = along * np.arccos(-top / axis)
    ring = across * np.sin(polar)
    points = np.stack([ring * np.cos(angle), ring * np.sin(angle), -axis * np.cos(polar)], -1)
    rows = sp.kron(sp.eye_array(topology.n_elements), tabulate(xi)) @ topology.extraction
    normal = sp.csc_array(rows.T @ rows)
    return HexMesh(spla.splu(normal).solve(rows.T @ points.reshape(-1, 3)), topology)


def cut_volume(radius: float, length: float, top: float) -> float:
    """Volume of an ellipsoid of revolution below a height over its equator, mm^3."""
    return float(np.pi * radius**2 * (2 / 3 * length + top - top**3 / (3 * length**2)))


def land_fibers(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Fiber directions of Land et al. (2015), problem 3.

    Parameters
    ----------
    points : (n, 3) float64
        In the mesh ``ellipsoid(*LAND, ...)``, mm.

    Returns
    -------
    (n, 3) float64
        ``f = n(dx/du) sin a + n(dx/dv) cos a``, where ``a = 90 - 180 t`` degrees.
    """
    radius, length, wall, _ = LAND
    z, r = points[:, 2], np.hypot(points[:, 0], points[:, 1])
    low, high = np.full(len(z), -0.5), np.full(len(z), 1.5)
    for _ in range(HALVINGS):
        t = (low + high) / 2
        outside = (r / (radius + wall * t)) ** 2 + (z / (length + wall * t)) ** 2 > 1
        low, high = np.where(outside, t, low), np.where(outside, high, t)
    rs, rl = radius + wall * t, length + wall * t
    u, v = -np.arccos(np.clip(z / rl, -1, 1)), np.arctan2(-points[:, 1], -points[:, 0])
    du = np.stack([rs * np.cos(u) * np.cos(v), rs * np.cos(u) * np.sin(v), -rl * np.sin(u)], -1)
    dv = np.stack([-rs * np.sin(u) * np.sin(v), rs * np.sin(u) * np.cos(v), 0 * u], -1)
    angle = np.radians(90 - 180 * t)[:, None]
    du, dv = (d / np.linalg.norm(d, axis=1, keepdims=True) for d in (du, dv))
    return np.asarray(du * np.sin(angle) + dv * np.cos(angle))
