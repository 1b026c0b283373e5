"""Fields and normals of fitted phantoms against what is true of the phantoms.

usage: python -m benchmarks.truth [PHANTOM...] [--levels 1 2 3] [--voxel 2.0]

A row for each phantom, level of detail, and mesh without and with optimization: the angle between
fibers and between normals (mean, 95th percentile, most), the share of the wall in the true AHA
segment, all of it and away from the segments' borders, and the error of the longitudinal and the
transmural coordinate. Nothing here is taken from a mesh of the phantom: truth comes from the closed
form of its surfaces.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import heartgen
from benchmarks.cups import STEP, cup_of, unit
from heartgen import samples
from heartgen.fields import FiberRule, HeartAxes, aha_segment, fiber_frames, heart_axes
from heartgen.fields.coordinates import longitudinal
from heartgen.fields.segments import APEX
from heartgen.fields.wall import wall_of
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.surface_faces import sample_faces
from heartgen.samples.biv_shape import BivShape
from heartgen.samples.nearest import closest, curve_distance, normal
from heartgen.samples.solid import distance
from heartgen.samples.surface_patch import Patch

Array = NDArray[np.float64]

PHANTOMS: dict[str, Callable[[float], samples.Sample]] = {
    "ideal": lambda voxel: samples.ideal_cup(voxel),
    "lifelike": lambda voxel: samples.lifelike_lv(voxel),
    "tilted": lambda voxel: samples.load("tilted"),
    "biv": lambda voxel: samples.biv(voxel),
}
"""What is fitted, from the voxel size, mm, of those that do not have their own."""

THIRDS = np.array([1.0, 3.0, 3.0, 1.0]) / 8
"""Newton and Cotes' weights of the lattice of an element along one direction."""

AWAY = 2.0
"""Distance from a border of AHA segments from which all must agree, mm."""

CREASE = 3.0
"""Distance from the edge of one of several pieces of a surface within which normals do not count,
mm: a smooth mesh rounds the crease."""

FACE_SAMPLES = 6
"""Per face and direction, of normals."""

NEAR_POLE = 0.1
"""Share of the way from pole to base below which fibers do not count: they turn about the pole."""

ONE_WALL = 1e-6
"""How much of a point may belong to the other ventricle's wall, where rules are mixed."""


@dataclass(frozen=True)
class Comparison:
    """How a mesh differs from the truth, at points of its wall and its surfaces.

    Attributes
    ----------
    fibers, normals : (n,) float64
        Angles between directions, degrees.
    weights, areas : (n,) float64
        Volumes and areas that these stand for, mm^3 and mm^2.
    segment, clear : (m,) bool
        In the left ventricle's wall, whether the AHA segments are the same, and whether the point
        is away from their borders.
    left : (m,) float64
        Volumes, mm^3.
    own : (m,) bool
        Which of these points are away from the right ventricle's insertion.
    longitudinal, transmural : (k,) float64
        Differences of the coordinates at those.
    """

    fibers: Array
    weights: Array
    normals: Array
    areas: Array
    segment: NDArray[np.bool_]
    clear: NDArray[np.bool_]
    left: Array
    own: NDArray[np.bool_]
    longitudinal: Array
    transmural: Array

    @property
    def clear_agreement(self) -> float:
        """The same, away from the borders of the segments."""
        return float(self.left[self.clear] @ self.segment[self.clear] / self.left[self.clear].sum())

    @property
    def agreement(self) -> float:
        """Share of the left ventricle's wall whose AHA segment is the true one."""
        return float(self.left @ self.segment / self.left.sum())


def compare(mesh: HexMesh, truth: samples.Truth, rule: FiberRule | None = None) -> Comparison:
    """Compare a fitted mesh with the phantom that it was fitted to.

    Parameters
    ----------
    mesh : HexMesh
    truth : Truth
        Of a phantom of the left ventricle, or of both.
    rule : FiberRule, optional
        Helix angles; the transverse and the sheet angle do not count.

    Returns
    -------
    Comparison
    """
    rule = rule or FiberRule()
    cup = cup_of(truth)
    wall = wall_of(mesh)
    points = truth.pose.to_heart(mesh.lagrange_points().reshape(-1, 3))
    weights = (np.abs(determinants(mesh, lattice())) * _cube(THIRDS)).ravel()
    fibers = fiber_frames(mesh, rule)[..., 0].reshape(-1, 3) @ truth.pose.rotation
    membership, depth = wall.right.ravel(), wall.depth.ravel()
    septum, free = (np.repeat(part, 64) for part in (wall.septum, wall.free_wall))
    # Where two walls meet, the rule mixes theirs, and the truth has no word on how.
    pure = (membership < ONE_WALL) | (membership > 1 - ONE_WALL)
    pure &= _off_insertion(truth, points) & (weights > 0)
    left = np.flatnonzero(~free & (weights > 0))
    place = cup.find(points[left])
    around, up, _ = cup.directions(place)
    ends = np.where(
        septum[left, None] & (membership[left, None] > ONE_WALL),
        (rule.helix[0], -rule.right_helix[0]),
        rule.helix,
    )
    true = np.zeros_like(points)
    true[left] = _turned(around, up, ends, place[:, 2])
    if isinstance(truth.shape, BivShape):
        of_right = np.flatnonzero(free)
        true[of_right] = _right_fibers(truth.shape, points[of_right], rule)
    counts = pure.copy()
    counts[left] &= np.hypot(place[:, 0], place[:, 1]) > NEAR_POLE
    own = pure[left]
    names = (
        aha_segment(truth.pose.to_world(points[left]), heart_axes(mesh)),
        aha_segment(points[left], cup.axes),
    )
    normals, areas = compare_normals(mesh, truth)
    return Comparison(
        fibers=_angle(fibers[counts], true[counts]),
        weights=weights[counts],
        normals=normals,
        areas=areas,
        longitudinal=(longitudinal(mesh).ravel()[left] - cup.longitudinal(place))[own],
        transmural=(depth[left] - place[:, 2])[own],
        segment=names[0] == names[1],
        clear=_clear(points[left], cup.axes),
        left=weights[left],
        own=own,
    )


def compare_normals(mesh: HexMesh, truth: samples.Truth) -> tuple[Array, Array]:
    """Angles (n,), degrees, of a mesh's normals to the true ones, and areas (n,), mm^2."""
    angles, areas = [], []
    for name, pieces in truth.shape.surfaces.items():
        if name == "base":
            continue
        faces = mesh.topology.surfaces["lv_endo" if name == "endo" else name]
        world, normals, weights = sample_faces(mesh, faces, FACE_SAMPLES)
        points, own = truth.pose.to_heart(world), normals @ truth.pose.rotation
        true, counts = _true_normals(pieces, points)
        angles.append(_angle(own[counts], true[counts]))
        areas.append(weights[counts])
    return np.concatenate(angles), np.concatenate(areas)


def _off_insertion(truth: samples.Truth, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3) are a wall's thickness away from where the ventricles meet."""
    if not isinstance(truth.shape, BivShape):
        return np.ones(len(points), dtype=bool)
    edge = truth.shape.walls["septum"].edge
    assert edge is not None
    return curve_distance(edge, points) > truth.shape.lv_wall


def _right_fibers(shape: BivShape, points: Array, rule: FiberRule) -> Array:
    """Fibers (n, 3) of the right free wall, whose surfaces are parallel to an ellipsoid."""
    steps = 1e3 * STEP * np.eye(3)  # of lengths in mm
    outward = unit(
        np.stack(
            [distance(shape.rv, points + h) - distance(shape.rv, points - h) for h in steps], -1
        )
    )
    around = unit(np.cross(shape.basal_plane[1], outward))
    depth = distance(shape.rv, points) / shape.rv_wall
    ends = np.broadcast_to(rule.right_helix, (len(points), 2))
    return _turned(around, np.cross(outward, around), ends, depth)


def _turned(around: Array, up: Array, ends: Array, depth: Array) -> Array:
    """Directions (n, 3) turned by helix angles that are linear in the depth (n,)."""
    angle = np.radians(ends[:, 0] + (ends[:, 1] - ends[:, 0]) * depth)[:, None]
    return np.asarray(np.cos(angle) * around + np.sin(angle) * up)


def _true_normals(pieces: tuple[Patch, ...], points: Array) -> tuple[Array, NDArray[np.bool_]]:
    """Normals (n, 3) of a surface of one piece or more at the feet of points, and which count."""
    normals, gaps, counts = [], [], []
    for patch in pieces:
        tree, plane = patch.seeds
        foot = closest(patch.point, points, plane[tree.query(points)[1]])
        normals.append(normal(patch.point, foot))
        gaps.append(np.linalg.norm(patch.point(foot) - points, axis=1))
        inside = np.ones(len(points), dtype=bool)
        if len(pieces) > 1:
            edges = [curve_distance(curve, points) for curve in patch.boundary]
            inside = patch.region.holds(foot) & (np.min(edges, axis=0) > CREASE)
        counts.append(inside)
    which = np.where(counts, gaps, np.inf).argmin(0)
    at = np.arange(len(points))
    return np.stack(normals)[which, at], np.stack(counts)[which, at]


def _clear(points: Array, axes: HeartAxes) -> NDArray[np.bool_]:
    """Which points (n, 3) are away from all borders of AHA segments, (n,)."""
    out = np.ones(len(points), dtype=bool)
    here = aha_segment(points, axes)
    offset = points - axes.apex
    radial = np.cross(np.cross(axes.longitudinal, offset), axes.longitudinal)
    around = np.cross(axes.longitudinal, radial)
    around /= np.maximum(np.linalg.norm(around, axis=1, keepdims=True), np.finfo(float).tiny)
    for move in (AWAY * axes.longitudinal, AWAY * around):
        for sign in (-1, 1):
            out &= aha_segment(points + sign * move, axes) == here
    # Close to the axis the step around passes over several segments.
    return out & ((here == APEX) | (np.linalg.norm(radial, axis=1) > 2 * AWAY))


def _angle(one: Array, other: Array) -> Array:
    """Angle (n,), degrees, between lines along (n, 3)."""
    one, other = unit(one), unit(other)
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.degrees(np.arctan2(across, np.abs(np.sum(one * other, axis=1))))


def _cube(line: Array) -> Array:
    return np.einsum("i,j,k->ijk", line, line, line).ravel()


def mean(values: Array, weights: Array) -> float:
    """Weighted mean of absolute values."""
    return float(np.average(np.abs(values), weights=weights))


def percentile(values: Array, weights: Array, percent: float = 95.0) -> float:
    """Percentile of absolute values by weight."""
    order = np.argsort(np.abs(values))
    share = np.cumsum(weights[order]) / weights.sum()
    return float(np.abs(values)[order][np.searchsorted(share, percent / 100)])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("phantoms", nargs="*", default=list(PHANTOMS))
    parser.add_argument("--levels", type=int, nargs="+", default=[1, 3])
    parser.add_argument("--voxel", type=float, default=2.0)
    a = parser.parse_args()
    print(
        "| phantom | LoD | optimized | fibers: mean, 95 %, max (deg) | normals: mean, 95 % (deg) "
        "| AHA, away from borders | longitudinal: mean, 95 % | transmural: mean, 95 % |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in a.phantoms:
        sample = PHANTOMS[name](a.voxel)
        for lod in a.levels:
            for optimize in (False, True):
                mesh = heartgen.personalize(sample.mask, lod=lod, optimize=optimize).mesh
                print(
                    f"| {name} | {lod} | {optimize} | {row(compare(mesh, sample.truth))} |",
                    flush=True,
                )


def row(c: Comparison) -> str:
    """Cells of the table."""
    own = c.left[c.own]
    return " | ".join(
        [
            f"{_both(c.fibers, c.weights, 2)}, {c.fibers.max():.1f}",
            _both(c.normals, c.areas, 2),
            f"{c.agreement:.2%}, {c.clear_agreement:.2%}",
            _both(c.longitudinal, own, 4),
            _both(c.transmural, own, 4),
        ]
    )


def _both(values: Array, weights: Array, digits: int) -> str:
    return f"{mean(values, weights):.{digits}f}, {percentile(values, weights):.{digits}f}"


if __name__ == "__main__":
    main()
