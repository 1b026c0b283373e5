"""A phantom of both ventricles: a thick left cup and a thin crescent on its side."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import lru_cache, partial
from typing import Any, Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from heartgen.errors import InputError
from heartgen.samples.biv_shape import BivShape, in_wall, right_apex
from heartgen.samples.placement import Placement
from heartgen.samples.sample import Sample, make_sample
from heartgen.samples.solid import Solid

BASE_LEVEL = 0.25
"""Height of the base above the left ventricle's widest level, share of its length."""

# The right ellipsoid, in outer radii of the left ventricle with its septum. A normal adult right
# ventricle is 25 to 41 mm wide at its base, its free wall 1 to 5 mm thick (Lang et al. 2015, JASE
# 28:1-39); its insertions lie about 65 degrees to both sides.
RIGHT_CENTER = 0.72
"""Distance of its axis from the long axis."""

RIGHT_REACH, RIGHT_BREADTH = 1.08, 0.97
"""Semi-axes away from the left ventricle and along the septum."""

RIGHT_LEVEL = 0.1
"""Height of its center above the left ventricle's widest level, share of the length."""

RIGHT_LEAN = float(np.radians(-14.0))
"""Turn that brings the right apex to the left one, rad."""

RIGHT_SKEW = float(np.radians(12.0))
"""Turn about the vertical, rad: one insertion lies further from the middle than the other."""

TILT_TOWARDS = np.radians(-120.0)
"""Direction about the long axis in which a tilted base rises, rad (the right side is at 180)."""

STEEPEST = 25.0
"""Largest tilt of the base, degrees: beyond it a base no longer cuts both ventricles."""

LONGEST = 2.0
"""Longest semi-axis of the right ellipsoid that is tried, in those of the left one."""

GROWTH = 1.04
"""Factor by which the right ellipsoid grows while its apex is sought."""

SHAPES = 8
"""Hearts kept, with their surfaces: the same one is often asked for in another pose."""

CLOSE = 1e-6
"""Tolerance of the right apex' level, mm."""


@dataclass(frozen=True)
class BivSizes:
    """Sizes of a phantom of both ventricles.

    Attributes
    ----------
    rv_size : float
        Width of the right ventricle against a normal one beside this left ventricle.
    rv_wall, lv_wall, septum : float, mm
        Thickness of the right free wall, of the left free wall and of the septum, everywhere.
    radius : float, mm
        Of the left endocardium at its widest level.
    length : float, mm
        From the left endocardial apex to the base along the long axis.
    """

    rv_size: float = 1.0
    rv_wall: float = 3.0
    lv_wall: float = 10.0
    septum: float = 10.0
    radius: float = 22.0
    length: float = 80.0

    def __post_init__(self) -> None:
        for name, size in vars(self).items():
            if not (np.isfinite(size) and size > 0):
                raise InputError(
                    f"The {name} of a biventricular phantom must be positive, not {size}."
                )


class BivChoices(Placement, total=False):
    """What `biv` takes by keyword: the sizes of `BivSizes`, and a `Placement`."""

    rv_size: float
    rv_wall: float
    lv_wall: float
    septum: float
    radius: float
    length: float


def biv(
    spacing: ArrayLike = 1.0,
    *,
    tilt: float = 0.0,
    rv_apex: float = 12.0,
    **choices: Unpack[BivChoices],
) -> Sample:
    """Make both ventricles of a heart, open at a common flat base.

    Parameters
    ----------
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    tilt : float, degrees
        Angle between the base and the plane across the long axis.
    rv_apex : float, mm
        Height of the right endocardial apex above the left one.
    **choices : BivChoices
        Sizes, such as ``rv_wall``, ``lv_wall`` and ``septum``, see `BivSizes`; and rotation,
        translation, scale, image axes and noise, see `Placement`.

    Returns
    -------
    Sample
        Its truth has an ``rv``.

    Raises
    ------
    InputError
        If a size, the placement or the grid makes no heart.

    Examples
    --------
    >>> from heartgen import samples
    >>> heart = samples.biv(6.0)
    >>> heart.mask.voxels.shape, heart.truth.rv is not None
    ((25, 20, 24), True)
    """
    known = {each.name for each in fields(BivSizes)}
    sizes = BivSizes(**{name: value for name, value in choices.items() if name in known})  # type: ignore[arg-type]
    placement: Any = {name: value for name, value in choices.items() if name not in known}
    length = sizes.length
    if not abs(tilt) <= STEEPEST:
        raise InputError(
            f"The tilt must lie between -{STEEPEST:g} and {STEEPEST:g} degrees, not {tilt}."
        )
    shape = _with_right_apex(
        BivShape(
            lv=Solid((sizes.radius, sizes.radius, (1 - BASE_LEVEL) * length)),
            rv=_right_solid(sizes.rv_size * (sizes.radius + sizes.septum), length),
            lv_wall=sizes.lv_wall,
            septum=sizes.septum,
            rv_wall=sizes.rv_wall,
            base_height=BASE_LEVEL * length,
            base_slope=(
                float(np.tan(np.radians(tilt)) * np.cos(TILT_TOWARDS)),
                float(np.tan(np.radians(tilt)) * np.sin(TILT_TOWARDS)),
            ),
        ),
        rv_apex,
    )
    text = "Thick left cup and thin right crescent, open at a common flat base."
    return make_sample(
        shape, partial(in_wall, shape), spacing, "both ventricles", text, **placement
    )


def _right_solid(unit: float, length: float) -> Solid:
    """Ellipsoid of a right ventricle; its height is still to be found."""
    return Solid(
        semi=(RIGHT_REACH * unit, RIGHT_BREADTH * unit, length),
        center=(-RIGHT_CENTER * unit, 0.0, RIGHT_LEVEL * length),
        lean=RIGHT_LEAN,
        skew=RIGHT_SKEW,
    )


@lru_cache(maxsize=SHAPES)
def _with_right_apex(shape: BivShape, height: float) -> BivShape:
    """Lengthen the right ventricle until its apex lies at a height, mm, above the left one."""
    down = shape.rv.axes[2]
    level = float(shape.apex[2]) + height
    across = np.asarray(shape.rv.semi[:2]) * down[:2]
    square = (shape.rv.center[2] - level) ** 2 - across @ across
    if not (np.isfinite(height) and height > 0 and level < shape.rv.center[2] and square > 0):
        raise _no_apex(shape, height)

    def lengthened(semi: float) -> BivShape:
        return replace(shape, rv=replace(shape.rv, semi=(*shape.rv.semi[:2], semi)))

    def miss(semi: float) -> float:
        return float(right_apex(lengthened(semi))[2]) - level

    # The ellipsoid's own bottom would be the apex if the septum did not raise it.
    low = high = float(np.sqrt(square) / down[2])
    while miss(high) > CLOSE:
        low, high = high, high * GROWTH
        if high > LONGEST * shape.lv.semi[2]:
            raise _no_apex(shape, height)
    if high == low:
        return lengthened(low)
    return lengthened(float(brentq(miss, low, high, xtol=CLOSE)))


def _no_apex(shape: BivShape, height: float) -> InputError:
    """What to say about a right apex that no right ventricle has."""
    length = shape.base_height - float(shape.apex[2])
    return InputError(
        f"The rv_apex must lie between the left apex and the middle of the heart, not {height} mm "
        f"above the left apex; choose about {length / 5:.0f} mm."
    )
