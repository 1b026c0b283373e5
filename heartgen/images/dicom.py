"""DICOM segmentation objects (SEG), read with highdicom."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.images.checks import check_dimensions, check_size, report
from heartgen.images.files import refuse
from heartgen.images.labels import describe_label, find_labels
from heartgen.images.volume import Label, Volume

SEGMENTATIONS = ("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7")
"""SOP classes Segmentation Storage and Label Map Segmentation Storage (DICOM PS3.6)."""

DEFLATED = "1.2.840.10008.1.2.1.99"
"""Transfer syntax that packs the whole file, so that its size is only known when it is unpacked."""

BITS = 8
"""Bits of a byte; the voxels of a binary segmentation take one each."""

HEADER_TAGS = [
    "BitsAllocated",
    "Columns",
    "Modality",
    "NumberOfFrames",
    "PerFrameFunctionalGroupsSequence",
    "Rows",
    "SegmentSequence",
    "SOPClassUID",
]
"""What is read of a file before its voxels."""


@dataclass(frozen=True)
class _Header:
    """What a DICOM file says before its voxels."""

    is_segmentation: bool
    modality: str
    shape: tuple[int, ...] = ()  # columns, rows, frames
    bits: int = 0  # of a voxel
    packed: bool = False
    placed: int = 0  # frames with a position of their own
    segments: Mapping[int, str] = field(default_factory=dict)


def read_segmentation(path: Path, label: Label | None) -> Volume:
    """Read one or several segments of a DICOM segmentation.

    Parameters
    ----------
    path : Path
        A DICOM file, or a folder with one segmentation among its files.
    label : int, str, sequence of them, or None
        Number(s) or label(s) of the segments that are myocardium; None if there is only one.

    Returns
    -------
    Volume
        The union of the segments; fractional ones keep their fractions.

    Raises
    ------
    InputError
        If there is no segmentation, not one only, or it is damaged or on irregular slices, or
        the segment is not to be told; or if highdicom is not installed.
    """
    volume, _ = _read(path, lambda names, file: _choose(names, label, file))
    return _volume(volume, volume.array.max(axis=-1))


def read_segments(path: Path) -> Volume:
    """Read all segments of a DICOM segmentation as a label map.

    Parameters
    ----------
    path : Path
        As of `read_segmentation`.

    Returns
    -------
    Volume
        The number of the segment that each voxel is in, 0 if none, and the segments' names.

    Raises
    ------
    InputError
        As of `read_segmentation`; or if segments overlap.
    """
    volume, names = _read(path, lambda names, _: list(names))
    inside = volume.array > 1 / 2  # fractional segments end at the half
    if (inside.sum(axis=-1) > 1).any():
        refuse(path.name, "Segments of the file overlap: give one without, or one with labels.")
    numbers = np.array([*names, 0])
    values = numbers[np.where(inside.any(axis=-1), inside.argmax(axis=-1), len(names))]
    return _volume(volume, values, names)


def _read(
    path: Path, choose: Callable[[Mapping[int, str], str], list[int]]
) -> tuple[Any, Mapping[int, str]]:
    """Highdicom's volume of the segments chosen, the last of its axes, and names of all."""
    highdicom = _highdicom(path.name)
    file = _find(path) if path.is_dir() else path
    header = _header(file)
    if not header.is_segmentation:
        refuse(
            file.name,
            f"This DICOM file is no segmentation (SEG), its modality is {header.modality}: "
            "give the SEG file, or export the mask as NIfTI, NRRD or MHA.",
        )
    _check_pixels(header, file)
    if not header.segments:
        refuse(file.name, "The file holds no segment: export the segmentation again.")
    segments = choose(header.segments, file.name)
    with _refusal(file.name):
        seg = highdicom.seg.segread(file)
        geometry = seg.get_volume_geometry(allow_missing_positions=True)
    if geometry is None:
        refuse(
            file.name,
            "The slices of the segmentation are not parallel and evenly spaced, or there are "
            "several frames in one place: export one volume.",
        )
    shape = tuple(geometry.spatial_shape)
    report(file.name, [check_size((*shape, len(segments))), check_dimensions(shape)])
    with _refusal(file.name):
        return seg.get_volume(segment_numbers=segments), header.segments


def _volume(volume: Any, values: NDArray[Any], names: Mapping[int, str] | None = None) -> Volume:
    """Highdicom's values (slice, row, column) in the index order (i, j, k) of other formats."""
    affine = np.asarray(volume.affine, dtype=np.float64)[:, [2, 1, 0, 3]]
    return Volume(values.transpose(2, 1, 0), affine, names or {})


def _highdicom(name: str) -> ModuleType:
    """The optional library."""
    try:
        import highdicom
    except ImportError:
        refuse(name, "Reading DICOM needs highdicom: pip install 'heartgen[dicom]'.")
    return highdicom


def _find(folder: Path) -> Path:
    """The only segmentation in a folder."""
    from pydicom.misc import is_dicom

    headers = {p: _header(p) for p in sorted(folder.iterdir()) if p.is_file() and is_dicom(p)}
    if not headers:
        refuse(str(folder), "There is no DICOM file in this folder: give the file of the mask.")
    found = [p for p, header in headers.items() if header.is_segmentation]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(p.name for p in found)
        refuse(str(folder), f"There are several segmentations in this folder, give one: {names}.")
    kinds = ", ".join(sorted({header.modality for header in headers.values()}))
    refuse(
        str(folder),
        f"There is no segmentation (SEG) among the DICOM files of this folder, only {kinds}: "
        "segment the myocardium, or export the mask as NIfTI, NRRD or MHA.",
    )


def _header(file: Path) -> _Header:
    """Read a DICOM file as far as its voxels."""
    from pydicom import dcmread
    from pydicom.filereader import read_file_meta_info

    with _refusal(file.name):
        deflated = read_file_meta_info(file).get("TransferSyntaxUID") == DEFLATED
    if deflated:
        refuse(file.name, "This DICOM file is deflated: export it without that compression.")
    with _refusal(file.name):
        read = dcmread(file, stop_before_pixels=True, specific_tags=HEADER_TAGS)
        modality = str(read.get("Modality") or "unknown")
        if str(read.get("SOPClassUID")) not in SEGMENTATIONS:
            return _Header(is_segmentation=False, modality=modality)
        names = {int(s.SegmentNumber): str(s.SegmentLabel) for s in read.SegmentSequence or ()}
        names.pop(0, None)  # the background of label maps
        return _Header(
            is_segmentation=True,
            modality=modality,
            shape=(int(read.Columns), int(read.Rows), int(read.NumberOfFrames)),
            bits=int(read.BitsAllocated),
            packed=read.file_meta.TransferSyntaxUID.is_compressed,
            placed=len(read.get("PerFrameFunctionalGroupsSequence") or ()),
            segments=names,
        )


def _check_pixels(header: _Header, file: Path) -> None:
    """Compare the declared number of voxels with the limit and with the size of the file."""
    report(file.name, [check_size(header.shape)])
    frames = header.shape[2]
    if header.placed not in (0, frames):
        refuse(
            file.name,
            f"The header contradicts itself, it declares {frames} frames and places "
            f"{header.placed}: export the segmentation again.",
        )
    needed = math.prod(header.shape) * header.bits // BITS
    held = file.stat().st_size
    if not header.packed and needed > held:
        refuse(
            file.name,
            f"The file is truncated, its header declares {needed:,} bytes of voxels and it has "
            f"{held:,} in all: copy or export it again.",
        )


def _choose(names: Mapping[int, str], label: Label | None, name: str) -> list[int]:
    """Numbers of the segments to read."""
    offered = ", ".join(describe_label(number, names) for number in names)
    if label is None:
        if len(names) == 1:
            return list(names)
        refuse(
            name,
            f"The file holds the segments {offered}: pass the myocardium's, by number or name, as "
            "label=... or --label, or say what they all are: read_labels or --labels.",
        )
    numbers, unknown = find_labels(label, names)
    unknown += [str(number) for number in numbers if number not in names]
    if unknown:
        refuse(
            name,
            f"There is no segment {' or '.join(unknown)} in the file, which holds {offered}: "
            "pass one of these as label=... or --label.",
        )
    return numbers


@contextmanager
def _refusal(name: str) -> Iterator[None]:
    """Turn whatever pydicom and highdicom raise about a damaged file into an `InputError`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except Exception as error:  # they raise any kind
        refuse(name, f"The DICOM file is damaged ({error}): export the segmentation again.")
