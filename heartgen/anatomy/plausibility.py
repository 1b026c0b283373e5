"""Is it a heart: proportions that no left ventricle has, of whatever species."""

from __future__ import annotations

from dataclasses import dataclass

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
