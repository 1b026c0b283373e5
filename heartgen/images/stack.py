"""A stack of slices: the planes of a mask that carry data, far apart along their normal."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from heartgen.images.mask import BESIDE, Mask, planes_along

Pixel = TypeVar("Pixel", np.bool_, np.uint8)

TAPERED = 1.5
"""Area of the right pool in the two slices at its one end (one, if it is seen in three or two) over
that at its other end from which it tells where the apex is."""


@dataclass(frozen=True, eq=False)
class Stack:
    """Slices of a mask, in order along their normal.

    Attributes
    ----------
    pixels : (n, nx, ny) bool
        Myocardium in each slice; at least `MARGIN` empty pixels around the heart.
    heights : (n,) float64
        Places of the slices along the normal, rising, mm.
    distance : float
        From a slice to the next, mm: of the slab that a slice stands for.
    affine : (4, 4) float64
        Pixel indices and height (i, j, mm) to the world, mm, LPS.
    blood : (n, nx, ny) uint8 or None
        Labeled pools as in a `Mask`, but for a right one that is not taken; None if there are none.
    beside : (n,) int or None
        Area of a right pool that is not taken, pixels; None if none is known.
    """

    pixels: NDArray[np.bool_]
    heights: NDArray[np.float64]
    distance: float
    affine: NDArray[np.float64]
    blood: NDArray[np.uint8] | None = None
    beside: NDArray[np.intp] | None = None

    @property
    def spacing(self) -> NDArray[np.float64]:
        """Pixel size, (2,) float64, mm."""
        return np.asarray(np.linalg.norm(self.affine[:3, :2], axis=0))

    @property
    def normal(self) -> NDArray[np.float64]:
        """Direction of the rising heights, (3,) float64, world (LPS)."""
        return self.affine[:3, 2]

    def to_world(self, places: NDArray[np.float64]) -> NDArray[np.float64]:
        """World coordinates (n, 3), mm, LPS, of pixel indices and heights (n, 3).

        Parameters
        ----------
        places : (n, 3) float64
            Pixel indices along i and j, which may be fractional, and heights, mm.
        """
        return np.asarray(places @ self.affine[:3, :3].T + self.affine[:3, 3])

    def padded(self, pixels: int) -> Stack:
        """Return the same slices with more empty pixels around the heart.

        Parameters
        ----------
        pixels : int
            How many to add on each side.
        """
        affine = self.affine.copy()
        affine[:3, 3] -= affine[:3, :2] @ (pixels, pixels)
        blood = None if self.blood is None else with_border(self.blood, pixels)
        return replace(self, pixels=with_border(self.pixels, pixels), affine=affine, blood=blood)

    def part(self, chosen: NDArray[np.bool_]) -> Stack:
        """Return some of the slices, (n,) bool.

        Parameters
        ----------
        chosen : (n,) bool
            Which slices.
        """
        return replace(
            self,
            pixels=self.pixels[chosen],
            heights=self.heights[chosen],
            blood=None if self.blood is None else self.blood[chosen],
            beside=None if self.beside is None else self.beside[chosen],
        )

    def reversed(self) -> Stack:
        """Return the same slices in the opposite order."""
        affine = self.affine.copy()
        affine[:3, 2] *= -1
        blood = None if self.blood is None else self.blood[::-1]
        beside = None if self.beside is None else self.beside[::-1]
        pixels, heights = self.pixels[::-1], -self.heights[::-1]
        return Stack(pixels, heights, self.distance, affine, blood, beside)


MARGIN = 6
"""Empty pixels kept around the heart."""


def stack_of(mask: Mask) -> Stack | None:
    """Slices of a mask whose planes with data lie far apart; None of a (nearly) isotropic one.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).

    Returns
    -------
    Stack or None
    """
    return None if mask.stack_axis is None else _slices(mask, mask.stack_axis)


def slices_of(mask: Mask) -> Stack:
    """Slices of a mask, be it one alone: along the axis that shows the fewest of them.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).

    Returns
    -------
    Stack
    """
    return _slices(mask, int(np.argmin([planes_along(mask.voxels, a).sum() for a in range(3)])))


def _slices(mask: Mask, axis: int) -> Stack:
    """Planes with data along an index axis."""
    planes = np.flatnonzero(planes_along(mask.voxels, axis))
    step = int(np.median(np.diff(planes))) if len(planes) > 1 else 1
    first, second = (a for a in range(3) if a != axis)
    pixels = np.moveaxis(mask.voxels, axis, 0)[planes]
    blood = None if mask.blood is None else np.moveaxis(mask.blood, axis, 0)[planes]
    beside = None
    if blood is not None and (blood == BESIDE).any():
        beside = np.sum(blood == BESIDE, axis=(1, 2))
        blood = np.where(blood == BESIDE, np.uint8(0), blood)
    shown = pixels.any(0) if blood is None else pixels.any(0) | blood.any(0)
    corners = np.argwhere(shown)
    low, high = corners.min(0), corners.max(0) + 1
    box = (slice(None), slice(low[0], high[0]), slice(low[1], high[1]))
    affine = np.eye(4)
    affine[:3, :2] = mask.affine[:3, [first, second]]
    affine[:3, 2] = mask.affine[:3, axis] / mask.spacing[axis]
    affine[:3, 3] = mask.affine[:3, 3] + affine[:3, :2] @ (low - MARGIN)
    return Stack(
        with_border(pixels[box], MARGIN),
        np.asarray(planes * float(mask.spacing[axis]), dtype=float),
        step * float(mask.spacing[axis]),
        affine,
        None if blood is None else with_border(blood[box], MARGIN),
        beside,
    )


def narrow_end(area: NDArray[np.intp]) -> int:
    """Tell at which end of a stack the apex is, by the right ventricle, which tapers towards it.

    Parameters
    ----------
    area : (n,) int
        Of the right pool in each slice, in any unit; 0 where there is none.

    Returns
    -------
    int
        -1 for the first slice, 1 for the last; 0 if the pool does not tell.
    """
    seen = area[area > 0]
    ends = min(2, len(seen) // 2)
    first, last = float(seen[:ends].sum()), float(seen[len(seen) - ends :].sum())
    if max(first, last) <= TAPERED * min(first, last):
        return 0
    return 1 if last < first else -1


def with_border(pixels: NDArray[Pixel], border: int) -> NDArray[Pixel]:
    """Slices (n, nx, ny) with empty pixels around them.

    Parameters
    ----------
    pixels : (n, nx, ny) array
        The slices.
    border : int
        Pixels to add on each side.
    """
    return np.pad(pixels, [(0, 0), (border, border), (border, border)])
