"""Phantoms of the left ventricle: an ideal cup, and one with all that makes hearts difficult."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.errors import InputError
from heartgen.samples.lv_shape import (
    Ellipsoid,
    Lobe,
    LvShape,
    below_base,
    depth,
    straighten,
    wall_point,
)
from heartgen.samples.placement import Placement
from heartgen.samples.sample import Sample, make_sample

Array = NDArray[np.float64]

# Sizes of a normal adult left ventricle at end diastole (Lang et al. 2015, JASE 28:1-39): internal
# diameter 42-58 mm, wall 6-10 mm; about 80-90 mm from base to apex in long-axis views.
LIFELIKE = LvShape(
    endo=Ellipsoid(22.0, 60.0, (0.8, 0.3), (Lobe(2, 0.07, 0.4), Lobe(3, 0.035, 1.2))),
    epi=Ellipsoid(32.0, 65.0, (0.0, 0.0), (Lobe(2, 0.05, 0.5), Lobe(3, 0.025, 1.1))),
    base_height=20.0,
    base_slope=(0.12, -0.07),
    bend=(5.0, -3.0),
)
"""Oval, slightly triangular sections, 10 mm of wall at the base and 5 mm at the apex, a base tilted
by 8 degrees, an apex 6 mm off the straight axis."""

VALVES = (Lobe(2, 4.0, 0.3), Lobe(3, 2.4, 1.0))
"""Rim of a base cut along valves: up to 6 mm above and below its plane."""

PAPILLARY_ANGLES = (0.9, 2.7)
"""Circumferential positions of the two papillary muscles, rad (about 100 degrees apart)."""

PAPILLARY_ROOT, PAPILLARY_TIP = -40.0, -6.0
"""Heights at which a papillary muscle leaves the wall and ends, mm, heart frame."""

PAPILLARY_AXIS = 0.48
"""Distance of a papillary tip from the long axis, share of the endocardial radius there."""

PAPILLARY_RADIUS = 4.0
"""Radius of a papillary muscle, mm (7 to 10 mm thick in adults)."""

TRABECULAE = 13
"""Ridges around the apical endocardium, 4 to 8 mm apart."""

TRABECULAR_HEIGHT = 3.0
"""Height of the ridges, mm."""

TRABECULAR_TWIST = 1.5
"""Turn of the ridges around the axis, rad per rad from the apex: they spiral."""

TRABECULAR_RANGE = (0.25, 1.25)
"""Angle from the apex over which ridges stand, rad: from beside the apex to the mid level."""


def ideal_cup(
    spacing: ArrayLike = 1.0,
    *,
    radius: float = 22.0,
    length: float = 60.0,
    wall: float = 10.0,
    base_height: float = 20.0,
    **placement: Unpack[Placement],
) -> Sample:
    """Make a truncated ellipsoidal shell.

    Parameters
    ----------
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    radius, length : float, mm
        Semi-axes of the endocardium, across and along the long axis.
    wall : float, mm
        Added to both semi-axes for the epicardium.
    base_height : float, mm
        Height of the basal plane above the widest level.
    **placement : Placement
        Rotation, translation, scale, image axes and noise: see `Placement`.

    Returns
    -------
    Sample

    Raises
    ------
    InputError
        If a size, the placement or the grid makes no heart.

    Examples
    --------
    >>> from heartgen import samples
    >>> cup = samples.ideal_cup((4.0, 4.0, 8.0), radius=25.0)
    >>> cup.mask.spacing.tolist()
    [4.0, 4.0, 8.0]
    >>> round(cup.truth.cavity_volume / 1000)  # ml
    116
    """
    if not (min(radius, length, wall) > 0 and abs(base_height) < length):
        raise InputError(
            "An ideal cup needs a positive radius, length and wall, and a base_height between "
            f"-length and length; it got {radius}, {length}, {wall} and {base_height} mm."
        )
    shape = LvShape(
        endo=Ellipsoid(radius, length),
        epi=Ellipsoid(radius + wall, length + wall),
        base_height=base_height,
    )
    text = "Truncated ellipsoidal shell with a flat base."
    return make_sample(shape, partial(in_wall, shape), spacing, "ideal cup", text, **placement)


def lifelike_lv(
    spacing: ArrayLike = 1.0,
    *,
    papillary: bool = False,
    trabeculae: bool = False,
    valves: bool = False,
    **placement: Unpack[Placement],
) -> Sample:
    """Make a left ventricle with an oval, bent, tapering wall and a tilted base.

    Parameters
    ----------
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    papillary : bool
        Add two papillary muscles: free columns above, merged into the wall below.
    trabeculae : bool
        Add ridges to the apical endocardium.
    valves : bool
        Let the rim rise and fall by up to 6 mm, so that the base needs truncation.
    **placement : Placement
        Rotation, translation, scale, image axes and noise: see `Placement`.

    Returns
    -------
    Sample
        Its truth has the rim of the valves, but no muscles, trabeculae or noise.

    Raises
    ------
    InputError
        If the noise is not a probability, or the placement or the grid makes no heart.

    Examples
    --------
    >>> from heartgen import samples
    >>> plain = samples.lifelike_lv(4.0)
    >>> muscled = samples.lifelike_lv(4.0, papillary=True)
    >>> bool(muscled.mask.voxels.sum() > plain.mask.voxels.sum())
    True
    >>> muscled.truth.wall_volume == plain.truth.wall_volume
    True
    """
    shape = replace(LIFELIKE, base_waves=VALVES) if valves else LIFELIKE

    def inside(points: Array) -> NDArray[np.bool_]:
        tissue = in_wall(shape, points)
        if papillary:
            tissue |= _papillary(shape, points)
        if trabeculae:
            tissue |= _trabeculae(shape, points)
        return tissue

    extras = {
        "papillary muscles": papillary,
        "trabeculae": trabeculae,
        "an irregular rim": valves,
        "voxel noise": placement.get("noise", 0.0) > 0,
    }
    plus = " and ".join(name for name, present in extras.items() if present)
    text = "Oval, bent left ventricle with a tapering wall and a tilted base"
    text = f"{text}, with {plus}." if plus else f"{text}."
    return make_sample(shape, inside, spacing, "lifelike left ventricle", text, **placement)


def in_wall(shape: LvShape, points: Array) -> NDArray[np.bool_]:
    """Which points lie in the smooth wall.

    Parameters
    ----------
    shape : LvShape
        The ventricle.
    points : (n, 3) float64
        mm, heart frame.

    Returns
    -------
    (n,) bool
    """
    straight = straighten(shape, points)
    outside_cavity = depth(shape.endo, straight)[0] <= 0
    return np.asarray(
        below_base(shape, straight) & outside_cavity & (depth(shape.epi, straight)[0] > 0)
    )


def _papillary(shape: LvShape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, heart frame, lie in a papillary muscle, rooted in the wall, (n,)."""
    straight = straighten(shape, points)
    near = np.zeros(len(points), dtype=np.bool_)
    for angle in PAPILLARY_ANGLES:
        root, tip = (_endo_point(shape, z, angle) for z in (PAPILLARY_ROOT, PAPILLARY_TIP))
        center = np.array([*shape.endo.center, PAPILLARY_TIP])
        axis = center + PAPILLARY_AXIS * (tip - center) - root
        along = np.clip((straight - root) @ axis / (axis @ axis), 0, 1)
        near |= np.linalg.norm(straight - root - along[:, None] * axis, axis=1) < PAPILLARY_RADIUS
    return near


def _trabeculae(shape: LvShape, points: Array) -> NDArray[np.bool_]:
    """Which points (n, 3), mm, heart frame, lie in a ridge on the apical endocardium, (n,)."""
    gap, polar, angle = depth(shape.endo, straighten(shape, points))
    start, end = TRABECULAR_RANGE
    window = np.sin(np.pi * np.clip((polar - start) / (end - start), 0, 1))
    ridge = np.maximum(np.cos(TRABECULAE * (angle + TRABECULAR_TWIST * polar)), 0)
    return np.asarray((gap > 0) & (gap < TRABECULAR_HEIGHT * window * ridge))


def _endo_point(shape: LvShape, height: float, angle: float) -> Array:
    """Point (3,), mm, straight frame, of the endocardium at a height and angle."""
    polar = np.arccos(-height / shape.endo.length)
    return np.asarray(wall_point(shape.endo, polar * np.array([[np.cos(angle), np.sin(angle)]]))[0])
