"""DICOM segmentations (SEG), read with highdicom, and structure sets (RTSTRUCT)."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from heartgen.errors import InputError
from heartgen.images.checks import check_dimensions, check_size, report
from heartgen.images.cine import Moments, find_moments, one_moment
from heartgen.images.file_kinds import refuse
from heartgen.images.repairs import MARGIN
from heartgen.images.rtstruct import structure_set
from heartgen.images.structures import Structures
from heartgen.images.volume import Coded, Volume

SEGMENTATIONS = ("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7")
"""SOP classes Segmentation Storage and Label Map Segmentation Storage (DICOM PS3.6)."""

LABEL_MAP = SEGMENTATIONS[1]

STRUCTURE_SET = "1.2.840.10008.5.1.4.1.1.481.3"
"""SOP class RT Structure Set Storage (DICOM PS3.6)."""

DEFLATED = "1.2.840.10008.1.2.1.99"
"""Transfer syntax that packs the whole file, so that its size is only known when it is unpacked."""

BITS = 8
"""Bits of a byte; the voxels of a binary segmentation take one each."""

HEADER_TAGS = [
    "BitsAllocated",
    "Columns",
    "DimensionIndexSequence",
    "Modality",
    "NumberOfFrames",
    "PerFrameFunctionalGroupsSequence",
    "Rows",
    "SegmentSequence",
    "SOPClassUID",
]
"""What is read of a file before its voxels."""


CODES = (
    ("SegmentedPropertyTypeCodeSequence", "SegmentedPropertyTypeModifierCodeSequence"),
    ("AnatomicRegionSequence", "AnatomicRegionModifierSequence"),
)
"""Where the codes of a segment stand, and those that modify them."""


@dataclass(frozen=True)
class _Header:
    """What a DICOM file says before its voxels."""

    kind: str | None  # SEG, RTSTRUCT, or neither
    modality: str
    shape: tuple[int, ...] = ()  # columns, rows, frames
    bits: int = 0  # of a voxel
    packed: bool = False
    placed: int = 0  # frames with a position of their own
    segments: Mapping[int, str] = field(default_factory=dict)
    codes: Mapping[int, Coded] = field(default_factory=dict)
    moments: Moments = ((),)
    labels: bool = False  # a frame shows all segments


def read_structures(path: Path) -> Structures:
    """Read which structures a DICOM file holds.

    Parameters
    ----------
    path : Path
        A segmentation (SEG) or structure set (RTSTRUCT), or a folder with one of these among its
        files.

    Returns
    -------
    Structures
        Their voxels are read when they are asked for.

    Raises
    ------
    InputError
        If there is none, or not one only, or it is damaged; or if highdicom is not installed.
    """
    highdicom = _highdicom(path.name)
    file = _find(path) if path.is_dir() else path
    header = _header(file)
    if header.kind is None:
        refuse(
            file.name,
            "This DICOM file is no segmentation (SEG) and no structure set (RTSTRUCT), its "
            f"modality is {header.modality}: give one of these, or export the mask as NIfTI, NRRD "
            "or MHA.",
        )
    if header.kind == "RTSTRUCT":
        from pydicom import dcmread

        with _refusal(file.name):
            return structure_set(dcmread(file), file.name)
    _check_pixels(header, file)
    if not header.segments:
        refuse(file.name, "The file holds no segment: export the segmentation again.")

    def load(numbers: Sequence[int], frame: int) -> Volume:
        return _segments(highdicom, file, header, numbers, frame)

    return Structures(file.name, header.segments, load, header.codes, len(header.moments))


def _segments(
    highdicom: ModuleType, file: Path, header: _Header, numbers: Sequence[int], frame: int
) -> Volume:
    """Layers of the segments asked for, in the index order (i, j, k) of other formats."""
    with _refusal(file.name):
        if len(header.moments) == 1:
            seg = highdicom.seg.segread(file)
        else:
            alone = one_moment(file, header.moments[frame])
            seg = highdicom.seg.Segmentation.from_dataset(alone, copy=False)
        geometry = seg.get_volume_geometry(allow_missing_positions=True)
    if geometry is None:
        refuse(
            file.name,
            "The slices of the segmentation are not parallel and evenly spaced: export one volume.",
        )
    shape = tuple(geometry.spatial_shape)
    report(file.name, [check_size((*shape, len(numbers))), check_dimensions(shape)])
    with _refusal(file.name):
        volume = seg.get_volume(segment_numbers=list(numbers))
    affine = np.asarray(volume.affine, dtype=np.float64)[:, [2, 1, 0, 3]]
    layers = Volume(volume.array.transpose(2, 1, 0, 3), affine)
    return layers if _is_whole(header, layers, frame) else _with_ends(layers)


def _is_whole(header: _Header, layers: Volume, frame: int) -> bool:
    """Whether the file holds frames in which there is nothing, and so all of the image.

    Most writers leave those out: that segments reach the first slice of the file then does not say
    that they reach that of the image.
    """
    filled = np.asarray(layers.values.any(axis=(0, 1)))  # planes by segments
    several = 1 if header.labels else len(header.segments)
    complete = len(header.moments[frame]) >= len(filled) * several
    empty = not (filled.any(axis=1) if header.labels else filled).all()
    return complete and empty


def _with_ends(volume: Volume) -> Volume:
    """Empty slices before the first and after the last."""
    affine = volume.affine.copy()
    affine[:3, 3] -= MARGIN * affine[:3, 2]
    widths = [(0, 0), (0, 0), (MARGIN, MARGIN), (0, 0)]
    return replace(volume, values=np.pad(volume.values, widths), affine=affine)


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
    found = [p for p, header in headers.items() if header.kind is not None]
    if len(found) == 1:
        return found[0]
    if found:
        names = ", ".join(p.name for p in found)
        refuse(str(folder), f"There are several segmentations in this folder, give one: {names}.")
    kinds = ", ".join(sorted({header.modality for header in headers.values()}))
    refuse(
        str(folder),
        "There is no segmentation (SEG) and no structure set (RTSTRUCT) among the DICOM files of "
        f"this folder, only {kinds}: "
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
        form = str(read.get("SOPClassUID"))
        if form not in SEGMENTATIONS:
            return _Header("RTSTRUCT" if form == STRUCTURE_SET else None, modality)
        segments = {int(s.SegmentNumber): s for s in read.SegmentSequence or ()}
        segments.pop(0, None)  # the background of label maps
        return _Header(
            kind="SEG",
            modality=modality,
            shape=(int(read.Columns), int(read.Rows), int(read.NumberOfFrames)),
            bits=int(read.BitsAllocated),
            packed=read.file_meta.TransferSyntaxUID.is_compressed,
            placed=len(read.get("PerFrameFunctionalGroupsSequence") or ()),
            segments={number: str(s.SegmentLabel) for number, s in segments.items()},
            codes={number: _coded(s) for number, s in segments.items()},
            moments=find_moments(read, file.name),
            labels=form == LABEL_MAP,
        )


def _coded(segment: Any) -> Coded:
    """Codes of a segment's type, of what modifies it, and of the region it is in."""
    found = []
    for key, modifier in CODES:
        for item in segment.get(key) or ():
            found += [item, *(item.get(modifier) or ())]
    values = tuple(str(code.get("CodeValue")) for code in found)
    return Coded(values, tuple(str(code.get("CodeMeaning") or "") for code in found))


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


@contextmanager
def _refusal(name: str) -> Iterator[None]:
    """Turn whatever pydicom and highdicom raise about a damaged file into an `InputError`."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:  # they raise any kind
        refuse(name, f"The DICOM file is damaged ({error}): export the segmentation again.")
