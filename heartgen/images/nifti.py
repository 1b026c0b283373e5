"""NIfTI images, whose headers may place the voxels in the world twice.

Read with nibabel: SimpleITK fills up a truncated NIfTI with whatever memory holds, knows no
NIfTI-2, and without a word takes the other transform where it does not like the first.
"""

from __future__ import annotations

import gzip
import zlib
from pathlib import Path
from typing import IO, Any, cast

import numpy as np
from numpy.typing import NDArray

from heartgen.images.checks import (
    check_data_type,
    check_dimensions,
    check_size,
    describe_sizes,
    report,
)
from heartgen.images.file_kinds import VOXELS, described_by, refuse
from heartgen.images.headers import Declared, check_file_size
from heartgen.images.mask import Finding
from heartgen.images.volume import LPS_FROM_RAS, Volume

MM = {"unknown": 1.0, "mm": 1.0, "meter": 1000.0, "micron": 0.001}
"""NIfTI's units of length in mm; where none is given, mm is meant."""

SAME_PLACE = 0.1
"""Distance, in voxels, within which two transforms put the corners of an image in one place."""

SAME_SIZE = 1e-3
"""Relative difference of two voxel sizes that is still rounding: transforms are float32."""


def read_nifti(path: Path) -> Volume:
    """Read a NIfTI-1 or NIfTI-2 image.

    Parameters
    ----------
    path : Path
        A .nii or .nii.gz file, or either file of a pair.

    Returns
    -------
    Volume
        Values with the header's scaling applied, frames last. The affine is the sform if the
        header has one, else the qform; with neither the voxel axes are taken for L, P, S, as ITK
        does.

    Raises
    ------
    InputError
        If the file is damaged, is no image of real numbers in three dimensions, or its two
        transforms differ in more than position.
    """
    from nibabel.spatialimages import HeaderDataError

    header = _header(path)
    shape, dtype = _layout(header, path.name)
    report(path.name, [check_size(shape)])
    report(path.name, [check_dimensions(shape), check_data_type(dtype)])
    # Hostile numbers overflow; the checks of the affine and for infinity report what comes of it.
    with np.errstate(all="ignore"):
        affine, findings = _placement(header, shape, path.name)
    file = _voxel_file(path)
    declared = Declared(
        shape, dtype.itemsize, file, packed=_is_packed(file), skip=_offset(header, path)
    )
    check_file_size(declared, path.name)
    try:
        with np.errstate(all="ignore"), _open(file) as stream:
            values = header.data_from_fileobj(stream)
    except (HeaderDataError, EOFError, OSError, ValueError, zlib.error) as error:
        refuse(path.name, f"The voxels cannot be read ({error}): export the mask again.")
    return Volume(values.reshape(*shape[:3], -1), affine, findings=findings)


def check_transforms(
    sform: NDArray[np.float64] | None,
    qform: NDArray[np.float64] | None,
    spacing: NDArray[np.float64],
    shape: tuple[int, ...],
) -> Finding | None:
    """Sform, qform and voxel size of a NIfTI header must describe one heart.

    Parameters
    ----------
    sform : (4, 4) float64 or None
        Voxel index to world, mm, RAS.
    qform : (4, 4) float64 or None
        The same by the quaternion.
    spacing : (3,) float64
        Voxel size by the header, mm.
    shape : tuple of int
        Of the array.
    """
    if sform is None or not np.isfinite(sform).all():
        return None
    size = np.linalg.norm(sform[:3, :3], axis=0)
    if not np.allclose(size, spacing, rtol=SAME_SIZE, atol=0):
        return Finding(
            "transforms",
            f"The header gives two voxel sizes, {describe_sizes(size)} mm by its sform and "
            f"{describe_sizes(spacing)} mm by its pixdim: correct the wrong one.",
            fatal=True,
        )
    if qform is None:
        return None
    if np.linalg.det(sform) * np.linalg.det(qform) < 0:
        return Finding(
            "transforms",
            "The sform and the qform of the header are mirror images of each other: "
            "correct the wrong one, or set its code to 0.",
            fatal=True,
        )
    corners = np.array(np.meshgrid(*[(0, n - 1) for n in shape[:3]])).reshape(3, -1)
    apart = float(
        np.linalg.norm((sform - qform)[:3] @ np.vstack([corners, np.ones(8)]), axis=0).max()
    )
    if apart <= SAME_PLACE * spacing.min():
        return None
    return Finding(
        "transforms",
        f"The sform and the qform of the header place the image up to {apart:.3g} mm apart: "
        "the sform was used; the shape of the heart does not depend on it.",
    )


def _header(path: Path) -> Any:
    """The NIfTI header, unchecked: nibabel's own check mends voxel sizes without a word."""
    from nibabel.nifti1 import Nifti1Header
    from nibabel.nifti2 import Nifti2Header

    try:
        with _open(described_by(path)) as stream:
            block = stream.read(Nifti2Header.template_dtype.itemsize)
    except (EOFError, OSError, zlib.error) as error:
        refuse(path.name, f"The compression is damaged ({error}): copy or export the file again.")
    kind: Any = Nifti2Header if block[4:6] in (b"n+", b"ni") else Nifti1Header
    length = kind.template_dtype.itemsize
    if len(block) < length:
        refuse(path.name, "The file is truncated in its header: copy or export it again.")
    return kind(block[:length], check=False)


def _layout(header: Any, name: str) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Number of voxels along each axis and their type."""
    from nibabel.spatialimages import HeaderDataError

    try:
        return tuple(map(int, header.get_data_shape())), header.get_data_dtype()
    except (HeaderDataError, KeyError):
        code = int(header["datatype"])
        refuse(name, f"The header is damaged (voxels of type {code}): export the mask again.")


def _offset(header: Any, path: Path) -> int:
    """Byte at which the voxels begin."""
    offset = float(header["vox_offset"])
    first = 0 if _voxel_file(path) != described_by(path) else int(header["sizeof_hdr"])
    if not first <= offset < np.inf:
        refuse(
            path.name,
            f"The header is damaged, its voxels begin at byte {offset:g}: export the mask again.",
        )
    return int(offset)


def _placement(
    header: Any, shape: tuple[int, ...], name: str
) -> tuple[NDArray[np.float64], tuple[Finding, ...]]:
    """Voxel index to world, mm, LPS, and what there is to say about it."""
    from nibabel.spatialimages import HeaderDataError

    spacing = np.asarray(header["pixdim"][1:4], dtype=np.float64)
    if not (np.isfinite(spacing) & (spacing > 0)).all():
        refuse(
            name,
            f"The header declares a voxel size of {describe_sizes(spacing)} mm, "
            "which is not positive: correct it.",
        )
    if header["pixdim"][0] == 0:
        header["pixdim"][0] = 1  # which is how the standard reads it
    sform, _ = header.get_sform(coded=True)
    try:
        qform, _ = header.get_qform(coded=True)
        to_mm = MM[header.get_xyzt_units()[0]]
    except (HeaderDataError, KeyError, ValueError) as error:
        refuse(name, f"The header is damaged ({error}): write it again with the tool it is from.")
    to_lps = LPS_FROM_RAS * [[to_mm], [to_mm], [to_mm], [1.0]]
    sform = None if sform is None else to_lps * sform
    qform = None if qform is None else to_lps * qform
    spacing = to_mm * spacing
    if sform is None and qform is None:
        finding = Finding(
            "placement",
            "The header does not say where the image lies: its axes were taken for left, "
            "posterior, superior; the shape of the heart does not depend on it.",
        )
        return np.diag([*spacing, 1.0]), (finding,)
    mismatch = check_transforms(sform, qform, spacing, shape)
    affine = qform if sform is None else sform
    return np.asarray(affine), () if mismatch is None else (mismatch,)


def _voxel_file(path: Path) -> Path:
    """The file with the voxels: the second of a pair, else the only one."""
    if path.suffix.lower() != ".hdr":
        return path
    for ending in (*VOXELS, *(e.upper() for e in VOXELS)):
        if path.with_suffix(ending).is_file():
            return path.with_suffix(ending)
    refuse(path.name, "The .img file that belongs to this .hdr is missing: put it beside it.")


def _is_packed(path: Path) -> bool:
    """Whether a file is gzip-compressed, by its name."""
    return path.suffix.lower() == ".gz"


def _open(path: Path) -> IO[bytes]:
    """Open a file that may be gzip-compressed."""
    return cast(IO[bytes], gzip.open(path)) if _is_packed(path) else path.open("rb")
