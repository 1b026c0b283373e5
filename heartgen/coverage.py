"""Is all of the heart in the mesh: what of the image the mesh accounts for.

A mean distance from the mask to the mesh tells little of what was left out, and a mesh of the wrong
part may be close to most of the mask. Coverage counts what is far from the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen.anatomy import Anatomy
from heartgen.images.contours import slits
from heartgen.images.distance import inner_distance
from heartgen.images.isosurface import isosurface
from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD, Finding, Mask
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.closest import closest_points
from heartgen.mesh.hexmesh import HexMesh

Array = NDArray[np.float64]

NEAR = 2.0
"""Pixels from the mesh within which the image's wall counts as covered."""

LEAST_WALL, LEAST_CONTOUR, MOST_BLOOD = 0.96, 0.98, 0.06
"""Shares of wall and contours that a successful mesh covers at least, and of a blood pool that lies
in its wall at most. Of 115 meshes of label maps that follow their labels, the poorest had 0.9965,
0.985 (which leaves a tail of two apical slices without its pool) and 0.038, and of 40 stacks 0.967
of the wall where the apical slice is filled; of the four that do not, each misses one of the bounds
or is not valid."""

LEAST_SLICE = 0.94
"""Share of the contours of any slice of a stack that a successful mesh covers at least. Of the
meshes of label maps that follow their labels the poorest slice had 0.96; of those that do not in
one or two slices, though they do on the whole, 0.79 to 0.92."""

STRAY = 3.0
"""Pixels from a slice's wall beyond which the mesh's wall is none of it."""

MOST_STRAY, MOST_STRAY_ON = 0.02, 0.008
"""Share of that in the mesh's cross-section of a slice, at most, and in both of two adjacent ones.
Of 190 meshes of stacks that follow their masks the worst slice had 0.018, below the end of a right
ventricle, and the worst two 0.006; of four that leave the mask at the base, three of them at the
pulmonary valve, one slice had 0.023 and more, or both of two 0.010."""

MOST_FILLED = 1
"""Adjacent slices of a stack, at most, whose pool a successful mesh may fill with its wall: where a
pool tapers off in its last slice, the mesh may have its pole above it."""

DISTINCT = 1.5
"""Pixels from the border of a pool of a slice to its middle, at least, that tell that it is one."""

MOST_ABOVE = 0.35
"""Share of the wall that may lie above the base of a successful mesh: valves, vessels, and slices
above the right ventricle."""

MOST = 20_000
"""Voxels of a kind that are looked at: their share is known to half a percent."""

FINEST, LONG = 24, 90
"""Samples of an element along a direction, at most; and percentile of the edges' lengths that is
sampled at every pixel."""

APART = 1e6
"""Distance that stands for slices which have nothing to do with each other, mm."""

FACES = ndi.generate_binary_structure(3, 1)
"""Voxels that share a face are neighbors."""

ML = 1000.0
"""mm^3 in a milliliter."""


@dataclass(frozen=True)
class Coverage:
    """What of the image a mesh accounts for.

    Attributes
    ----------
    wall : float
        Share of the mask's voxels below the base that lie in the mesh or within two pixels of it,
        papillary muscles aside.
    contour : float
        Share of the mask's outline (of a stack, of the contours in its slices, slits as narrow as
        two pixels aside) within two pixels of the mesh's surface.
    slice_contour : float
        The same of the contours of wall and pools in the slice of a stack that has least; that of
        the outline if there are none.
    stray : float
        Share of the pixels of the mesh's cross-section in any slice of a stack, most, that lie
        farther than three pixels from the wall that the slice shows; 0 of a dense mask, where
        errors tell.
    stray_on : float
        The same in both of two adjacent slices, most.
    blood : float
        Share of a pool, of what lies two pixels and more inside it, that lies in the mesh's wall:
        the larger of both labeled pools, or of what a stack's slices enclose; 0 of a dense mask
        without labels.
    filled : int
        Adjacent slices of a stack in which the middle of a pool lies in the mesh's wall, most of
        either pool.
    missed : float
        Volume of the wall below the base that is not covered, ml.
    above : float
        Share of the mask's voxels above the base, slices of a stack without a left pool aside.
    """

    wall: float
    contour: float
    slice_contour: float
    stray: float
    stray_on: float
    blood: float
    filled: int
    missed: float
    above: float

    @property
    def finding(self) -> Finding | None:
        """What is not accounted for, in words; None if nothing is."""
        one_slice = f"{1 - self.slice_contour:.0%} of the outline of one slice"
        one = self.stray > MOST_STRAY
        its_wall = (
            f"{self.stray:.1%} of its wall in one slice"
            if one
            else f"{self.stray_on:.1%} of its wall in two adjacent slices"
        )
        told = {
            f"{self.missed:.2g} ml of the wall ({1 - self.wall:.1%}) lie outside the mesh": (
                self.wall < LEAST_WALL
            ),
            f"{1 - self.contour:.1%} of the outline are farther than two pixels from it": (
                self.contour < LEAST_CONTOUR
            ),
            f"{one_slice} are farther than two pixels from it": (
                self.contour >= LEAST_CONTOUR and self.slice_contour < LEAST_SLICE
            ),
            f"{its_wall} are farther than three pixels from the wall there": (
                one or self.stray_on > MOST_STRAY_ON
            ),
            f"{self.blood:.1%} of a blood pool lie in its wall": self.blood > MOST_BLOOD,
            f"the pool of {self.filled} adjacent slices lies in its wall": (
                self.filled > MOST_FILLED
            ),
            f"{self.above:.0%} of the wall lie above its base": self.above > MOST_ABOVE,
        }
        parts = [text for text, so in told.items() if so]
        if not parts:
            return None
        message = f"the mesh leaves out a part of the heart: {'; '.join(parts)}"
        return Finding("coverage", message, serious=True)


def assess_coverage(mesh: HexMesh, mask: Mask, anatomy: Anatomy) -> Coverage:
    """Measure what of an image a mesh accounts for.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    mask : Mask
        The myocardium, in the world (LPS).
    anatomy : Anatomy
        Of the mask: its base, and where its slices were moved.

    Returns
    -------
    Coverage
    """
    pixel = mask.pixel
    samples = _samples(mesh, pixel)
    muscle = cKDTree(samples)
    wall = _below(mask, anatomy, mask.voxels)
    wall = wall[_into_pools(anatomy, wall) < 0]
    covered = float(np.mean(muscle.query(_few(wall))[0] < NEAR * pixel))
    pools = _pools(mask)
    depths = [_depth(mask, pool) for pool in pools]
    deep = [_below(mask, anatomy, depth > NEAR * pixel) for depth in depths]
    inside = [np.mean(muscle.query(_few(points))[0] < pixel) for points in deep if len(points)]
    outline = (
        isosurface(anatomy.myocardium)
        if anatomy.slices is None
        else anatomy.slices.outline.part(~slits(anatomy.slices.outline, NEAR * pixel))
    )
    points, weights = _few(outline.points), _few(outline.weights)
    near = closest_points(mesh, mesh.topology.external, points).distance < NEAR * pixel
    outside = _into_pools(anatomy, points) < NEAR * pixel
    contour = float(np.average(near, weights=weights * outside))
    stray = _stray(mask, anatomy, np.any(pools, axis=0), samples)
    return Coverage(
        wall=covered,
        contour=contour,
        slice_contour=min(_by_slice(mesh, anatomy, pixel), default=contour),
        stray=max(stray, default=0.0),
        stray_on=max(map(min, pairwise(stray)), default=0.0),
        blood=float(max(inside, default=0.0)),
        filled=max((_filled(mask, anatomy, depth, muscle) for depth in depths), default=0),
        missed=(1 - covered) * len(wall) * float(np.prod(mask.spacing)) / ML,
        above=_above(mask, anatomy, pools) / int(mask.voxels.sum()),
    )


def _samples(mesh: HexMesh, pixel: float) -> Array:
    """Points (n, 3) in the mesh's elements, about a pixel apart."""
    corners = mesh.evaluate(lattice(2)).reshape(-1, 2, 2, 2, 3)
    edges = [np.linalg.norm(np.diff(corners, axis=axis), axis=-1) for axis in (3, 2, 1)]
    count = [int(np.clip(np.ceil(np.percentile(e, LONG) / pixel), 2, FINEST)) for e in edges]
    t = np.meshgrid(*((np.arange(n) + 0.5) / n for n in count), indexing="ij")
    return mesh.evaluate(np.stack(t, -1).reshape(-1, 3)).reshape(-1, 3)


def _below(mask: Mask, anatomy: Anatomy, voxels: NDArray[np.bool_]) -> Array:
    """Centers (n, 3) of voxels below the base, mm, world (LPS), where slices were moved to."""
    points = _moved(mask, anatomy, np.argwhere(voxels))
    return points[anatomy.base.surface.height(points) < 0]


def _moved(mask: Mask, anatomy: Anatomy, index: NDArray[np.intp]) -> Array:
    """Centers (n, 3) of voxels of an index (n, 3), mm, world (LPS), where slices were moved to."""
    points = mask.to_world(index.astype(float))
    return points if anatomy.slices is None else points - anatomy.slices.shift_at(points)


def _above(mask: Mask, anatomy: Anatomy, pools: list[NDArray[np.bool_]]) -> int:
    """Voxels of the wall above the base, without slices of a stack that have no left pool."""
    wall = mask.voxels
    if anatomy.slices is not None and pools[0].any():
        wall = wall & pools[0].any(tuple({0, 1, 2} - {mask.stack_axis}), keepdims=True)
    return int(wall.sum()) - len(_below(mask, anatomy, wall))


def _into_pools(anatomy: Anatomy, points: Array) -> Array:
    """Depth (n,) of points (n, 3) in the pools, mm: of papillary muscles, which no mesh has."""
    pools = [level for name, level in anatomy.surfaces.items() if name.endswith("endo")]
    return np.asarray(-np.min([pool.sample(points)[0] for pool in pools], axis=0))


def _pools(mask: Mask) -> list[NDArray[np.bool_]]:
    """Blood pools: the labeled ones, or all that the slices of a stack enclose."""
    axis = mask.stack_axis
    if mask.blood is not None:
        return [np.asarray(mask.blood == code) for code in (LEFT_BLOOD, RIGHT_BLOOD)]
    if axis is None:
        return []
    filled = ndi.binary_fill_holes(mask.voxels, np.delete(FACES, (0, 2), axis))
    return [np.asarray(filled) & ~mask.voxels]


def _depth(mask: Mask, pool: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Distance from a pool's voxels to its border, mm, in the plane of a stack's slices."""
    spacing = mask.spacing.copy()
    if mask.stack_axis is not None:
        spacing[mask.stack_axis] = APART
    return inner_distance(pool, spacing)


def _by_slice(mesh: HexMesh, anatomy: Anatomy, pixel: float) -> list[float]:
    """Share of the contours of wall and pools in each slice of a stack that is near the mesh.

    These contours leave out the slivers between the walls of a mask, which no mesh follows.
    """
    if anatomy.slices is None:
        return []
    contours = list(anatomy.slices.contours.values())
    points = np.concatenate([contour.points for contour in contours])
    weights = np.concatenate([contour.weights for contour in contours])
    near = closest_points(mesh, mesh.topology.external, points).distance < NEAR * pixel
    height = points @ anatomy.slices.normal
    nearest = np.abs(height[:, None] - anatomy.slices.heights).argmin(axis=1)
    total, covered = np.bincount(nearest, weights), np.bincount(nearest, weights * near)
    return [float(part / whole) for part, whole in zip(covered, total, strict=True) if whole > 0]


def _stray(mask: Mask, anatomy: Anatomy, pool: NDArray[np.bool_], samples: Array) -> list[float]:
    """Share of the mesh's cross-section in each slice that is far from the wall of the slice.

    Gaps in a wall that the shape analysis closed are wall. Where a pool tapers off in its last
    slice, that it is narrower is no matter of the wall: see `_filled`.
    """
    axis = mask.stack_axis
    if axis is None or anatomy.slices is None:
        return []
    index = mask.to_index(samples + anatomy.slices.shift_at(samples))
    off = np.abs(index[:, axis] - index[:, axis].round()) * mask.spacing[axis]
    pixels = index[off < mask.pixel / 2].round().astype(int)
    pixels = pixels[((pixels >= 0) & (pixels < mask.voxels.shape)).all(axis=1)]
    section = np.zeros(mask.voxels.shape, dtype=bool)
    section[tuple(pixels.T)] = True
    others = tuple({0, 1, 2} - {axis})
    wall = mask.voxels | (_shape(mask, anatomy, section) & mask.voxels.any(others, keepdims=True))
    sections, walls, bloods = (np.moveaxis(a, axis, 0) for a in (section, wall, pool))
    if mask.affine[:3, axis] @ anatomy.slices.normal < 0:
        sections, walls, bloods = sections[::-1], walls[::-1], bloods[::-1]
    shares, below = [], np.zeros_like(bloods[0])
    for mesh, wall, blood in zip(sections, walls, bloods, strict=True):
        if wall.any() and mesh.any():
            away = ndi.distance_transform_edt(~(wall | _begun(blood, below))) > STRAY
            shares.append(float(np.mean(away[mesh])))
        below = blood
    return shares


def _shape(mask: Mask, anatomy: Anatomy, near: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels of the wall as the shape analysis has it, in the box around some voxels."""
    wall = np.zeros_like(near)
    for box in ndi.find_objects(near.astype(int)):
        grid = np.argwhere(np.ones_like(near[box])) + [side.start for side in box]
        points = _moved(mask, anatomy, grid)
        within = anatomy.surfaces["epi"].sample(points)[0] < 0
        wall[tuple(grid.T)] = within & (_into_pools(anatomy, points) < 0)
    return wall


def _begun(blood: NDArray[np.bool_], below: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Pools of a slice that do not go on in the slice below it, towards the apex."""
    pieces, count = ndi.label(blood)
    goes_on = np.bincount(pieces[below], minlength=count + 1) > 0
    goes_on[0] = True
    return np.asarray(~goes_on[pieces])


def _filled(mask: Mask, anatomy: Anatomy, depth: NDArray[np.float32], muscle: cKDTree) -> int:
    """Adjacent slices, most, of a stack in which the middle of a pool lies in the mesh's wall."""
    if mask.stack_axis is None:
        return 0
    run = most = 0
    for n, plane in enumerate(np.moveaxis(depth, mask.stack_axis, 0)):
        middle = np.zeros(depth.shape, dtype=bool)
        deepest = float(plane.max())
        if deepest >= DISTINCT * mask.pixel:
            np.moveaxis(middle, mask.stack_axis, 0)[n] = plane == deepest
        points = _below(mask, anatomy, middle)
        inside = len(points) > 0 and np.mean(muscle.query(points)[0] < mask.pixel) > 0.5
        run = run + 1 if inside else 0
        most = max(most, run)
    return most


def _few(points: Array) -> Array:
    """Some of the points (n, 3), in even steps."""
    return points[:: max(1, len(points) // MOST)]
