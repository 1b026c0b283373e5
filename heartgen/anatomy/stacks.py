"""Shape of a heart from a stack of short-axis slices: an isotropic grid between them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.base import Base
from heartgen.anatomy.fit_surfaces import heights, mesh_surfaces
from heartgen.anatomy.heart_shape import POOL_SURFACES, HeartShape, Slices
from heartgen.anatomy.interpolation import Part, part_of
from heartgen.anatomy.plane import Plane
from heartgen.anatomy.short_axis_contours import ShortAxisContours
from heartgen.errors import AnatomyError
from heartgen.images.contours import contour
from heartgen.images.isosurface import Isosurface
from heartgen.images.levelset import LevelSet, level_distances
from heartgen.images.mask import Finding
from heartgen.images.stack import MARGIN, Stack

LEAST_SLICES = 3
"""Slices that must show the left ventricle's pool: a base, a middle and an apex."""

APICAL_WALL = 0.5
"""Thickness of the wall at the apex, at least, over the median thickness in the slices."""


def shape_of_stack(sections: ShortAxisContours, truncate: float | str) -> HeartShape:
    """Interpolate the parts of the heart between slices, and find its ends.

    Parameters
    ----------
    sections : ShortAxisContours
        Parts of the heart in the slices.
    truncate : float or {"auto", "off"}
        Truncation below the upper end of the stack, mm; ``"auto"`` is none, because slices are
        planned below the valves.

    Returns
    -------
    HeartShape

    Raises
    ------
    AnatomyError
        If fewer than three slices show the left ventricle, or the truncation leaves nothing.
    """
    stack = sections.stack
    showing = int(_showing(sections.left).sum())
    if showing < LEAST_SLICES:
        raise AnatomyError(
            f"{showing} slice(s) show the left ventricle's pool inside its wall, too few for a "
            f"mesh: give at least {LEAST_SLICES} slices across it"
        )
    heart, pools = _parts(sections)
    z, affine = _grid(stack, heart)
    filled, *levels = level_distances(
        [np.moveaxis(part.at(z), 0, 2) for part in (heart, *pools)], affine
    )
    base = _base(stack, pools[0], truncate)
    voxel = float(np.prod(np.linalg.norm(affine[:3, :3], axis=0)) ** (1 / 3))
    surfaces, _ = mesh_surfaces(dict(zip(POOL_SURFACES, levels, strict=False)), filled, base, voxel)
    blood = np.min([level.values for level in levels], axis=0)
    wall = np.maximum(filled.values, -blood)
    return HeartShape(
        wall=wall < 0,
        pools=tuple(level.values < 0 for level in levels),
        filled=filled,
        levels=tuple(levels),
        base=base,
        voxel=voxel,
        surfaces=surfaces,
        myocardium=LevelSet(np.maximum(wall, heights(filled, base.plane)), affine),
        findings=(*sections.findings, _interpolated(stack, voxel)),
        slices=_slices(sections, surfaces),
    )


def _parts(sections: ShortAxisContours) -> tuple[Part, list[Part]]:
    """Filled heart and pools, closed at their lower ends."""
    stack = sections.stack
    z, distance = stack.heights, stack.distance
    heart = part_of(sections.heart, z, stack.spacing, distance, shifts=sections.shifts)
    shapes = [sections.left] if sections.right is None else [sections.left, sections.right]
    least = APICAL_WALL * _typical_wall(sections)
    pools = []
    for shape in shapes:
        lowest = int(np.flatnonzero(shape.any(axis=(1, 2)))[0])
        floor = max(heart.heights[0] + least, z[lowest - 1] if lowest else -np.inf)
        pools.append(part_of(shape, z, stack.spacing, distance, floor, sections.shifts))
    return heart, pools


def _typical_wall(sections: ShortAxisContours) -> float:
    """Median over the slices of the left wall's thickness: that of a ring of its area, mm."""
    pixel = float(np.prod(sections.stack.spacing))
    thick = []
    for heart, left, right in zip(
        sections.heart,
        sections.left,
        sections.left if sections.right is None else sections.right,
        strict=True,
    ):
        if left.any():
            inner = left.sum() * pixel
            outer = (heart.sum() - (right & ~left).sum()) * pixel
            thick.append(float((np.sqrt(outer) - np.sqrt(inner)) / np.sqrt(np.pi)))
    return float(np.median(thick))


def _grid(stack: Stack, heart: Part) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Heights of the planes of the grid, on which the slices lie, and its affine."""
    step = stack.distance / np.ceil(stack.distance / float(stack.spacing.mean()))
    first = int(np.floor((heart.heights[0] - stack.heights[0]) / step)) - MARGIN
    top = stack.heights[-1] + stack.distance / 2 - stack.heights[0]
    last = int(np.ceil(top / step)) + MARGIN
    z = stack.heights[0] + step * np.arange(first, last + 1)
    affine = stack.affine.copy()
    affine[:3, 2] *= step
    affine[:3, 3] += stack.normal * z[0]
    return z, affine


def _base(stack: Stack, pool: Part, truncate: float | str) -> Base:
    """Upper end of the slab of the uppermost slice, or a truncation below it."""
    center = np.argwhere(pool.values[-1] < 0).mean(0)
    end = float(stack.heights[-1]) + stack.distance / 2
    plane = Plane(stack.to_world(np.array([[*center, end]]))[0], stack.normal)
    if isinstance(truncate, str):
        return Base(plane, plane, None, 0.0)
    length = end - float(pool.heights[0])
    if not 0 <= truncate < length / 2:
        raise AnatomyError(
            f"a truncation of {truncate:.3g} mm does not fit a ventricle {length:.3g} mm long: "
            "choose a distance between 0 and half the length"
        )
    plane = plane.shifted(-truncate)
    return Base(plane, plane, float(truncate), 0.0)


def _slices(sections: ShortAxisContours, surfaces: dict[str, LevelSet]) -> Slices:
    """Contours in the slices."""
    stack = sections.stack
    shapes = {"lv_endo": sections.left, "epi": sections.heart}
    if sections.right is not None:
        shapes["rv_endo"] = sections.right
    contours = {}
    for name, shape in shapes.items():
        shown = sections.left if name == "epi" else shape
        points = _in_world(stack, shape, _showing(shown), sections.shifts)
        slope = surfaces[name].sample(points.points)[1]
        slope /= np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), np.finfo(float).tiny)
        contours[name] = Isosurface(points.points, points.triangles, points.weights, slope)
    return Slices(
        contours=contours,
        outline=_in_world(stack, stack.pixels, _showing(sections.left), sections.shifts),
        given=_in_world(stack, stack.pixels, _showing(sections.left), 0 * sections.shifts),
        normal=stack.normal,
        heights=stack.heights + float(stack.normal @ stack.affine[:3, 3]),
        distance=stack.distance,
        shifts=sections.shifts @ (stack.affine[:3, :2] / stack.spacing).T,
    )


def _in_world(
    stack: Stack, shape: NDArray[np.bool_], shown: NDArray[np.bool_], shifts: NDArray[np.float64]
) -> Isosurface:
    """Contours of a shape in some of the slices, with the normals in their planes.

    Shifts (n, 2), mm, are taken back.
    """
    found = [(n, contour(shape[n], stack.spacing)) for n in np.flatnonzero(shown)]
    points = [
        np.c_[c.points - shifts[n] / stack.spacing, np.full(len(c.points), stack.heights[n])]
        for n, c in found
    ]
    axes = stack.affine[:3, :2] / stack.spacing
    return Isosurface(
        stack.to_world(np.concatenate(points)),
        np.zeros((0, 3), dtype=np.intp),
        np.concatenate([c.lengths for _, c in found]) * stack.distance,
        np.concatenate([c.normals for _, c in found]) @ axes.T,
    )


def _showing(shapes: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which slices (n,) show a part (n, nx, ny)."""
    return np.asarray(shapes.any(axis=(1, 2)))


def _interpolated(stack: Stack, voxel: float) -> Finding:
    """Say what was made of the slices."""
    return Finding(
        "stack",
        f"{len(stack.heights)} short-axis slices {stack.distance:.3g} mm apart: the mesh is fitted "
        f"to their contours; between them, shapes are interpolated at {voxel:.2g} mm",
    )
