"""Rule-based fibers: their direction turns from endo- to epicardium by a rule of the depth.

The frame of the wall comes from the local coordinates directly; no equation is solved. In the left
ventricle the helix angle, from the circumferential towards the longitudinal direction, is linear in
the depth (Streeter et al. 1969; Land et al. 2015, problem 3, has +90 to -90 degrees).
"""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import InputError
from heartgen.fields.frames import wall_frames
from heartgen.fields.wall import Wall, wall_of
from heartgen.mesh.hexmesh import HexMesh

Array = NDArray[np.float64]

Pair = tuple[float, float]

MOST = 180.0
"""Largest angle, degrees."""


WORDS = {
    "helix": "helix",
    "right": "right_helix",
    "transverse": "transverse",
    "sheet": "sheet",
}
"""Words for the angles of a rule."""


@dataclass(frozen=True)
class FiberRule:
    """Angles at endo- and epicardium, degrees; between these they are linear in the depth.

    Attributes
    ----------
    helix : (float, float)
        In the left ventricle, from the circumferential direction (counter-clockwise seen from the
        base) towards the base.
    right_helix : (float, float)
        In the right ventricle, likewise. Its endocardial angle holds on both sides of the cavity:
        in the septum the helix angle turns from that of the left endocardium to its negative, for
        the circumferential direction of the one ventricle is opposite to that of the other. The
        default is that of Piersanti et al. (2021, doi:10.1016/j.cma.2020.113468).
    transverse : (float, float)
        Of the fiber out of the sheet of equal depth, towards the epicardium.
    sheet : (float, float)
        Of the sheet direction about the fiber, from the transmural direction.

    Examples
    --------
    >>> from heartgen.fields import FiberRule
    >>> FiberRule().helix
    (60.0, -60.0)
    >>> FiberRule(helix=(83, -37), sheet=(-65, 25)).sheet
    (-65, 25)
    """

    helix: Pair = (60.0, -60.0)
    right_helix: Pair = (90.0, -25.0)
    transverse: Pair = (0.0, 0.0)
    sheet: Pair = (0.0, 0.0)

    def __post_init__(self) -> None:
        for angle in fields(self):
            pair = getattr(self, angle.name)
            if len(pair) != 2 or not all(abs(float(a)) <= MOST for a in pair):
                raise InputError(
                    f"{angle.name.replace('_', ' ')} angles {pair} are not two angles: give those "
                    f"at endo- and epicardium, -{MOST:g} to {MOST:g} degrees, for example "
                    f"{angle.default}"
                )


def rule_from_text(text: str) -> FiberRule:
    """Read a rule such as ``helix=60/-60,right=90/-25,transverse=0/0,sheet=-65/25``.

    Parameters
    ----------
    text : str
        Any of these; angles at endo- and epicardium, degrees. The others are those of
        ``FiberRule()``.

    Returns
    -------
    FiberRule

    Raises
    ------
    InputError
        If it cannot be read.

    Examples
    --------
    >>> from heartgen.fields import rule_from_text
    >>> rule_from_text("helix=83/-37").helix
    (83.0, -37.0)
    """
    angles: dict[str, Pair] = {}
    for part in text.split(","):
        name, _, pair = part.strip().partition("=")
        try:
            endo, epi = map(float, pair.split("/"))
            angles[WORDS[name]] = endo, epi
        except (KeyError, ValueError):
            raise InputError(
                f"fiber angles {part.strip()!r} cannot be read: give {', '.join(WORDS)}, each with "
                "its angles at endo- and epicardium, for example helix=60/-60,right=90/-25"
            ) from None
    return FiberRule(**angles)


def fiber_frames(mesh: HexMesh, rule: FiberRule | None = None) -> Array:
    """Fiber, sheet and sheet-normal directions at the Lagrange nodes of each element.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    rule : FiberRule, optional
        ``FiberRule()`` if omitted.

    Returns
    -------
    (e, 64, 3, 3) float64
        Columns: along the fiber, in its sheet across it, normal to the sheet; orthonormal,
        right-handed. Continuous but for the pole, where the circumferential directions meet.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import fiber_frames
    >>> frames = fiber_frames(mesh)
    >>> frames.shape
    (72, 64, 3, 3)
    >>> bool(np.allclose(frames.swapaxes(-1, -2) @ frames, np.eye(3)))
    True
    """
    rule = rule or FiberRule()
    wall = wall_of(mesh)
    return np.asarray(wall_frames(mesh) @ _rotation(rule, wall))


def helix_angle(wall: Wall, rule: FiberRule) -> Array:
    """Helix angle (e, 64), degrees, at the Lagrange nodes of each element.

    Parameters
    ----------
    wall : Wall
        Depth and directions of the wall.
    rule : FiberRule
        Angles on its two sides.
    """
    left = _linear(rule.helix, wall.depth)
    septal = _linear((rule.helix[0], -rule.right_helix[0]), wall.depth)
    free = _linear(rule.right_helix, wall.depth)
    other = np.where(wall.septum[:, None], septal, free)
    return np.asarray((1 - wall.right) * left + wall.right * other)


def _rotation(rule: FiberRule, wall: Wall) -> Array:
    """Fiber frame in the frame of the wall, (e, 64, 3, 3): columns fiber, sheet, sheet-normal."""
    helix = np.radians(helix_angle(wall, rule))
    transverse = np.radians(_linear(rule.transverse, wall.depth))
    about = np.radians(_linear(rule.sheet, wall.depth))
    zero = np.zeros_like(helix)
    cos, sin = np.cos(transverse), np.sin(transverse)
    fiber = np.stack([cos * np.cos(helix), cos * np.sin(helix), sin], -1)
    outward = np.stack([-sin * np.cos(helix), -sin * np.sin(helix), cos], -1)
    aside = np.stack([-np.sin(helix), np.cos(helix), zero], -1)
    sheet = np.cos(about)[..., None] * outward + np.sin(about)[..., None] * aside
    return np.stack([fiber, sheet, np.cross(fiber, sheet)], -1)


def _linear(ends: Pair, depth: Array) -> Array:
    """From the first value at depth 0 to the second at depth 1."""
    return np.asarray(ends[0] + (ends[1] - ends[0]) * depth)
