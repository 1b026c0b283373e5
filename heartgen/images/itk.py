"""NRRD, MetaImage and every other volume format that SimpleITK reads."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.images.checks import check_data_type, check_dimensions, check_size, report
from heartgen.images.file_kinds import refuse
from heartgen.images.headers import check_file_size, meta_header, nrrd_header
from heartgen.images.slicer import layered, segments_of
from heartgen.images.structures import Structures
from heartgen.images.volume import Volume

HEADERS = {"NRRD image": nrrd_header, "MetaImage": meta_header}
"""Formats whose headers are read before SimpleITK sees them."""

SPACING = {"NRRD image": "space directions or spacings", "MetaImage": "ElementSpacing"}
"""Fields of their headers that give the voxel size."""

PICTURES = ("BMP", "JPEG", "JPEG2000", "LSM", "PNG", "TIFF")
"""Formats that SimpleITK reads but that hold no voxel size in mm."""

STDERR = 2
"""File descriptor that C++ libraries write their complaints to."""

_stderr_lock = threading.Lock()  # a file descriptor belongs to all threads


def read_itk(path: Path, form: str) -> Volume | Structures:
    """Read an image through SimpleITK.

    Parameters
    ----------
    path : Path
        The file; for a detached header, the header.
    form : str
        Its format, as `heartgen.images.file_kinds.identify` names it.

    Returns
    -------
    Volume or Structures
        Values, frames last, and affine; from 3D Slicer's segmentations also the names of the
        labels, or structures if segments overlap.

    Raises
    ------
    InputError
        If the file is damaged or is no image of real numbers in three dimensions.
    """
    declared = None
    if form in HEADERS:
        declared = HEADERS[form](path)
        check_file_size(declared, path.name)
    reader = _reader(path)
    shape = reader.GetSize()
    report(path.name, [check_size(shape)])
    components = reader.GetNumberOfComponents()
    listed = declared is not None and declared.layered and components > 1
    kind = _data_type(reader)
    report(path.name, [check_dimensions(shape), None if listed else check_data_type(kind)])
    values_read = math.prod(shape) * (components if listed else 1)
    if declared is not None and values_read > declared.values:
        refuse(path.name, "The header contradicts itself about the size: export the mask again.")
    if declared is not None and not declared.spaced:
        refuse(
            path.name,
            "The header does not say how large the voxels are, and the size of the heart depends "
            f"on it: write {SPACING[form]} in mm into it.",
        )
    with silence(), _refusal(path.name):
        image = reader.Execute()
    values, affine = placed(image)
    values = np.moveaxis(values, 0, -1) if listed else values.reshape(*shape[:3], -1, order="F")
    with np.errstate(all="ignore"):  # what overflows here is refused by the check of the affine
        affine[:3] *= 1.0 if declared is None else declared.unit
    segments = segments_of(_metadata(reader))
    if listed and segments:
        return layered(segments, values, affine, path.name)
    names = {segment.value: segment.name for segment in segments}
    codes = {segment.value: segment.coded for segment in segments}
    return Volume(values, affine, names, label_codes=codes)


def placed(image: Any) -> tuple[NDArray[Any], NDArray[np.float64]]:
    """Voxels of an image of SimpleITK, index order (i, j, k), and its affine to our world, LPS.

    Parameters
    ----------
    image : SimpleITK.Image
        Of three axes, or of more, of which the first three lead to the world.

    Returns
    -------
    values : (nx, ny, nz) of any type
        With further axes behind; numbers of one voxel, if there are several, come first.
    affine : (4, 4) float64
        Voxel index to world coordinates, in the unit of the image, LPS.
    """
    n = image.GetDimension()
    affine = np.eye(4)
    axes = np.reshape(image.GetDirection(), (n, n))[:3, :3]
    with np.errstate(all="ignore"):  # what overflows here is refused by the check of the affine
        affine[:3, :3] = axes * image.GetSpacing()[:3]
        affine[:3, 3] = image.GetOrigin()[:3]
    return import_module("SimpleITK").GetArrayFromImage(image).T, affine


def _reader(path: Path) -> Any:
    """SimpleITK's reader of a file, which has read what is before the voxels."""
    sitk = import_module("SimpleITK")
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    with silence(), _refusal(path.name):
        library = sitk.ImageFileReader.GetImageIOFromFileName(str(path)).removesuffix("ImageIO")
        if library and library not in PICTURES:
            reader.ReadImageInformation()
    if not library:
        refuse(path.name, "This is no image heartgen can read: save the mask as NIfTI or NRRD.")
    if library in PICTURES:
        refuse(
            path.name,
            f"This is a {library} picture, which holds no voxel size in mm: "
            "save the mask as NIfTI, NRRD or MHA.",
        )
    return reader


def _data_type(reader: Any) -> np.dtype[Any]:
    """Type of a voxel; several numbers per voxel count as a structure."""
    kind = import_module("SimpleITK").GetPixelIDValueAsString(reader.GetPixelID())
    if kind.startswith("complex"):
        return np.dtype(np.complex64)
    return np.dtype("V1" if kind.startswith("vector") else np.float64)


def _metadata(reader: Any) -> dict[str, str]:
    """What the header says about segments; bytes that are no letters are replaced."""
    keys = [k for k in reader.GetMetaDataKeys() if k.startswith("Segment") and k.isascii()]
    raw = {key: reader.GetMetaData(key).encode("utf-8", "surrogateescape") for key in keys}
    return {key: value.decode("utf-8", "replace") for key, value in raw.items()}


@contextmanager
def _refusal(name: str) -> Iterator[None]:
    """Turn what SimpleITK raises into an `InputError` with the last thing it says."""
    try:
        yield
    except (RuntimeError, MemoryError) as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        said = lines[-1] if lines else "no reason given"
        refuse(name, f"SimpleITK cannot read the file ({said}): export the mask again.")


@contextmanager
def silence() -> Iterator[None]:
    """Keep the messages of ITK's C++ off the terminal: what matters also comes as an exception."""
    process = import_module("SimpleITK").ProcessObject
    with _stderr_lock, open(os.devnull, "wb") as nowhere:
        shown = process.GetGlobalWarningDisplay()
        process.GlobalWarningDisplayOff()
        try:
            terminal = os.dup(STDERR)
        except OSError:  # a program without a terminal
            terminal = None
        try:
            if terminal is not None:
                os.dup2(nowhere.fileno(), STDERR)
            yield
        finally:
            if terminal is not None:
                os.dup2(terminal, STDERR)
                os.close(terminal)
            process.SetGlobalWarningDisplay(shown)
