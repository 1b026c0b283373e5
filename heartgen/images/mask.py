"""A binary mask of the myocardium in world coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.shown import as_html, counted, in_lines

WALL, LEFT_BLOOD, RIGHT_BLOOD, BESIDE = 1, 2, 3, 4
"""What a voxel of a labeled heart is."""

STACK_RATIO = 2.5
"""Slice distance over pixel size from which an image counts as a stack of slices."""


@dataclass(frozen=True)
class Finding:
    """What one check of the input saw.

    Attributes
    ----------
    check : str
        Name of the check, e.g. ``"components"``.
    message : str
        One clear sentence: what was seen and what was done about it, or what to do.
    fatal : bool
        True if no mesh may be made from this input.
    serious : bool
        True if a mesh may be made, but is no success: it lacks a part of the heart, or the image
        does.
    """

    check: str
    message: str
    fatal: bool = False
    serious: bool = False


@dataclass(frozen=True, eq=False)
class Mask:
    """Binary myocardium in the world.

    Attributes
    ----------
    voxels : (nx, ny, nz) bool
        True in the myocardium; index order (i, j, k).
    affine : (4, 4) float64
        Voxel index to world coordinates, mm, LPS; no shear.
    name : str
        Name for reports, usually the file's.
    findings : tuple of Finding
        What the reader's checks saw; none of them fatal.
    blood : (nx, ny, nz) uint8 or None
        `LEFT_BLOOD` and `RIGHT_BLOOD` in the blood pools of a label map, `BESIDE` in a right one
        whose ventricle is not taken, else 0; None if the image tells the myocardium alone.
    source : mapping of str to value, or None
        Where it was read: ``path``, and what else `heartgen.read_mask` or `heartgen.read_labels`
        was given; None for an array. Masks compare by identity: compare `voxels` and `affine`.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mask.voxels.shape, round(mask.voxel_diagonal, 2)
    ((24, 24, 31), 6.93)
    >>> mask.to_world(mask.to_index(mask.affine[None, :3, 3])).round(3).tolist()
    [[-46.0, -46.0, -86.0]]
    """

    voxels: NDArray[np.bool_]
    affine: NDArray[np.float64]
    name: str = "mask"
    findings: tuple[Finding, ...] = field(default=())
    blood: NDArray[np.uint8] | None = None
    source: Mapping[str, Any] | None = None

    @cached_property
    def spacing(self) -> NDArray[np.float64]:
        """Distance between neighboring voxels along each index axis, (3,) float64, mm."""
        return np.asarray(np.linalg.norm(self.affine[:3, :3], axis=0))

    @property
    def voxel_diagonal(self) -> float:
        """Length of the diagonal of a voxel, mm: the paper's limit for a successful fit."""
        return float(np.linalg.norm(self.spacing))

    @property
    def pixel(self) -> float:
        """Edge of a square, or cube, of the size of a pixel of a stack's slices, or a voxel, mm."""
        axis = self.stack_axis
        sides = self.spacing if axis is None else np.delete(self.spacing, axis)
        return float(np.prod(sides) ** (1 / len(sides)))

    @property
    def pixel_diagonal(self) -> float:
        """Diagonal of a pixel of a stack's slices, else of a voxel, mm."""
        axis = self.stack_axis
        return float(
            np.linalg.norm(self.spacing if axis is None else np.delete(self.spacing, axis))
        )

    @property
    def volume(self) -> float:
        """Volume of the myocardium, mm^3."""
        return float(self.voxels.sum() * np.prod(self.spacing))

    @cached_property
    def stack_axis(self) -> int | None:
        """Index axis along which slices lie far apart, or None for a (nearly) isotropic image.

        Slices lie apart if the voxels are long, or if there are empty planes between them.
        """
        steps = np.array([_typical_step(planes_along(self.voxels, axis)) for axis in range(3)])
        distance = self.spacing * steps
        thick = int(np.argmax(distance))
        in_plane = np.delete(self.spacing, thick)
        apart = steps[thick] > 1 or distance[thick] > STACK_RATIO * in_plane.min()
        return thick if apart else None

    @cached_property
    def planes(self) -> NDArray[np.bool_]:
        """Which planes along the stack axis (the last axis if isotropic) carry data, (n,) bool."""
        return planes_along(self.voxels, 2 if self.stack_axis is None else self.stack_axis)

    def __repr__(self) -> str:
        size = " x ".join(map(str, self.voxels.shape))
        spacing = " x ".join(f"{s:.3g}" for s in self.spacing)
        known = "" if self.blood is None else ", blood pools labeled"
        axis = self.stack_axis if self.voxels.any() else None
        kind = "mask" if axis is None else f"stack of {counted(int(self.planes.sum()), 'slice')}"
        lines = [
            f"Mask {self.name!r}: {kind}, {size} voxels of {spacing} mm",
            f"  myocardium {self.volume / 1000:.1f} ml{known}",
            *(f"  note     {finding.message}" for finding in self.findings),
        ]
        return in_lines(lines, " in findings")

    def _repr_html_(self) -> str:
        return as_html(repr(self))

    def to_world(self, index: NDArray[np.float64]) -> NDArray[np.float64]:
        """World coordinates (n, 3), mm, LPS, of voxel indices (n, 3).

        Parameters
        ----------
        index : (n, 3) float64
            Voxel indices, which may be fractional.
        """
        return np.asarray(index @ self.affine[:3, :3].T + self.affine[:3, 3])

    def to_index(self, world: NDArray[np.float64]) -> NDArray[np.float64]:
        """Voxel indices (n, 3), fractional, of world coordinates (n, 3), mm, LPS.

        Parameters
        ----------
        world : (n, 3) float64
            Points, mm, world (LPS).
        """
        return np.asarray(np.linalg.solve(self.affine[:3, :3], (world - self.affine[:3, 3]).T).T)


def planes_along(voxels: NDArray[np.bool_], axis: int) -> NDArray[np.bool_]:
    """Which planes across an index axis of (nx, ny, nz) voxels carry any, (n,) bool.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        A shape.
    axis : {0, 1, 2}
        The index axis.
    """
    return np.asarray(voxels.any(axis=tuple(a for a in range(3) if a != axis)))


def _typical_step(planes: NDArray[np.bool_]) -> float:
    """Median distance between neighboring planes that carry voxels, in planes."""
    carrying = np.flatnonzero(planes)
    return float(np.median(np.diff(carrying))) if len(carrying) > 1 else 1.0
