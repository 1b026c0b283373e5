"""What an image must be for a heart to be meshed from it: small named checks.

Each check returns a `Finding`, or None if all is well; `report` makes one error of the fatal ones.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import InputError, recalling
from heartgen.images.mask import Finding, planes_along

MAX_VOXELS = 1024**3
"""Most voxels an image may have: 90 times the largest of Lamata et al. 2014 (222 x 233 x 252)."""

CHANNELS = 4
"""Entries of a first axis, at most, that are channels rather than voxels if three axes follow:
background, two blood pools and myocardium; fewer than any mesh needs."""

MIN_VOXELS = 72
"""Fewest voxels of a mask: one for each element of the paper's coarsest template (1 x 12 x 6)."""

MIN_SLICES = 3
"""Fewest voxels a heart may span along an axis: a base, a middle and an apex."""

SPACINGS = (1e-5, 250.0)
"""Voxel sizes in mm beyond which no unit mix-up explains the number: below lies a mouse heart at
29 um stored in meters, above the sparsest stack of the paper (20 mm) read ten times too large."""

HEART_LENGTHS = (3.0, 400.0)
"""Lengths of hearts in mm, newborn mouse to horse."""

FARTHEST = 1e7
"""Distance in mm from the origin of the world that no image has, whatever its unit: 10 km."""

SHEAR_TOLERANCE = 1e-3
"""Largest cosine between two voxel axes that is still rounding, not shear (0.06 degrees)."""

UNITS = {"m": 1000.0, "um": 0.001}
"""Units images come in by mistake, in mm. (A human heart in cm looks like a mouse's in mm.)"""

HUMAN_HEART = (60.0, 200.0)
"""Lengths of human ventricles in mm, to guess the unit of an implausible image."""


def report(name: str, findings: Iterable[Finding | None]) -> tuple[Finding, ...]:
    """Return what the checks found.

    Parameters
    ----------
    name : str
        Name of the input, to begin the message with.
    findings : iterable of Finding or None
        Outcomes of checks.

    Returns
    -------
    tuple of Finding
        The findings, in order; none is fatal.

    Raises
    ------
    InputError
        If any is fatal, with the sentence of each fatal one.
    """
    seen = tuple(finding for finding in findings if finding is not None)
    fatal = [finding.message for finding in seen if finding.fatal]
    if not fatal:
        return seen
    with recalling(finding.message for finding in seen if not finding.fatal):
        if len(fatal) == 1:
            raise InputError(f"{name}: {fatal[0]}")
        listed = "".join(f"\n- {message}" for message in fatal)
        raise InputError(f"{name}: {len(fatal)} problems were found:{listed}")


def check_dimensions(shape: tuple[int, ...]) -> Finding | None:
    """Three axes of the world; the fourth and further ones are frames.

    Parameters
    ----------
    shape : tuple of int
        Of the array, frames last.
    """
    sizes = " x ".join(map(str, shape))
    if _channels_first(shape):
        entries = "a single entry" if shape[0] == 1 else f"{shape[0]} entries"
        return _fatal(
            "dimensions",
            f"The first axis of the image seems to be no direction but channels, with {entries} "
            f"({sizes} voxels): save one channel, as a volume of three axes.",
        )
    if len(shape) < 3 or 1 in shape[:3]:
        return _fatal(
            "dimensions",
            f"The image is two-dimensional ({sizes} voxels): give a volume, "
            "with all slices of the heart in one file.",
        )
    return None


def _channels_first(shape: tuple[int, ...]) -> bool:
    """Whether axes are in the order of tensors: channels, then directions."""
    many = sum(n > CHANNELS for n in shape[1:])
    return len(shape) > 3 and shape[0] <= CHANNELS and many >= 3


def check_frames(shape: tuple[int, ...]) -> Finding | None:
    """A single frame.

    Parameters
    ----------
    shape : tuple of int
        Of the array, frames last.
    """
    frames = int(np.prod(shape[3:], dtype=np.float64))
    if frames == 1:
        return None
    sizes = " x ".join(map(str, shape))
    return _fatal(
        "frames",
        f"The image has {frames} frames or channels ({sizes} voxels): choose one, for example that "
        "of end diastole.",
    )


def check_size(shape: tuple[int, ...]) -> Finding | None:
    """Not more voxels than can be worked on, nor fewer than one.

    Parameters
    ----------
    shape : tuple of int
        Voxels along each axis.
    """
    if any(n < 1 for n in shape):
        return _fatal(
            "size",
            f"The header declares an impossible size ({' x '.join(map(str, shape))}): "
            "the file is damaged, export it again.",
        )
    # In floating point: the product of hostile numbers overflows an integer.
    voxels = float(np.prod(shape, dtype=np.float64))
    if voxels > MAX_VOXELS:
        return _fatal(
            "size",
            f"The header declares {' x '.join(map(str, shape))} = {voxels:.3g} voxels, more than "
            f"the {MAX_VOXELS:.3g} heartgen reads: crop the image to the heart, or resample it.",
        )
    return None


def check_data_type(dtype: np.dtype[Any]) -> Finding | None:
    """One real number per voxel.

    Parameters
    ----------
    dtype : numpy.dtype
        Of the voxel values.
    """
    if dtype.kind in "buif":
        return None
    kind = {"c": "complex numbers", "V": "colors or vectors"}.get(dtype.kind, f"type {dtype}")
    return _fatal(
        "data type",
        f"The voxels hold {kind}: save the mask with one whole number per voxel.",
    )


def check_finite(values: NDArray[Any]) -> Finding | None:
    """No NaN and no infinity.

    Parameters
    ----------
    values : array of a real type
        Voxel values.
    """
    bad = 0 if values.dtype.kind != "f" else int(values.size - np.isfinite(values).sum())
    if bad == 0:
        return None
    return _fatal("finite", f"NaN or infinity stands in {_count(bad, 'voxel')}: put 0 there.")


def check_affine(affine: NDArray[np.float64]) -> Finding | None:
    """A finite, invertible map of plausible voxel sizes, and no shear. Mirrors are welcome.

    Parameters
    ----------
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.
    """
    if affine.shape != (4, 4) or not np.array_equal(affine[3], [0, 0, 0, 1]):
        return _fatal("affine", "The affine must be a 4 x 4 matrix with last row 0 0 0 1.")
    if not (np.abs(affine) < FARTHEST).all():
        return _fatal(
            "affine",
            "The position or orientation of the image in the world is not a sensible number: "
            "write the header again with the tool that made the mask.",
        )
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    if spacing.min() < SPACINGS[0] or spacing.max() > SPACINGS[1]:
        return _fatal(
            "spacing",
            f"A voxel size of {describe_sizes(spacing)} mm is not possible for a heart: "
            "correct the voxel size in the header.",
        )
    unit = affine[:3, :3] / spacing
    cosine = np.abs(unit.T @ unit - np.eye(3)).max()
    if cosine > SHEAR_TOLERANCE:
        angle = np.degrees(np.arccos(min(cosine, 1.0)))
        return _fatal(
            "shear",
            f"The voxel axes are sheared, two of them meet at {angle:.1f} degrees instead of 90: "
            "resample the mask onto a grid with right angles.",
        )
    return None


def check_empty(voxels: NDArray[np.bool_]) -> Finding | None:
    """Something in the mask.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The mask.
    """
    if voxels.any():
        return None
    return _fatal(
        "empty", "The mask is empty, no voxel is set: check that the right structure was exported."
    )


def check_background(voxels: NDArray[np.bool_]) -> Finding | None:
    """Background around the heart: not everywhere set, not inside out.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The mask.
    """
    if voxels.all():
        return _fatal(
            "background",
            "Every voxel is set, so there is no background: save the mask with 0 outside the "
            "myocardium.",
        )
    corners = voxels[np.ix_(*[(0, -1)] * voxels.ndim)]
    if corners.all():
        return _fatal(
            "background",
            "All eight corners of the image are set, so heart and background seem to be swapped: "
            "invert the mask.",
        )
    return None


def check_extent(voxels: NDArray[np.bool_]) -> Finding | None:
    """Enough voxels, and enough of them along each axis, to be a heart.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The mask, not empty.
    """
    n = int(voxels.sum())
    if 0 < n < MIN_VOXELS:
        return _fatal(
            "extent",
            f"The heart has only {_count(n, 'voxel')}, too few to mesh "
            f"(at least {MIN_VOXELS}): use a finer image.",
        )
    for axis in range(3):
        planes = int(planes_along(voxels, axis).sum())
        if 0 < planes < MIN_SLICES:
            return _fatal(
                "extent",
                f"The heart spans only {_count(planes, 'voxel')} along the {'ijk'[axis]} axis, "
                f"so it is flat (at least {MIN_SLICES} are needed): give all its slices.",
            )
    return None


def check_scale(voxels: NDArray[np.bool_], affine: NDArray[np.float64]) -> Finding | None:
    """A length that hearts have; another one is meshed all the same.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        The mask, not empty.
    affine : (4, 4) float64
        Voxel index to world, mm, LPS.
    """
    ends = np.array([np.flatnonzero(planes_along(voxels, axis))[[0, -1]] for axis in range(3)])
    extent = (ends[:, 1] - ends[:, 0] + 1) * np.linalg.norm(affine[:3, :3], axis=0)
    length = float(extent.max())
    if HEART_LENGTHS[0] <= length <= HEART_LENGTHS[1]:
        return None
    fitting = [
        unit for unit, mm in UNITS.items() if HUMAN_HEART[0] <= length * mm <= HUMAN_HEART[1]
    ]
    guess = f"it would fit a human heart in {fitting[0]}, " if fitting else ""
    return Finding(
        "scale",
        f"The mask is {length:.3g} mm long, which no heart is: {guess}"
        "check the unit of the voxel size; sizes are reported as if it were mm.",
    )


def describe_sizes(spacing: NDArray[np.float64]) -> str:
    """Voxel size as text.

    Parameters
    ----------
    spacing : (n,) float64
        Voxel size along each axis, mm.
    """
    return " x ".join(f"{s:.4g}" for s in spacing)


def _fatal(check: str, message: str) -> Finding:
    """A finding that stops the reading."""
    return Finding(check, message, fatal=True)


def _count(n: int, noun: str) -> str:
    """A number with its noun: 1 voxel, 2 voxels."""
    return f"{n} {noun}" if n == 1 else f"{n} {noun}s"
