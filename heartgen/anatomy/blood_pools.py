"""Which blood pools there are: one of a left ventricle, or two and which of them is the left."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.anatomy.base import fit_plane
from heartgen.anatomy.cavity import (
    CONNECTED,
    EXPOSED,
    Cavity,
    Space,
    core_radius,
    deepest_residue,
    exposure,
    find_cavity,
    greatest,
    without_channels,
)
from heartgen.anatomy.hull import convex_hull
from heartgen.errors import AnatomyError
from heartgen.images.distance import inner_distance

VENTRICLES = ("auto", "lv", "biv")
"""What a mask may be said to show."""

SOLID = 0.28
"""Radius of the largest ball in a mask, over the cube root of its volume, from which it is no wall
but a filled body. Walls of 50 hearts had 0.10 to 0.20, those of 12 hypertrophic ones at end systole
0.20 to 0.25; blood pools and atria have 0.27 to 0.45."""

MIN_DEPTH = 2.0
"""Least inner radius of a pool, in voxels."""

RIVAL = 0.4
"""Inner radius over the largest pool's from which a second enclosed pool is a ventricle..."""

RIVAL_VOLUME = 0.1
"""...and volume over the largest pool's from which a narrower one is: a thin crescent."""

SECOND_OPENING = 0.9
"""Size over the opening's from which a further opening is the other end of a tube."""

CREST_LEVELS = np.linspace(0.025, 0.4, 16)
"""Depths below the opening, over the length of the pool, at which the crest of the septum is looked
for: two pools may be joined over it."""

NECK = 0.4
"""Inner radius over the largest pool's below which a passage joins two pools..."""

LOBE = 0.5
"""...where both have at least this inner radius over the largest pool's; else it is one pool."""


@dataclass(frozen=True)
class BloodPools:
    """The blood pools of a heart.

    Attributes
    ----------
    left : Cavity
        The left ventricle's.
    right : Cavity or None
        None if the mask shows a left ventricle alone.
    """

    left: Cavity
    right: Cavity | None

    def __iter__(self) -> Iterator[Cavity]:
        """The left pool, then the right one if there is one."""
        return iter([self.left] if self.right is None else [self.left, self.right])

    @property
    def blood(self) -> NDArray[np.bool_]:
        """All pools together, (nx, ny, nz) bool."""
        return np.asarray(np.any([cavity.pool for cavity in self], axis=0))

    def below(self, under: NDArray[np.bool_], spacing: NDArray[np.float64]) -> BloodPools:
        """Return the pools without what reaches below the base from above it, outside the wall.

        Valves and vessels that rise above the base enclose, with the hull, grooves between them
        and the ventricles; below the base these are cut off from the pool.

        Parameters
        ----------
        under : (nx, ny, nz) bool
            Voxels below the base.
        spacing : (3,) float64
            Voxel size, mm.
        """
        kept = []
        for cavity in self:
            inside = without_channels(cavity.pool & under, spacing)
            kept.append(replace(cavity, pool=inside | (cavity.pool & ~under)))
        return replace(self, left=kept[0], right=kept[1] if len(kept) > 1 else None)


def find_pools(
    voxels: NDArray[np.bool_], spacing: NDArray[np.float64], ventricles: str = "auto"
) -> BloodPools:
    """Find the blood pool of a left ventricle, or of both ventricles.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        Myocardium, with at least one empty voxel on every side.
    spacing : (3,) float64
        Voxel size, mm.
    ventricles : {"auto", "lv", "biv"}
        What the mask must show.

    Returns
    -------
    BloodPools

    Raises
    ------
    AnatomyError
        If there is no cavity, no opening, more than two pools, or not what `ventricles` asks for.
    """
    if ventricles not in VENTRICLES:
        raise AnatomyError(f"ventricles {ventricles!r} are not known: choose auto, lv or biv")
    _refuse_solid(voxels, spacing)
    hull = convex_hull(voxels)
    empty = hull & ~voxels
    space = Space(voxels, empty, hull, inner_distance(empty, spacing), spacing)
    if space.depth.max() < MIN_DEPTH * float(np.min(spacing)):
        raise AnatomyError(
            "no cavity found: the mask fills its convex hull; give a mask of the myocardium "
            "without the blood pool"
        )
    seeds = _separate(space)
    single = find_cavity(space, empty, "left") if len(seeds) == 1 else None
    joined = [] if single is None else _joined_over_crest(space, single)
    if single is None or joined:
        if ventricles == "lv":
            raise AnatomyError(
                "two blood pools found where a left ventricle has one: the mask is biventricular; "
                "analyze both ventricles, or give a mask of the left ventricle alone"
            )
        return _both(space, joined or seeds)
    if ventricles == "biv":
        raise AnatomyError(
            "one blood pool found where a biventricular heart has two: the mask shows a left "
            "ventricle alone, or a right ventricle that is not enclosed by its wall"
        )
    _refuse_tube(single)
    return BloodPools(single, None)


def _separate(space: Space) -> list[NDArray[np.bool_]]:
    """The deepest part of the hull's residue, and others that are enclosed and large enough."""
    found = [deepest_residue(space, space.empty)]
    deepest = float(space.depth.max())
    least = core_radius(space, space.empty)
    rest = space.empty & ~found[0]
    while rest.any() and (radius := float(space.depth[rest].max())) > least:
        part = deepest_residue(space, rest)
        rest &= ~part
        exposed = exposure(part.astype(np.int8), space.hull, np.array([1]))[0] >= EXPOSED
        large = radius > RIVAL * deepest or part.sum() > RIVAL_VOLUME * found[0].sum()
        if large and not exposed:
            found.append(part)
    if len(found) > 2:
        raise AnatomyError(
            f"{len(found)} blood pools found where a heart has one or two ventricles: give a mask "
            "of the ventricles alone, without atria and vessels"
        )
    return found


def _joined_over_crest(space: Space, single: Cavity) -> list[NDArray[np.bool_]]:
    """Cores of two pools that are one above the crest of the septum; none if there is one pool."""
    pool = np.argwhere(single.pool) * space.spacing
    plane = fit_plane(single.opening * space.spacing, pool.mean(0), float(np.min(space.spacing)))
    height = plane.height(pool)
    deep = space.depth[single.pool] > core_radius(space, space.empty)
    found: list[NDArray[np.bool_]] = []
    for level in CREST_LEVELS[::-1] * height.min():
        below = np.zeros_like(single.pool)
        below[single.pool] = deep & (height < level)
        parts = _large(space, below, RIVAL)
        if len(parts) != 2:
            break
        found = parts
    if not found and len(_large(space, space.depth > NECK * space.depth.max(), LOBE)) > 1:
        raise AnatomyError(
            "one blood pool with two lobes found: the ventricles are joined by a hole in the "
            "septum or by gaps between slices; close them in the mask"
        )
    return found


def _large(space: Space, core: NDArray[np.bool_], least: float) -> list[NDArray[np.bool_]]:
    """Connected parts of a pool's core whose inner radius over the largest exceeds `least`."""
    parts, count = ndi.label(core, structure=CONNECTED)
    enough = greatest(space.depth, parts, count) > least * space.depth.max()
    return [parts == n + 1 for n in np.flatnonzero(enough)]


def _both(space: Space, seeds: list[NDArray[np.bool_]]) -> BloodPools:
    """Cavities of the two ventricles; the left one has the thicker wall."""
    away = [inner_distance(~seed, space.spacing) for seed in seeds]
    nearer = away[0] <= away[1]
    first, second = _thicker_first(space, seeds, away)
    found = {
        first: find_cavity(space, space.empty & nearer, first),
        second: find_cavity(space, space.empty & ~nearer, second),
    }
    left, right = found["left"], found["right"]
    _refuse_tube(left)
    return BloodPools(left, right)


def _thicker_first(
    space: Space, seeds: list[NDArray[np.bool_]], away: list[NDArray[np.float32]]
) -> tuple[str, str]:
    """Names of the two ventricles: the left one has the thicker free wall."""
    outside = inner_distance(space.wall | seeds[0] | seeds[1], space.spacing)
    thickness = []
    for own, other in (away, away[::-1]):
        free = space.wall & (own < other) & (outside < other)
        thickness.append(float(np.median((own + outside)[free])) if free.any() else 0.0)
    return ("left", "right") if thickness[0] >= thickness[1] else ("right", "left")


def _refuse_tube(left: Cavity) -> None:
    """Raise if a left ventricle is open at both ends."""
    if max((leak.size for leak in left.leaks), default=0) > SECOND_OPENING * len(left.opening):
        raise AnatomyError(
            "the cavity is open at both ends: a left ventricle is open at the base and closed at "
            "the apex; check that the mask reaches the apex"
        )


def _refuse_solid(voxels: NDArray[np.bool_], spacing: NDArray[np.float64]) -> None:
    """Raise if a mask is a filled body."""
    radius = float(inner_distance(voxels, spacing).max())
    if radius > SOLID * np.cbrt(voxels.sum() * np.prod(spacing)):
        raise AnatomyError(
            f"no cavity found: the mask is a filled body, {2 * radius:.3g} mm thick, and no wall; "
            "it shows blood pools, atria or a whole heart as one: give a mask of the ventricles' "
            "myocardium without the blood pool"
        )
