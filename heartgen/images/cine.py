"""DICOM segmentations of a cine: several frames in every place, one for each moment."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Sequence
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from heartgen.images.file_kinds import refuse

Moments: TypeAlias = tuple[tuple[int, ...], ...]
"""For each moment, the frames of the file that belong to it, from 0."""

PLACES = (0x0062000B, 0x00200032, 0x00209056, 0x00209057)
"""Tags of what tells frames of one moment apart: segment, position, stack, place in the stack."""

BIT = 1
"""Bits of a voxel of a binary segmentation."""


def find_moments(dataset: Any, file: str) -> Moments:
    """Sort the frames of a segmentation by moment.

    Parameters
    ----------
    dataset : pydicom.Dataset
        With the functional groups of its frames.
    file : str
        Name of the file, for messages.

    Returns
    -------
    Moments
        A single one if no place is taken twice. By the dimension that is neither segment nor
        place, or the temporal position; without these by the order in the file.

    Raises
    ------
    InputError
        If it is not to be told which frames belong together.
    """
    groups = list(dataset.get("PerFrameFunctionalGroupsSequence") or ())
    places = [_place(group) for group in groups]
    if len(set(places)) == len(places):
        return (tuple(range(len(places))),)
    orders: tuple[Sequence[tuple[int, ...]], ...] = (
        _dimensions(dataset, groups),
        _temporal(groups),
        _order(places),
        _runs(places),
    )
    for times in orders:
        if len(times) != len(places):
            continue
        if len(set(zip(times, places, strict=True))) == len(places):
            return tuple(
                tuple(at for at, other in enumerate(times) if other == time)
                for time in sorted(set(times))
            )
    refuse(
        file,
        "The segmentation is a cine, with several frames in one place, but does not say which of "
        "them belong together: export one volume, or one file for each moment.",
    )


def one_moment(file: Path, frames: Sequence[int]) -> Any:
    """Read a segmentation with some of its frames alone.

    Parameters
    ----------
    file : Path
        A segmentation.
    frames : sequence of int
        Frames to keep, from 0.

    Returns
    -------
    pydicom.Dataset
        Not compressed.
    """
    from pydicom import dcmread
    from pydicom.pixels.utils import pack_bits
    from pydicom.uid import ExplicitVRLittleEndian

    dataset = dcmread(file)
    kept = np.atleast_3d(dataset.pixel_array)[list(frames)]
    groups = dataset.PerFrameFunctionalGroupsSequence
    dataset.PerFrameFunctionalGroupsSequence = [groups[at] for at in frames]
    dataset.NumberOfFrames = len(frames)
    packed = pack_bits(kept.ravel()) if dataset.BitsAllocated == BIT else kept.tobytes()
    dataset.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    dataset.PixelData = packed
    return dataset


def _place(group: Any) -> Hashable:
    """Segment and position of a frame, as far as it has its own."""
    segment = group.get("SegmentIdentificationSequence")
    position = group.get("PlanePositionSequence")
    return (
        int(segment[0].ReferencedSegmentNumber) if segment else 0,
        tuple(round(float(x), 3) for x in position[0].ImagePositionPatient) if position else (),
    )


def _dimensions(dataset: Any, groups: Sequence[Any]) -> list[tuple[int, ...]]:
    """Values of the dimensions that are neither segment nor place; nothing if there is none."""
    declared = dataset.get("DimensionIndexSequence") or ()
    pointers = [int(item.DimensionIndexPointer) for item in declared]
    others = [at for at, pointer in enumerate(pointers) if pointer not in PLACES]
    values = [_content(group, "DimensionIndexValues") for group in groups]
    if not others or any(value is None or len(value) != len(pointers) for value in values):
        return []
    return [tuple(int(value[at]) for at in others) for value in values]


def _temporal(groups: Sequence[Any]) -> list[tuple[int, ...]]:
    """Temporal positions; nothing if a frame has none."""
    values = [_content(group, "TemporalPositionIndex") for group in groups]
    if any(value is None for value in values):
        return []
    return [(int(value),) for value in values]


def _order(places: Sequence[Hashable]) -> list[tuple[int, ...]]:
    """How many frames before each are in its place; nothing if some places have fewer."""
    seen: Counter[Hashable] = Counter()
    times: list[tuple[int, ...]] = []
    for place in places:
        times.append((seen[place],))
        seen[place] += 1
    return times if len(set(seen.values())) == 1 else []


def _runs(places: Sequence[Hashable]) -> list[tuple[int, ...]]:
    """Moments one after the other, a new one where a place comes again.

    Nothing if there are more than any place has frames.
    """
    seen: set[Hashable] = set()
    times: list[tuple[int, ...]] = []
    now = 0
    for place in places:
        if place in seen:
            seen, now = set(), now + 1
        seen.add(place)
        times.append((now,))
    return times if now + 1 == max(Counter(places).values()) else []


def _content(group: Any, key: str) -> Any:
    """An entry of a frame's content, if there is one."""
    content = group.get("FrameContentSequence")
    return content[0].get(key) if content else None
