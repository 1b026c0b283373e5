"""Short-axis stacks made from dense masks: shifted by breathing, carelessly segmented."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.images import Mask

Pixels = NDArray[np.bool_]

PAD = 16
"""Empty voxels kept around the heart across its axis: room for shifts."""

FLIPPED = 0.2
"""Share of the pixels at the boundary that noise flips."""

HOLES, ISLANDS = 3, 2
"""In each slice."""

RADIUS = 2.0
"""Of holes and islands, mm."""

GAP = 6.0
"""Width of a gap in the wall, mm."""


def short_axis(
    mask: Mask,
    distance: float,
    offset: float = 0.5,
    shifts: NDArray[np.float64] | None = None,
) -> Mask:
    """Take slices across the third index axis, which must be the long axis of the heart.

    Parameters
    ----------
    mask : Mask
        Dense.
    distance : float
        Between slices, mm; as near to it as planes of the mask are.
    offset : float
        Place of the first slice after the beginning of the heart, over the distance, 0 to 1.
    shifts : (n, 2) float64, optional
        In-plane shift of each slice, mm; more of them than there are slices do no harm.

    Returns
    -------
    Mask
        In the same place as the dense one; its voxels are as long as the distance.
    """
    step = round(distance / mask.spacing[2])
    voxels = np.pad(mask.voxels, ((PAD, PAD), (PAD, PAD), (0, 0)))
    first = int(np.flatnonzero(voxels.any(axis=(0, 1)))[0]) + int(offset * step)
    slices = voxels[:, :, first::step]
    slices = slices[:, :, : np.flatnonzero(slices.any(axis=(0, 1)))[-1] + 1]
    if shifts is not None:
        moved = [
            ndi.shift(plane.astype(float), shift / mask.spacing[:2], order=1) > 1 / 2
            for plane, shift in zip(np.moveaxis(slices, 2, 0), shifts, strict=False)
        ]
        slices = np.stack(moved, axis=2)
    affine = mask.affine @ np.diag([1.0, 1.0, step, 1.0])
    affine[:3, 3] = mask.to_world(np.array([[-PAD, -PAD, first]], dtype=float))[0]
    return Mask(slices, affine, mask.name)


def shown(mask: Mask) -> NDArray[np.intp]:
    """Which slices of a stack along the third axis carry data, (n,)."""
    return np.flatnonzero(mask.voxels.any(axis=(0, 1)))


def count(mask: Mask) -> int:
    """Slices with data of a stack."""
    return len(shown(mask))


def breathing(slices: int, deviation: float, seed: int) -> NDArray[np.float64]:
    """Random in-plane shifts (n, 2), mm, without mean and trend, which are place and tilt.

    The deviation is that of the shifts before these are taken away.
    """
    shifts = np.random.default_rng(seed).normal(0, deviation, (slices, 2))
    along = np.vander(np.arange(slices), 2)
    return np.asarray(shifts - along @ np.linalg.lstsq(along, shifts, rcond=None)[0])


def flipped(stack: Mask, chance: np.random.Generator) -> Mask:
    """Flip pixels on either side of the boundary."""
    wall = stack.voxels
    cross = ndi.generate_binary_structure(2, 1)[..., None]
    border = ndi.binary_dilation(wall, cross) & ~ndi.binary_erosion(wall, cross)
    return replace(stack, voxels=wall ^ (border & (chance.random(wall.shape) < FLIPPED)))


def holed(stack: Mask, chance: np.random.Generator) -> Mask:
    """Punch holes into the wall of every slice."""
    return _dotted(stack, chance, stack.voxels, HOLES, False)


def with_islands(stack: Mask, chance: np.random.Generator) -> Mask:
    """Put islands outside of the wall, in its pools too, into every slice."""
    return _dotted(stack, chance, ~stack.voxels, ISLANDS, True)


def without_middle(stack: Mask, chance: np.random.Generator) -> Mask:
    """Lose a slice in the middle third."""
    slices = shown(stack)
    third = len(slices) // 3
    voxels = stack.voxels.copy()
    voxels[:, :, slices[third + int(chance.integers(max(third, 1)))]] = False
    return replace(stack, voxels=voxels)


def gapped(stack: Mask, chance: np.random.Generator) -> Mask:
    """Cut a gap through the outer wall of every other slice."""
    voxels = stack.voxels.copy()
    for n in shown(stack)[::2]:
        plane = voxels[:, :, n]
        place = np.argwhere(plane)
        center = place.mean(0)
        angle = chance.uniform(-np.pi, np.pi)
        way = np.array([np.cos(angle), np.sin(angle)])
        offset = (place - center) * stack.spacing[:2]
        aside = np.abs(offset[:, 0] * way[1] - offset[:, 1] * way[0])
        cut = (offset @ way > 0) & (aside < GAP / 2)
        plane[tuple(place[cut].T)] = False
    return replace(stack, voxels=voxels)


def _dotted(
    stack: Mask, chance: np.random.Generator, where: Pixels, dots: int, value: bool
) -> Mask:
    """Set discs at random places of each slice."""
    voxels = stack.voxels.copy()
    i, j = np.indices(voxels.shape[:2])
    for n in shown(stack):
        places = np.argwhere(where[:, :, n])
        for place in places[chance.integers(len(places), size=dots)]:
            away = np.hypot((i - place[0]) * stack.spacing[0], (j - place[1]) * stack.spacing[1])
            voxels[:, :, n][away < RADIUS] = value
    return replace(stack, voxels=voxels)


DEFECTS: dict[str, Callable[[Mask, np.random.Generator], Mask]] = {
    "boundary flipped": flipped,
    "holes": holed,
    "islands": with_islands,
    "middle slice missing": without_middle,
    "wall gaps": gapped,
}
"""What careless segmentation leaves, by name."""
