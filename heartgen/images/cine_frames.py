"""Which frame of a cine: by its number, or end diastole or end systole by the cavity's volume."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import scipy.ndimage as ndi
from numpy.typing import NDArray

from heartgen.images.file_kinds import refuse
from heartgen.images.mask import Finding
from heartgen.wording import wording

Frame: TypeAlias = int | str
"""Number of a frame, from 1, or ``"ED"`` or ``"ES"``."""

PHASES = {"ed": "end diastole", "es": "end systole"}
"""Frames of the largest and of the smallest cavity."""

IN_PLANE = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=bool)
"""Pixels of one plane that share an edge are neighbors."""


def find_frame(
    frame: Frame | None, frames: int, cavity: Callable[[int], float], name: str
) -> tuple[int, tuple[Finding, ...]]:
    """Find the frame that was asked for.

    Parameters
    ----------
    frame : int, str or None
        Number from 1, ``"ED"``, ``"ES"``; None if there is only one.
    frames : int
        How many there are.
    cavity : callable
        Volume of the left ventricle's cavity in a frame from 0, ml; 0 if it is not labeled there.
    name : str
        Name of the image.

    Returns
    -------
    index : int
        From 0.
    findings : tuple of Finding
        Which frame a phase was found in.

    Raises
    ------
    InputError
        If there is no such frame, or several and none was chosen.
    """
    if frame is None:
        if frames == 1:
            return 0, ()
        refuse(
            name,
            f"The image is a cine, or has channels: it holds {frames} frames; choose one by its "
            "number from 1, or as ED or ES"
            f"{wording(', as frame=...', ', as --frame', ' under Frame')}.",
        )
    word = str(frame).strip().lower()
    if word in PHASES:
        return _phase(word, frames, cavity, name)
    number = _number(word)
    if not 1 <= number <= frames:
        held = "a single frame" if frames == 1 else f"frames 1 to {frames}"
        refuse(
            name,
            f"There is no frame {str(frame)[:20]!r}, the image holds {held}: give a number of "
            "these, ED or ES.",
        )
    return number - 1, ()


def _number(word: str) -> int:
    """A number of a frame, which tables of numbers write as 2.0; 0 for what is none."""
    try:
        value = float(word)
    except ValueError:
        return 0
    return int(value) if value.is_integer() else 0


def enclosed_volume(voxels: NDArray[np.bool_], affine: NDArray[np.float64]) -> float:
    """Volume that a wall encloses in the planes of an image, ml.

    Parameters
    ----------
    voxels : (nx, ny, nz) bool
        Myocardium.
    affine : (4, 4) float64
        Voxel index to world, mm.

    Returns
    -------
    float
        Across the index axis for which it is largest: that along which the ventricle is cut into
        rings.
    """
    if not voxels.any():
        return 0.0
    volume = abs(float(np.linalg.det(affine[:3, :3]))) / 1000
    box = voxels[ndi.find_objects(voxels.view(np.uint8))[0]]
    counts = []
    for axis in range(3):
        structure = np.expand_dims(IN_PLANE, axis)
        counts.append(int(ndi.binary_fill_holes(box, structure).sum()) - int(box.sum()))
    return max(counts) * volume


def _phase(
    word: str, frames: int, cavity: Callable[[int], float], name: str
) -> tuple[int, tuple[Finding, ...]]:
    """The frame of the largest or of the smallest cavity."""
    volumes = np.array([cavity(index) for index in range(frames)])
    shown = np.flatnonzero(volumes > 0)
    if not len(shown) or (len(shown) == 1 and frames > 1):
        there = f"only in frame {shown[0] + 1}" if len(shown) else "in no frame"
        refuse(
            name,
            f"The cavity of a left ventricle is seen {there} of {frames}, so {PHASES[word]} cannot "
            "be told: give the number of the frame.",
        )
    pick = np.argmax if word == "ed" else np.argmin
    index = int(shown[pick(volumes[shown])])
    finding = Finding(
        "frame",
        f"Frame {index + 1} of {frames} was read for {PHASES[word]}: its cavity has "
        f"{volumes[index]:.3g} ml, those of all frames {volumes[shown].min():.3g} to "
        f"{volumes[shown].max():.3g} ml.",
    )
    return index, (finding,)
