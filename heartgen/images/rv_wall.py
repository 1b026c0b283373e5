"""A wall for the right ventricle, which most label maps leave out because it is thin."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.images.distance import inner_distance
from heartgen.images.faces import box_around, cavity_of, opening_of
from heartgen.images.levelset import INSIDE, signed_distance, smooth_indicator
from heartgen.images.mask import Finding, Mask, planes_along
from heartgen.images.stack import narrow_end

LAYERS = 5
"""Layers, one wall thickness apart, that stand for a slice: its neighbors are out of reach."""

AIR = 2
"""Empty voxels that a signed distance needs around a shape."""

MARGIN = 2
"""Voxels around the wall in which gradients and neighbors are looked for."""

FACING_BASE = float(np.cos(np.radians(45)))
"""Cosine between the normal of the pool and the direction of the base from which it faces the base
more than the side."""

OPENING = 0.15
"""Area, over the pool's mean cross-section, from which a region that faces the base is an opening,
not a dent: a pulmonary valve of 4 cm^2 has a fifth of a right ventricle's 20 cm^2."""

CLOSED = 0.3
"""Opening to a side of the slices, over the pool's largest section in them, below which it is none:
in long-axis slices that of a ventricle 80 mm long and 50 mm wide has 0.6; in 1,080 stacks of
short-axis slices, whole and spoiled, 0.12 at most."""

VALVE = 2.0
"""Distance in mm up to which pool and atrium or artery meet: leaflets are thin and seldom labeled.
"""

ROUNDING = 1e-3
"""Difference between distances, in voxels, that is rounding."""

FACES = ndi.generate_binary_structure(3, 1)
"""Voxels that share a face are neighbors, or..."""

NEIGHBORS = np.ones((3, 3, 3), dtype=bool)
"""...those that share a corner."""


@dataclass(frozen=True, eq=False)
class Parts:
    """The labeled parts of a heart, all (nx, ny, nz) bool.

    Attributes
    ----------
    lv_myocardium, lv_pool, rv_pool : (nx, ny, nz) bool
        Wall of the left ventricle and blood pools.
    rv_openings : (nx, ny, nz) bool
        What the right ventricle opens into: right atrium, pulmonary artery. Empty if unlabeled.
    """

    lv_myocardium: NDArray[np.bool_]
    lv_pool: NDArray[np.bool_]
    rv_pool: NDArray[np.bool_]
    rv_openings: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Place:
    """Where the wall is built.

    `parts` are those in the `box` of the image around the right pool, `distance` that to the pool's
    surface in it, mm. `base` is the direction of the base and `top` the height over the image's
    first voxel to which the wall may rise, mm. In a stack of short-axis slices, which are `stacked`
    towards the base, that is the last slice of either ventricle, and `bottom` is the height of the
    first slice of the heart. If the wall is built slice by slice, `axis` is the index axis of the
    slices and `step` the number of planes between them.
    """

    parts: Parts
    box: tuple[slice, ...]
    spacing: NDArray[np.float64]
    distance: NDArray[np.float32]
    thickness: float
    base: NDArray[np.float64]
    top: float
    bottom: float
    stacked: bool
    axis: int | None
    step: int


def build_rv_wall(
    parts: Parts, affine: NDArray[np.float64], thickness: float
) -> tuple[NDArray[np.bool_], tuple[Finding, ...]]:
    """Put a wall around the right ventricle's blood pool.

    The wall is what lies within `thickness` of the smooth surface of the pool and outside the left
    ventricle. In a stack of slices it is built in the plane of each, for what lies beside a pool in
    the next slice is no wall of this one; below the last slice of the pool it closes it, if it is
    so thick that it reaches the next one. It is open where the pool meets the right atrium and the
    pulmonary artery or, if they are not labeled, where the pool faces the base; then it rises no
    higher than the left ventricle's wall.

    Parameters
    ----------
    parts : Parts
        Of the left ventricle the myocardium at least, and a right pool.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.
    thickness : float
        mm.

    Returns
    -------
    wall : (nx, ny, nz) bool
        At least a voxel thick.
    findings : tuple of Finding
        What was built, and what was left open.
    """
    wall = np.zeros(parts.rv_pool.shape, dtype=bool)
    place = _place(parts, affine, thickness)
    if place is None:
        few = Finding(
            "rv wall",
            f"The right ventricle's blood pool is too thin for a wall ({int(parts.rv_pool.sum())} "
            "voxels): correct its label, or leave it out to read the left ventricle alone.",
            fatal=True,
        )
        return wall, (few,)
    near = place.parts
    room = ~(near.lv_myocardium | near.lv_pool | near.rv_pool | near.rv_openings)
    valves = _valves(place)
    room &= ~(_basal(place, room) if valves is None else valves)
    local = _within(place, room) | _lid(place, room)
    wall[place.box] = local
    unclosed = _lower_end(place, local)
    where = "to the right atrium and the pulmonary artery" if valves is not None else "at the base"
    above = _rise(parts.rv_pool, place.spacing * place.base) - place.top
    if valves is None and above >= place.spacing.max():
        where += (
            f" and without the uppermost {above:.3g} mm, which lie above the left ventricle's wall"
        )
    coarse = float(np.delete(place.spacing, [] if place.axis is None else place.axis).max())
    thin = f", one voxel where voxels are larger ({coarse:.3g} mm)" if coarse > thickness else ""
    built = Finding(
        "rv wall",
        f"The labels have no right ventricular wall: one of {thickness:g} mm{thin} was built "
        f"around its blood pool, open {where}.",
    )
    return wall, (built,) if unclosed is None else (built, unclosed)


def _place(parts: Parts, affine: NDArray[np.float64], thickness: float) -> _Place | None:
    """Look at the heart as a whole, then crop it; None if the pool has no inside."""
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if not parts.lv_pool.any():
        parts = replace(parts, lv_pool=cavity_of(parts.lv_myocardium) & ~parts.rv_pool)
    heart = parts.lv_myocardium | parts.lv_pool | parts.rv_pool
    axis, step = Mask(heart, affine).stack_axis, 1
    if axis is not None:
        planes = planes_along(heart, axis)
        step = int(np.median(np.diff(np.flatnonzero(planes))))
    base = _base(parts, spacing, axis, step)
    stacked = axis is not None and abs(base[axis]) == 1
    top = _rise(parts.lv_myocardium, spacing * base)
    if stacked:
        top = min(top, _rise(parts.rv_pool, spacing * base))
    reach = np.ceil(thickness / spacing).astype(int) + MARGIN
    if axis is not None:
        reach[axis] = step
    box = box_around(parts.rv_pool, reach)
    near = Parts(**{field.name: getattr(parts, field.name)[box] for field in fields(parts)})
    distance = _distance(near.rv_pool, spacing, axis, thickness)
    if distance is None:
        return None
    bottom = -_rise(heart, -spacing * base)
    return _Place(near, box, spacing, distance, thickness, base, top, bottom, stacked, axis, step)


def _base(
    parts: Parts, spacing: NDArray[np.float64], axis: int | None, step: int
) -> NDArray[np.float64]:
    """Direction of the base along the index axes: that of the slices, if they are short-axis ones.

    There the right pool's taper tells more than where the left one opens: a basal slice may be
    filled, and the stack end above the apex.
    """
    pool, wall = parts.lv_pool, parts.lv_myocardium
    if axis is not None and step > 1:
        seen = planes_along(wall | pool, axis)
        pool, wall = (np.compress(seen, voxels, axis) for voxels in (pool, wall))
    opening = opening_of(pool, wall, spacing)
    area = float(np.linalg.norm(opening))
    base = np.asarray(opening / area if area > 0 else opening)
    if axis is None:
        return base
    across = tuple(a for a in range(3) if a != axis)
    section = pool.sum(axis=across).max() * float(np.prod(spacing[list(across)]))
    if abs(base[axis]) <= FACING_BASE and area >= CLOSED * section:
        return base
    sign = -narrow_end(parts.rv_pool.sum(axis=across)) or np.sign(base[axis])
    return np.asarray(sign * np.eye(3)[axis])


def _distance(
    pool: NDArray[np.bool_], spacing: NDArray[np.float64], axis: int | None, thickness: float
) -> NDArray[np.float32] | None:
    """Distance to the smooth surface of a pool, mm, in 3-D or in the plane of each slice."""
    layers = 1 if axis is None else LAYERS
    along = axis or 0
    sizes = spacing.copy()
    if axis is not None:
        sizes[axis] = thickness
    shape = np.pad(np.repeat(pool, layers, axis=along), AIR)
    if smooth_indicator(shape).max() <= INSIDE:
        return None
    values = signed_distance(shape, np.diag([*sizes, 1.0])).values[(slice(AIR, -AIR),) * 3]
    middle = np.arange(layers // 2, values.shape[along], layers)
    return np.take(values, middle, axis=along)


def _valves(place: _Place) -> NDArray[np.bool_] | None:
    """Voxels between the pool and what it opens into; None if it meets nothing of the kind."""
    openings = place.parts.rv_openings
    if not openings.any():
        return None
    # Distances are between centers: of two shapes that share a face, a voxel apart.
    voxel = float(place.spacing.min())
    beyond = inner_distance(~openings, place.spacing)
    if float(beyond[place.parts.rv_pool].min()) - voxel > VALVE:
        return None
    gap = beyond + inner_distance(~place.parts.rv_pool, place.spacing) - voxel
    return np.asarray(gap <= VALVE)


def _basal(place: _Place, room: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels over the opening at the base, of a room."""
    height = _heights(place)
    over = height > place.top
    slope = np.gradient(place.distance, *place.spacing)
    rise = sum(slope[a] * place.base[a] for a in range(3) if a != place.axis)
    pool = place.parts.rv_pool
    facing = room & (place.distance <= place.thickness) & (rise > FACING_BASE)
    regions, _ = ndi.label(facing, NEIGHBORS)
    # Voxels of the shell stand for its thickness, those of the pool for its height.
    share = np.bincount(regions.ravel()) / place.thickness * np.ptp(height[pool]) / pool.sum()
    opening = (regions > 0) & (share >= OPENING)[regions]
    if place.stacked or not opening.any():
        return np.asarray(over | opening)
    # Around its edge the shell is round: what rises above the edge belongs to the lid.
    edge = height - place.distance * rise
    far, nearest = ndi.distance_transform_edt(~opening, place.spacing, return_indices=True)
    lip = (far <= 2 * place.thickness) & (height > edge[tuple(nearest)])
    return np.asarray(over | opening | lip)


def _within(place: _Place, room: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The voxels of a room that share a face with the pool, and those within the wall's thickness.

    Of the latter as many as the volume of the wall asks for: all of them would be too many or too
    few where the pool's surface runs along the grid, by up to half a voxel. Voxels of the same
    distance are taken together.
    """
    faces = FACES.copy()
    if place.axis is not None:
        faces &= np.indices(faces.shape)[place.axis] == 1
    beside = room & ndi.binary_dilation(place.parts.rv_pool, faces)
    further = room & ~beside
    voxel = float(place.spacing.min())
    rank = np.round(place.distance / (ROUNDING * voxel))
    levels, counts = np.unique(rank[further], return_counts=True)
    share = np.clip(1 / 2 + (place.thickness - place.distance[further]) / voxel, 0, 1)
    filled = np.concatenate([[0], np.cumsum(counts)])  # by the first 0, 1, 2 ... levels
    n = int(np.abs(filled - share.sum()).argmin())
    return np.asarray(beside | (further & (rank <= levels[n - 1])) if n else beside)


def _lid(place: _Place, room: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Voxels of a room below a pool that ends within a stack, if the wall reaches so far.

    Where the stack ends with the pool there is none: in a slice below it, which shows nothing, it
    would tell that the left ventricle has ended.
    """
    lid = np.zeros_like(room)
    if place.axis is None or not place.stacked or place.step > 1:
        return lid
    if place.spacing[place.axis] / 2 > place.thickness:  # half of the way is the pool's
        return lid
    distance = _distance(place.parts.rv_pool, place.spacing, None, place.thickness)
    if distance is None:
        return lid
    pool = np.moveaxis(place.parts.rv_pool, place.axis, 0)
    up = int(place.base[place.axis])
    last = int(np.flatnonzero(pool.any(axis=(1, 2)))[::up][0])
    below = np.moveaxis(lid, place.axis, 0)
    below[(slice(None, last) if up > 0 else slice(last + 1, None))] = True
    lid &= _heights(place) > place.bottom - place.spacing[place.axis] / 2
    return _within(replace(place, axis=None, distance=distance), room) & lid


def _lower_end(place: _Place, wall: NDArray[np.bool_]) -> Finding | None:
    """Tell that the last slice of the pool in a stack has no wall below it."""
    if place.axis is None or not place.stacked:
        return None
    pool = np.moveaxis(place.parts.rv_pool, place.axis, 0)
    solid = np.moveaxis(wall | place.parts.lv_myocardium, place.axis, 0)
    up = int(place.base[place.axis])
    last = int(np.flatnonzero(pool.any(axis=(1, 2)))[::up][0])
    under = last - up * place.step
    slices = np.moveaxis(_heights(place), place.axis, 0)[:, 0, 0]
    lowest = bool(slices[last] < place.bottom + place.spacing[place.axis] / 2)
    ends = lowest or not 0 <= under < len(pool)
    bare = int((pool[last] if ends else pool[last] & ~solid[under]).sum())
    if bare == 0:
        return None
    area = bare * float(np.prod(np.delete(place.spacing, place.axis)))
    reason = "the stack ends" if ends else "the wall does not reach the next slice"
    return Finding(
        "rv wall",
        f"The right ventricle is left open at its lower end, over {area:.0f} mm², because {reason} "
        "there: to close it, label its wall.",
    )


def _rise(voxels: NDArray[np.bool_], step: NDArray[np.float64]) -> float:
    """Height of a shape's highest voxel, mm."""
    return float((np.argwhere(voxels) @ step).max())


def _heights(place: _Place) -> NDArray[np.float64]:
    """Height of the box's voxels over the image's first voxel, towards the base, mm."""
    starts = [side.start for side in place.box]
    steps = place.spacing * place.base
    shape = place.distance.shape
    x, y, z = (
        (start + np.arange(n)) * step for start, n, step in zip(starts, shape, steps, strict=True)
    )
    return np.asarray(x[:, None, None] + y[:, None] + z)
