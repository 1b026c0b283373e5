"""What the reader mends in a mask, each time with a finding that says so."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD, Finding, Mask, planes_along

MARGIN = 2
"""Background voxels put around a heart that touches the border: one closes its surface, the next
lets central differences see background."""

LOST = 3
"""Consecutive empty planes inside a dense heart, at most, that are taken for lost ones."""

ALIKE = 0.5
"""Share of the smaller of the planes beside lost ones, at least, that the other covers."""

LISTED = 6
"""Sizes of pieces named in a message."""

CORNERS = np.ones((3, 3, 3), dtype=bool)
"""Voxels that share a corner are neighbors."""

IN_PLANE = np.array([[[0], [1], [0]], [[1], [1], [1]], [[0], [1], [0]]], dtype=bool)
"""Pixels of one slice that share an edge are neighbors, slices are not."""


def fill_lost_planes(mask: Mask) -> tuple[Mask, Finding | None]:
    """Interpolate planes that are empty although the heart goes on at both sides of them.

    They would cut a mask whose voxels fill the heart in two. Signed distances in the planes next
    to them are interpolated linearly (Raya and Udupa 1990). A stack of slices is left as it is.

    Parameters
    ----------
    mask : Mask
        Not empty.

    Returns
    -------
    mask : Mask
    finding : Finding or None
        Which planes were filled.
    """
    if mask.stack_axis is not None:
        return mask, None
    voxels, filled = mask.voxels, []
    for axis in range(3):
        carrying = np.flatnonzero(planes_along(voxels, axis))
        for low, high in pairwise(carrying):
            below, above = (np.take(voxels, n, axis) for n in (low, high))
            least = ALIKE * min(below.sum(), above.sum())
            if not 1 < high - low <= LOST + 1 or (below & above).sum() < least:
                continue
            spacing = np.delete(mask.spacing, axis)
            start, end = (_signed_distance(plane, spacing) for plane in (below, above))
            voxels = voxels.copy()
            for n in range(low + 1, high):
                share = (n - low) / (high - low)
                np.moveaxis(voxels, axis, 0)[n] = (1 - share) * start + share * end < 0
                filled.append(f"{'ijk'[axis]} {n}")
    if not filled:
        return mask, None
    finding = Finding(
        "lost planes",
        f"The mask is empty in {len(filled)} plane(s) inside the heart ({', '.join(filled)}): they "
        "were interpolated from their neighbors.",
    )
    return replace(mask, voxels=voxels), finding


def keep_largest(mask: Mask) -> tuple[Mask, Finding | None]:
    """Keep the largest of several separate pieces.

    Voxels that share a corner belong together. In a stack of slices the wall may slope by more
    than its own thickness from one slice to the next: there the filled outlines of consecutive
    slices are compared instead, whatever empty planes lie between them; a labeled pool fills its
    outline, also where the wall around it has a gap.

    Parameters
    ----------
    mask : Mask
        Not empty.

    Returns
    -------
    mask : Mask
        In one piece.
    finding : Finding or None
        What was dropped.
    """
    box = ndi.find_objects(mask.voxels.astype(np.uint8))[0]
    inside = mask.voxels[box]
    if mask.stack_axis is not None and mask.blood is not None:
        inside = inside | np.isin(mask.blood[box], (LEFT_BLOOD, RIGHT_BLOOD))
    pieces = _pieces(inside, mask.stack_axis) * mask.voxels[box]
    sizes = np.bincount(pieces.ravel())[1:]
    ordered = np.sort(sizes[sizes > 0])[::-1]
    if len(ordered) == 1:
        return mask, None
    voxels = np.zeros_like(mask.voxels)
    voxels[box] = pieces == sizes.argmax() + 1
    dropped = ", ".join(map(str, ordered[1 : LISTED + 1])) + ", ..." * (len(ordered) > LISTED + 1)
    finding = Finding(
        "components",
        f"The mask is in {len(ordered)} separate pieces: the largest ({ordered[0]} voxels) was "
        f"kept, the others ({dropped} voxels) were dropped.",
    )
    return replace(mask, voxels=voxels), finding


def pad_border(mask: Mask) -> tuple[Mask, Finding | None]:
    """Put background between the heart and the borders of the image that it touches.

    Parameters
    ----------
    mask : Mask
        Any.

    Returns
    -------
    mask : Mask
        The same voxels in the same place of the world, with a margin.
    finding : Finding or None
        Where the margin was added.
    """
    touched = np.zeros((3, 2), dtype=bool)
    for axis in range(3):
        planes = planes_along(mask.voxels, axis)
        touched[axis] = planes[0], planes[-1]
    if not touched.any():
        return mask, None
    widths = MARGIN * touched.astype(int)
    affine = mask.affine.copy()
    affine[:3, 3] -= affine[:3, :3] @ widths[:, 0]
    sides = ", ".join(
        f"{('first', 'last')[end]} {'ijk'[axis]}" for axis, end in np.argwhere(touched).tolist()
    )
    finding = Finding(
        "border",
        f"The heart touches the border of the image ({sides}): {MARGIN} voxels of background "
        "were added there; what the image cuts off stays cut off.",
    )
    blood = None if mask.blood is None else np.pad(mask.blood, widths)
    return replace(mask, voxels=np.pad(mask.voxels, widths), affine=affine, blood=blood), finding


def _pieces(voxels: NDArray[np.bool_], stack_axis: int | None) -> NDArray[np.int32]:
    """Number of the piece each voxel belongs to, from 1; 0 in the background."""
    if stack_axis is None:
        return np.asarray(ndi.label(voxels, CORNERS)[0], dtype=np.int32)
    slices = np.moveaxis(voxels, stack_axis, 2)
    data = slices.any(axis=(0, 1))
    filled = np.asarray(ndi.binary_fill_holes(slices[..., data], IN_PLANE))
    pieces = np.zeros(slices.shape, dtype=np.int32)
    pieces[..., data] = ndi.label(filled, CORNERS)[0] * slices[..., data]
    return np.moveaxis(pieces, 2, stack_axis)


def _signed_distance(shape: NDArray[np.bool_], spacing: NDArray[np.float64]) -> NDArray[np.float64]:
    """Distance of pixels (nx, ny) to the border of a shape in their plane, mm, negative inside."""
    outside, inside = (ndi.distance_transform_edt(s, sampling=spacing) for s in (~shape, shape))
    return np.asarray(outside - inside)
