"""Where a phantom stands in the world, and the voxel grid that looks at it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypedDict

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from heartgen.errors import InputError

Array = NDArray[np.float64]

MARGIN = 4
"""Empty voxels around the heart on every side."""

MOST_VOXELS = 10**9
"""Largest grid made, voxels (one byte each): a finer one would fill the memory of a laptop."""

ORTHOGONAL = 1e-9
"""Largest error of the product of a direction matrix with its transpose; round-off is 1e-15."""


class Placement(TypedDict, total=False):
    """How a heart lies in the world and under the voxels; every phantom takes these by keyword.

    Attributes
    ----------
    rotation : (3, 3) array, int or None
        From the heart frame (z from apex to base) to the world (LPS); an int seeds a random one.
    translation : (3,) array, mm, world (LPS)
        Where the middle of the left ventricle's widest level goes.
    scale : float
        Factor on all sizes of the heart (not on the spacing); 1 is human, 0.3 a rabbit.
    direction : (3, 3) array or None
        Columns are the directions of the index axes in the world (LPS); None for its axes.
    noise : float
        Probability of flipping each voxel that has a face in common with the other label.
    seed : int
        Seed of the noise.

    Examples
    --------
    >>> from heartgen import samples
    >>> rabbit = samples.ideal_cup(1.0, scale=0.3, translation=(10.0, 0.0, 0.0))
    >>> rabbit.truth.apex.round(3).tolist()
    [10.0, 0.0, -18.0]
    """

    rotation: ArrayLike | int | None
    translation: ArrayLike
    scale: float
    direction: ArrayLike | None
    noise: float
    seed: int


UNMOVED: Placement = {
    "rotation": None,
    "translation": (0.0, 0.0, 0.0),
    "scale": 1.0,
    "direction": None,
    "noise": 0.0,
    "seed": 0,
}
"""A heart of human size along the axes of the world, without noise."""


@dataclass(frozen=True, eq=False)
class Pose:
    """Similarity from the heart frame to the world.

    Attributes
    ----------
    rotation : (3, 3) float64
        Proper rotation.
    translation : (3,) float64, mm, world (LPS)
        Where the origin of the heart frame goes.
    scale : float
        Size against a human heart.
    """

    rotation: Array
    translation: Array
    scale: float

    def to_world(self, points: Array) -> Array:
        """World coordinates (n, 3), mm, LPS, of points (n, 3) in the heart frame, mm.

        Parameters
        ----------
        points : (n, 3) float64
            mm, heart frame.
        """
        return self.scale * points @ self.rotation.T + self.translation

    def to_heart(self, points: Array) -> Array:
        """Heart frame coordinates (n, 3), mm, of world points (n, 3), mm, LPS.

        Parameters
        ----------
        points : (n, 3) float64
            mm, world (LPS).
        """
        return (points - self.translation) @ self.rotation / self.scale


def make_pose(rotation: ArrayLike | int | None, translation: ArrayLike, scale: float) -> Pose:
    """Check and complete a pose.

    Parameters
    ----------
    rotation : (3, 3) array, int or None
        Rotation matrix, seed of a random rotation, or None for none.
    translation : (3,) array, mm, world (LPS)
        To where the origin of the heart frame goes.
    scale : float
        Factor of all lengths.

    Returns
    -------
    Pose

    Raises
    ------
    InputError
        If the rotation is not one, the translation is not a point or the scale not positive.
    """
    if rotation is None:
        matrix = np.eye(3)
    elif isinstance(rotation, int | np.integer):
        matrix = Rotation.random(None, np.random.default_rng(int(rotation))).as_matrix()
    else:
        matrix = _orthogonal(rotation, "rotation")
        if np.linalg.det(matrix) < 0:
            raise InputError("The rotation mirrors the heart; give a matrix with determinant +1.")
    origin = np.asarray(translation, dtype=np.float64)
    if origin.shape != (3,) or not np.isfinite(origin).all():
        raise InputError(
            f"The translation must be three finite numbers in mm, not {translation!r}."
        )
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(f"The scale must be a positive number, not {scale}.")
    return Pose(matrix, origin, float(scale))


def make_grid(
    extent: Array, spacing: ArrayLike, direction: ArrayLike | None
) -> tuple[Array, tuple[int, int, int]]:
    """Voxel grid around points.

    The voxel centers lie at odd multiples of half the spacing from the world's origin along each
    index axis, so that flipping or permuting the axes leaves the set of voxel centers the same.

    Parameters
    ----------
    extent : (n, 3) float64, mm, world (LPS)
        Points that the grid must enclose.
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.
    direction : (3, 3) array or None
        Columns are the directions of the index axes in the world (LPS); orthogonal, any handedness.

    Returns
    -------
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.
    size : (3,) tuple of int
        Number of voxels along each index axis.

    Raises
    ------
    InputError
        If the spacing is not positive, the direction not orthogonal, or the grid too large.
    """
    axes = np.eye(3) if direction is None else _orthogonal(direction, "direction")
    step = np.asarray(spacing, dtype=np.float64)
    if step.shape not in ((), (3,)) or not np.isfinite(step).all() or step.min() <= 0:
        raise InputError(
            f"The spacing must be one or three positive numbers in mm, not {spacing!r}."
        )
    step = np.broadcast_to(step, (3,))
    along = extent @ axes / step
    first = np.floor(along.min(axis=0)) - MARGIN
    size = np.ceil(along.max(axis=0)) + MARGIN - first
    if np.prod(size) > MOST_VOXELS:
        raise InputError(
            f"A spacing of {spacing!r} mm needs {np.prod(size):.1e} voxels; "
            f"choose a coarser one (at most {MOST_VOXELS:.0e} voxels are made)."
        )
    affine = np.eye(4)
    affine[:3, :3] = axes * step
    affine[:3, 3] = affine[:3, :3] @ (first + 1 / 2)
    nx, ny, nz = (int(s) for s in size)
    return affine, (nx, ny, nz)


def _orthogonal(matrix: ArrayLike, name: str) -> Array:
    """Check that a matrix is orthogonal, (3, 3)."""
    m = np.asarray(matrix, dtype=np.float64)
    if m.shape != (3, 3) or not np.allclose(m @ m.T, np.eye(3), rtol=0, atol=ORTHOGONAL):
        raise InputError(
            f"The {name} must be a 3 x 3 matrix of orthogonal unit vectors; check its columns."
        )
    return m
