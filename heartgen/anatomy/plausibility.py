"""Is it a heart: proportions that no left ventricle has, of whatever species."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.images.mask import Finding


@dataclass(frozen=True)
class Proportion:
    """A ratio of sizes, and what is wrong with it.

    Attributes
    ----------
    low, high : float
        Bounds of what a heart may have.
    small, large : str
        What a mask below and above them shows, and what to do.
    """

    low: float
    high: float
    small: str
    large: str


SPACING = "check the distance between slices in the image's header"
WALL = "check that the mask is the whole myocardium, and not its outline or the pool"

LENGTH = Proportion(
    1.0,
    4.5,
    f"is too short for its width: {SPACING}",
    f"is too long for its width: {SPACING}",
)
"""Of the left pool over the outer radius of the wall: 1.35 to 3.15 in 160 hearts, man and rabbit,
of which half at end systole."""

THICKNESS = Proportion(
    0.115,
    3.0,
    f"has too thin a wall, as a right one has: {WALL}",
    f"has too thick a wall: {WALL}",
)
"""Of the wall over the pool's radius: 0.149 to 1.97 in the same and 50 others, many of them dilated
or infarcted; walls of four right ventricles alone have 0.08 to 0.13."""

CAVITY = Proportion(
    0.02,
    3.5,
    f"has too small a cavity for its wall: {WALL}",
    f"has too large a cavity for its wall: {WALL}",
)
"""Volume of the left pool over that of the wall: 0.09 to 2.52 in the same."""

LEAST_ROUND = 0.85
"""Roundness of the pool of a left ventricle alone, at least: 0.96 to 1.02 in 120 dense masks, 0.88
to 1.04 in the left pools of 160 stacks; pools of right ventricles have 0.5 to 0.83, but for one
that was round (0.91). The collapsed left pool of a rabbit's heart that was fixed has 0.78, beside
its right one."""

SLAB = 2
"""Voxels: thickness of the cross-sections whose roundness counts."""

LEAST_SECTION = 40
"""Voxels of a cross-section that has a roundness, at least: a disc seven pixels wide, twice."""


def check_proportions(
    length: float, radius: float, thickness: float, ratio: float
) -> list[Finding]:
    """Tell what of a left ventricle's proportions no heart has.

    Parameters
    ----------
    length, radius, thickness : float
        Of the pool, and of its wall, mm.
    ratio : float
        Volume of the pool over that of the wall.

    Returns
    -------
    list of Finding
    """
    sizes = f"({length:.3g} mm long, {2 * radius:.3g} mm wide, wall {thickness:.2g} mm)"
    found = []
    for value, bound in (
        (length / (radius + thickness), LENGTH),
        (thickness / radius, THICKNESS),
        (ratio, CAVITY),
    ):
        if not bound.low <= value <= bound.high:
            wrong = bound.small if value < bound.low else bound.large
            told = f"the left ventricle {sizes} {wrong}"
            found.append(Finding("proportions", told, serious=True))
    return found


def roundness(pool: NDArray[np.float64], axis: NDArray[np.float64], voxel: float) -> float:
    """Area of a pool's cross-sections over that of the discs of their second moments.

    Parameters
    ----------
    pool : (n, 3) float64
        Centers of the pool's voxels, mm.
    axis : (3,) float64
        Unit vector across the sections.
    voxel : float
        Edge of the voxels, mm.

    Returns
    -------
    float
        Average by area; 1 is an ellipse that is nearly a circle, a crescent has less. 1 if there is
        no cross-section large enough.
    """
    across = np.linalg.svd(axis[None])[2][1:]
    height, flat = pool @ axis, pool @ across.T
    # A quarter of a section off the lowest voxels, so that no layer of them is cut in two.
    section = ((height - height.min()) / (SLAB * voxel) + 0.25).astype(int)
    count = np.bincount(section)
    wide = count >= LEAST_SECTION
    if not wide.any():
        return 1.0
    moments = [np.bincount(section, x)[wide] / count[wide] for x in (*flat.T, *flat.T**2)]
    spread = moments[2] + moments[3] - moments[0] ** 2 - moments[1] ** 2
    area = count[wide] * voxel**2 / SLAB
    return float(np.average(area / (2 * np.pi * spread), weights=area))


def check_roundness(
    pool: NDArray[np.float64], axis: NDArray[np.float64], voxel: float
) -> list[Finding]:
    """Tell of a left pool that is a crescent, as a right one is.

    Parameters
    ----------
    pool : (n, 3) float64
        Centers of the left pool's voxels, mm.
    axis : (3,) float64
        Long axis, a unit vector.
    voxel : float
        Edge of the voxels, mm.

    Returns
    -------
    list of Finding
    """
    found = roundness(pool, axis, voxel)
    if found >= LEAST_ROUND:
        return []
    return [
        Finding(
            "proportions",
            f"the left ventricle's pool is a crescent (roundness {found:.2f}, where left ones have "
            f"{LEAST_ROUND:g} and more), as a right one is: check that the mask is of the left "
            "ventricle",
            serious=True,
        )
    ]
