"""The axes by which places in the heart are named: long axis, and where the septum is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.fields.rims import basal_rim, rims
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surface_faces import sample_faces, tessellate
from heartgen.renamed import takes_former_keywords

Array = NDArray[np.float64]

RIGHT_FRONT = (-1.0, -1.0, 0.0)
"""Where the septum is taken to be as seen from the left ventricle if nothing tells: to the
patient's right and front (LPS), as in most chests."""

PARALLEL = 0.05
"""Sine of the angle to the long axis below which a direction does not tell where the septum is."""

SAMPLES = 6
"""Per face and direction, of the septum."""

PIECES = 12
"""Pieces of an element's edge between which the apex is searched."""


@dataclass(frozen=True, eq=False)
class HeartAxes:
    """Axes of the left ventricle, mm, world (LPS).

    Attributes
    ----------
    base : (3,) float64
        Middle of the endocardium's basal rim.
    apex : (3,) float64
        Point of the endocardium farthest below the plane of that rim; where the apex is open, the
        middle of the opening.
    septal : (3,) float64
        Unit vector at right angles to the long axis, to the middle of the septum.
    known : {"measured", "given", "assumed"}
        How it is known where the septum is: from the right ventricle, from the user, not at all.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import heart_axes
    >>> axes = heart_axes(mesh)
    >>> round(axes.length), axes.known
    (78, 'assumed')
    >>> axes.level(axes.base[None]).round(3).tolist()
    [1.0]
    """

    base: Array
    apex: Array
    septal: Array
    known: Literal["measured", "given", "assumed"]

    @property
    def length(self) -> float:
        """Length of the long axis, mm."""
        return float(np.linalg.norm(self.base - self.apex))

    @property
    def longitudinal(self) -> Array:
        """Unit vector (3,) from apex to base."""
        return np.asarray((self.base - self.apex) / self.length)

    @property
    def anterior(self) -> Array:
        """Unit vector (3,) to the middle of the anterior wall: the septum turned by 90 degrees."""
        return np.cross(self.longitudinal, self.septal)

    def level(self, points: Array) -> Array:
        """Height (n,) of points (n, 3) over the apex, as a share of the long axis.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        return np.asarray((points - self.apex) @ self.longitudinal / self.length)

    def angle(self, points: Array) -> Array:
        """Angle (n,) of points (n, 3) about the axis, rad: 0 septal, pi/2 anterior, to pi.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        offset = points - self.apex
        return np.asarray(np.arctan2(offset @ self.anterior, offset @ self.septal))


@takes_former_keywords
def heart_axes(mesh: HexMesh, septal_direction: Sequence[float] | None = None) -> HeartAxes:
    """Find the axes of the left ventricle.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, world (LPS), any length. If omitted, it is
        that to the middle of the septum; in a mesh without a right ventricle, where nothing tells,
        the patient's right and front are taken for it.

    Returns
    -------
    HeartAxes

    Raises
    ------
    MeshError
        If the direction does not tell where the septum is.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import heart_axes
    >>> axes = heart_axes(mesh, septal_direction=(-1.0, 0.0, 0.0))
    >>> axes.longitudinal.round(2).tolist(), axes.known
    ([0.0, 0.0, 1.0], 'given')
    """
    base = basal_rim(mesh, "lv_endo")
    center = base.center
    apex = _apex(mesh, center, base.area)
    axis = (center - apex) / np.linalg.norm(center - apex)
    if septal_direction is not None:
        return HeartAxes(center, apex, _across(septal_direction, axis), "given")
    if "rv_septum" not in mesh.topology.patches:
        return HeartAxes(center, apex, _across(RIGHT_FRONT, axis), "assumed")
    points, _, weights = sample_faces(mesh, mesh.topology.patches["rv_septum"], SAMPLES)
    outward = (points - apex) - np.outer((points - apex) @ axis, axis)
    outward /= np.linalg.norm(outward, axis=1, keepdims=True)
    return HeartAxes(center, apex, _across(weights @ outward, axis), "measured")


def _apex(mesh: HexMesh, base: Array, area: Array) -> Array:
    """Lowest point of the endocardium, or middle of its opening at the apex."""
    faces = mesh.topology.surfaces["lv_endo"]
    found = rims(mesh, faces)
    if len(found) > 1:
        return min((rim.center for rim in found), key=lambda c: -float(np.linalg.norm(c - base)))
    points, _ = tessellate(mesh, faces, PIECES)
    height = (points - base) @ area
    # The vector area of the rim may point either way: the ventricle is on one side of it.
    return np.asarray(points[np.argmax(np.abs(height))])


def _across(direction: Sequence[float] | Array, axis: Array) -> Array:
    """Unit vector along a direction, at right angles to an axis."""
    given = np.asarray(direction, dtype=float)
    across = given - (given @ axis) * axis if given.shape == (3,) else np.zeros(3)
    size = float(np.linalg.norm(across))
    if not size > PARALLEL * float(np.linalg.norm(given)):  # also if it is not finite
        raise MeshError(
            f"direction {tuple(np.round(given, 3).tolist())} does not tell where the septum is: it "
            "runs along the long axis; give one from the left ventricle to the right, in the world "
            "(LPS)"
        )
    return np.asarray(across / size)
