"""How deep in the wall a point lies, and how much it belongs to the right ventricle.

The wall is a bundle of lines from an inner to an outer surface: of the left ventricle from
endocardium to epicardium, of the septum to the endocardium of the right one, and of the free wall
of the right ventricle from its own endocardium to the epicardium. Where the three meet, at the
insertion line, the depth passes from one wall to the others over a distance of a wall's thickness,
so that it is continuous everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen.fields.coordinate_lines import length_share, lines
from heartgen.mesh.bernstein import ORDER
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surface_faces import face_coefficients

Array = NDArray[np.float64]

INNER, OUTER = 4, 5
"""Faces of an element towards endo- and epicardium."""

SHARPNESS = 4
"""Power of the inverse distance by which the depth of the insertion line is carried on."""


@dataclass(frozen=True, eq=False)
class Wall:
    """Places in the wall, at the Lagrange nodes of each element.

    Attributes
    ----------
    depth : (e, 64) float64
        0 on the endocardium to 1 on the epicardium; 1 also where the septum bounds the right
        ventricle, but for the neighborhood of the insertion line.
    right : (e, 64) float64
        0 in the left ventricle's wall and on the insertion line, 1 in the septum and the right free
        wall from a wall's thickness beyond it.
    septum, free_wall : (e,) bool
        Elements between both ventricles, and those of the right ventricle's own wall.
    """

    depth: Array
    right: Array
    septum: NDArray[np.bool_]
    free_wall: NDArray[np.bool_]


def wall_of(mesh: HexMesh) -> Wall:
    """Find how deep in the wall each lattice point lies.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    Wall
    """
    topology = mesh.topology
    septum, free_wall = (
        np.isin(np.arange(mesh.n_elements), topology.parts.get(name, []))
        for name in ("septum", "right ventricle")
    )
    share = length_share(mesh, 2)
    right = np.zeros_like(share)
    if not septum.any():
        return Wall(share, right, septum, free_wall)
    points = mesh.lagrange_points()
    line, depth, thickness = _insertion(points, share, mesh, septum)
    for part, end in ((septum, OUTER), (free_wall, INNER)):
        runs = [run for run in lines(topology, 2) if part[run[0]]]
        ends = np.array([run[-1] if end == OUTER else run[0] for run in runs])
        places = points[ends[:, None], face_coefficients()[end]]  # (runs, 16, 3)
        distance, carried = _carried(places, line, depth)
        member = _smooth_step(distance / thickness)
        own = float(end == OUTER)  # depth on the right endocardium: 1 of the septum's, 0 of its own
        meets = (1 - member) * carried + member * own
        for run, weight, value in zip(runs, member, meets, strict=True):
            within = share[run].reshape(len(run), ORDER, -1)
            changed = value * within if end == OUTER else value + (1 - value) * within
            share[run] = changed.reshape(len(run), -1)
            right[run] = np.tile(weight, ORDER)
    return Wall(share, right, septum, free_wall)


def _insertion(
    points: Array, share: Array, mesh: HexMesh, septum: NDArray[np.bool_]
) -> tuple[Array, Array, float]:
    """Points (m, 3) of the insertion line, mm; depth (m,) there, mean thickness of the wall, mm."""
    patches, corners = mesh.topology.patches, face_coefficients()
    of_septum, of_free = (
        points[patches[name][:, :1], corners[patches[name][:, 1]]].reshape(-1, 3)
        for name in ("rv_septum", "rv_free_wall")
    )
    same = float(np.ptp(points.reshape(-1, 3), axis=0).max()) * np.finfo(float).eps ** 0.5
    line = of_septum[cKDTree(of_free).query(of_septum)[0] < same]
    left = np.flatnonzero(~np.isin(np.arange(mesh.n_elements), mesh.topology.parts["septum"]))
    left = np.setdiff1d(left, mesh.topology.parts["right ventricle"])
    near = cKDTree(points[left].reshape(-1, 3)).query(line)[1]
    element, place = np.divmod(near, ORDER**3)
    run_of = {int(e): run for run in lines(mesh.topology, 2) for e in run}
    column = place % ORDER**2
    lengths = [
        np.linalg.norm(
            points[run_of[int(e)][-1], c + ORDER**2 * (ORDER - 1)] - points[run_of[int(e)][0], c]
        )
        for e, c in zip(left[element], column, strict=True)
    ]
    return line, share[left][element, place], float(np.mean(lengths))


def _carried(places: Array, line: Array, values: Array) -> tuple[Array, Array]:
    """Distance (r, 16) of places (r, 16, 3) from a line (m, 3), and its values carried on there."""
    gaps = np.linalg.norm(places[:, :, None] - line, axis=-1)
    weights = np.maximum(gaps, np.finfo(float).eps) ** -SHARPNESS
    return gaps.min(-1), np.asarray(weights @ values / weights.sum(-1))


def _smooth_step(x: Array) -> Array:
    """0 up to x = 0, 1 from x = 1, level at both."""
    t = np.clip(x, 0, 1)
    return np.asarray(t * t * (3 - 2 * t))
