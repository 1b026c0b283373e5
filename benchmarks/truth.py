"""Fields and normals of fitted phantoms against what is true of the phantoms.

usage: python -m benchmarks.truth [PHANTOM...] [--levels 1 2 3] [--voxel 2.0]

A row for each phantom, level of detail, and mesh without and with refinement: the angle between
fibers and between normals (mean, 95th percentile, most), the share of the wall in the true AHA
segment, all of it and away from the segments' borders, and the error of the longitudinal and the
transmural coordinate. Nothing here is taken from a mesh of the phantom: truth comes from the closed
form of its surfaces.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import heartgen
from heartgen import samples
from heartgen.fields import FibreRule, HeartAxes, aha_segment, fibre_frames, heart_axes
from heartgen.fields.axes import RIGHT_FRONT
from heartgen.fields.coordinates import longitudinal
from heartgen.fields.segments import APEX
from heartgen.fields.wall import wall_of
from heartgen.mesh import HexMesh
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.jacobian import determinants
from heartgen.mesh.surfaces import sample_faces
from heartgen.samples.biventricle import BivShape, below_base
from heartgen.samples.nearest import closest, curve_distance, normal
from heartgen.samples.outline import cut_along_base
from heartgen.samples.patch import Patch
from heartgen.samples.shape import Shape
from heartgen.samples.solid import distance, shell_point

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

STEP = 1e-5
"""Of the differences that replace derivatives, in coordinates of the size of 1."""

NEWTON_STEPS = 12
"""More than a search in a smooth wall takes to rounding."""

FIRST = (41, 64, 5)
"""Places along, around and across at which that search may start."""

PROFILE = 401
"""Places along a meridian at which its length is tabulated."""

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


def compare(mesh: HexMesh, truth: samples.Truth, rule: FibreRule | None = None) -> Comparison:
    """Compare a fitted mesh with the phantom that it was fitted to.

    Parameters
    ----------
    mesh : HexMesh
    truth : Truth
        Of a phantom of the left ventricle, or of both.
    rule : FibreRule, optional
        Helix angles; the transverse and the sheet angle do not count.

    Returns
    -------
    Comparison
    """
    rule = rule or FibreRule()
    cup = cup_of(truth)
    wall = wall_of(mesh)
    points = truth.pose.to_heart(mesh.lagrange_points().reshape(-1, 3))
    weights = (np.abs(determinants(mesh, lattice())) * _cube(THIRDS)).ravel()
    fibers = fibre_frames(mesh, rule)[..., 0].reshape(-1, 3) @ truth.pose.rotation
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


def cup_of(truth: samples.Truth) -> Cup:
    """The wall of the left ventricle of a phantom."""
    shape = truth.shape
    if isinstance(shape, Shape):
        toward = np.asarray(RIGHT_FRONT) @ truth.pose.rotation
        return Cup(shape.patches["endo"], shape.patches["epi"], toward, shape.basal_plane[1])
    assert isinstance(shape, BivShape)
    assert shape.septum == shape.lv_wall, "one wall all around"
    below = partial(below_base, shape)
    inner, outer = (
        cut_along_base(partial(shell_point, shape.lv, offset), below).patch
        for offset in (0.0, shape.lv_wall)
    )
    middle, weights = shape.walls["septum"].patch.samples(2000)
    beside = middle * [1, 1, 0] / np.linalg.norm(middle[:, :2], axis=1, keepdims=True)
    return Cup(inner, outer, weights @ beside, shape.basal_plane[1])


@dataclass(frozen=True)
class Cup:
    """A wall between two surfaces in closed form, which straight lines join.

    Places are (q cos t, q sin t, s): the share q of the way from the pole to the rim, the angle t
    around and the depth s. Everything is in the phantom's own frame, mm.

    Attributes
    ----------
    inner, outer : Patch
    toward : (3,) float64
        Direction in which the septum lies.
    upward : (3,) float64
        Normal of the base: what runs around is parallel to it.
    """

    inner: Patch
    outer: Patch
    toward: Array
    upward: Array

    def points(self, place: Array) -> Array:
        """Points (n, 3) at places (n, 3)."""
        q, turn = np.hypot(place[:, 0], place[:, 1]), np.arctan2(place[:, 1], place[:, 0])
        share = np.mod(turn / (2 * np.pi), 1)
        inner, outer = (
            surface.point(surface.region.place(q, share)[0]) for surface in (self.inner, self.outer)
        )
        return np.asarray(inner + place[:, 2:] * (outer - inner))

    def slopes(self, place: Array) -> Array:
        """Derivatives (n, 3, 3) of the points by the coordinates of their places, last."""
        steps = STEP * np.eye(3)
        return np.stack(
            [(self.points(place + h) - self.points(place - h)) / (2 * STEP) for h in steps], -1
        )

    @cached_property
    def starts(self) -> tuple[Array, Array]:
        """Places (n, 3) all over the wall, and their points (n, 3)."""
        along, around, across = FIRST
        q, turn, s = (
            x.ravel()
            for x in np.meshgrid(
                np.linspace(0, 1, along),
                2 * np.pi * np.arange(around) / around,
                np.linspace(0, 1, across),
            )
        )
        place = np.column_stack([q * np.cos(turn), q * np.sin(turn), s])
        return place, self.points(place)

    def find(self, points: Array) -> Array:
        """Places (n, 3) of points (n, 3), which may lie a little outside of the wall."""
        places, starts = self.starts
        place = places[cKDTree(starts).query(points)[1]]
        for _ in range(NEWTON_STEPS):
            gap = points - self.points(place)
            place = place + np.linalg.solve(self.slopes(place), gap[..., None])[..., 0]
        assert np.abs(self.points(place) - points).max() < 1e-6  # the search has ended
        return place

    def directions(self, place: Array) -> tuple[Array, Array, Array]:
        """Circumferential, longitudinal and transmural unit vectors (n, 3) at places (n, 3)."""
        slopes = self.slopes(place)
        across = _unit(np.cross(slopes[..., 0], slopes[..., 1]))
        across *= np.sign(np.sum(across * slopes[..., 2], axis=1, keepdims=True))
        around = _unit(np.cross(self.upward, across))
        return around, np.cross(across, around), across

    @cached_property
    def profile(self) -> Array:
        """Mean share (n,) of the length from the pole to the rim at even shares q."""
        q = np.linspace(0, 1, PROFILE)
        _, around, across = FIRST
        shares = []
        for turn in 2 * np.pi * np.arange(around) / around:
            for s in np.linspace(0, 1, across):
                line = self.points(np.column_stack([q * np.cos(turn), q * np.sin(turn), 0 * q + s]))
                length = np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))
                shares.append(np.append(0, length / length[-1]))
        return np.asarray(np.mean(shares, axis=0))

    def longitudinal(self, place: Array) -> Array:
        """Longitudinal coordinate (n,) at places (n, 3): 0 at the apex to 1 at the base."""
        q = np.hypot(place[:, 0], place[:, 1])
        return np.interp(q, np.linspace(0, 1, PROFILE), self.profile)

    @cached_property
    def axes(self) -> HeartAxes:
        """Long axis and septum, by the definition of `heartgen.fields.heart_axes`."""
        turn = np.linspace(0, 2 * np.pi, PROFILE)
        rim = self.points(np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]))
        spokes = rim - rim[:-1].mean(0)
        parts = np.cross(spokes[:-1], spokes[1:]) / 2
        area = parts.sum(0)
        share = parts @ area
        centre = rim[:-1].mean(0) + share @ (spokes[:-1] + spokes[1:]) / (3 * share.sum())
        endo = self.inner.samples(40_000)[0]
        apex = endo[np.argmax(np.abs((endo - centre) @ area))]
        axis = _unit((centre - apex)[None])[0]
        septal = self.toward - (self.toward @ axis) * axis
        return HeartAxes(centre, apex, _unit(septal[None])[0], "measured")


def _off_insertion(truth: samples.Truth, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3) are a wall's thickness away from where the ventricles meet."""
    if not isinstance(truth.shape, BivShape):
        return np.ones(len(points), dtype=bool)
    edge = truth.shape.walls["septum"].edge
    assert edge is not None
    return curve_distance(edge, points) > truth.shape.lv_wall


def _right_fibers(shape: BivShape, points: Array, rule: FibreRule) -> Array:
    """Fibers (n, 3) of the right free wall, whose surfaces are parallel to an ellipsoid."""
    steps = 1e3 * STEP * np.eye(3)  # of lengths in mm
    outward = _unit(
        np.stack(
            [distance(shape.rv, points + h) - distance(shape.rv, points - h) for h in steps], -1
        )
    )
    around = _unit(np.cross(shape.basal_plane[1], outward))
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
    one, other = _unit(one), _unit(other)
    across = np.linalg.norm(np.cross(one, other), axis=1)
    return np.degrees(np.arctan2(across, np.abs(np.sum(one * other, axis=1))))


def _unit(vectors: Array) -> Array:
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(size, np.finfo(float).tiny))


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
        "| phantom | LoD | refined | fibers: mean, 95 %, max (deg) | normals: mean, 95 % (deg) "
        "| AHA, away from borders | longitudinal: mean, 95 % | transmural: mean, 95 % |"
    )
    print("|---|---|---|---|---|---|---|---|")
    for name in a.phantoms:
        sample = PHANTOMS[name](a.voxel)
        for lod in a.levels:
            for refine in (False, True):
                mesh = heartgen.personalize(sample.mask, lod=lod, refine=refine).mesh
                print(
                    f"| {name} | {lod} | {refine} | {row(compare(mesh, sample.truth))} |",
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
