"""Fiber frames as three angles from the local coordinates, as cmGui, zinc and OpenCMISS take them.

The frame to turn is that of xi1, of the normal to xi1 in the plane of xi1 and xi2, and of the
normal to that plane. It is turned about the last by the fiber angle, then about the second by the
imbrication angle, which inclines the fiber inwards, then about the fiber by the sheet angle. Where
a fiber lies in the plane at a helix angle and its sheet is transmural, they are the helix angle, 0
and a right angle.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.fields.frames import local_frames
from heartgen.mesh.bernstein import lattice
from heartgen.mesh.hexmesh import HexMesh

Array = NDArray[np.float64]


def fiber_angles(mesh: HexMesh, frames: Array) -> Array:
    """Angles that turn the local coordinates' own frame into fiber, sheet and sheet-normal.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    frames : (e, 64, 3, 3) float64
        Of `heartgen.fields.fiber_frames`: orthonormal columns at the Lagrange nodes of each
        element.

    Returns
    -------
    (e, 64, 3) float64
        Fiber, imbrication and sheet angle, rad, without jumps within an element. Where xi1 has no
        direction, at the pole, they are those that hold close to it.
    """
    own = np.swapaxes(local_frames(mesh, lattice()), -1, -2) @ frames
    fiber, sheet = own[..., 0], own[..., 1]
    about_normal = np.arctan2(fiber[..., 1], fiber[..., 0])
    inclination = -np.arcsin(np.clip(fiber[..., 2], -1, 1))
    cos, sin = np.cos(about_normal), np.sin(about_normal)
    aside = -sin * sheet[..., 0] + cos * sheet[..., 1]
    along = cos * sheet[..., 0] + sin * sheet[..., 1]
    outward = np.cos(inclination) * sheet[..., 2] + np.sin(inclination) * along
    about_fiber = np.arctan2(outward, aside)
    return np.stack([_even(about_normal), inclination, _even(about_fiber)], -1)


def _even(angles: Array) -> Array:
    """The same angles (e, n), rad, within half a turn of the mean direction of each element."""
    middle = np.angle(np.exp(1j * angles).sum(1, keepdims=True))
    return np.asarray(middle + np.angle(np.exp(1j * (angles - middle))))
