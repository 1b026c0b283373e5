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

from heartgen.images.checks import check_data_type, check_dimensions, check_size, report
from heartgen.images.files import refuse
from heartgen.images.headers import check_file_size, meta_header, nrrd_header
from heartgen.images.volume import Volume

HEADERS = {"NRRD image": nrrd_header, "MetaImage": meta_header}
"""Formats whose headers are read before SimpleITK sees them."""

PICTURES = ("BMP", "JPEG", "JPEG2000", "LSM", "PNG", "TIFF")
"""Formats that SimpleITK reads but that hold no voxel size in mm."""

STDERR = 2
"""File descriptor that C++ libraries write their complaints to."""

_stderr_lock = threading.Lock()  # a file descriptor belongs to all threads


def read_itk(path: Path, form: str) -> Volume:
    """Read an image through SimpleITK.

    Parameters
    ----------
    path : Path
        The file; for a detached header, the header.
    form : str
        Its format, as `heartgen.images.files.identify` names it.

    Returns
    -------
    Volume
        Values and affine; from 3D Slicer's segmentations also the names of the labels.

    Raises
    ------
    InputError
        If the file is damaged or is no three-dimensional image of real numbers.
    """
    sitk = import_module("SimpleITK")
    values_declared = math.inf
    if form in HEADERS:
        declared = HEADERS[form](path)
        check_file_size(declared, path.name)
        values_declared = declared.values
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
    shape = reader.GetSize()
    report(path.name, [check_size(shape)])
    report(path.name, [check_dimensions(shape), check_data_type(_data_type(reader))])
    if math.prod(shape) > values_declared:
        refuse(path.name, "The header contradicts itself about the size: export the mask again.")
    with silence(), _refusal(path.name):
        image = reader.Execute()
    values = sitk.GetArrayFromImage(image).T.reshape(shape[:3], order="F")
    n = len(shape)
    affine = np.eye(4)
    axes = np.reshape(image.GetDirection(), (n, n))[:3, :3]
    with np.errstate(all="ignore"):  # what overflows here is refused by the check of the affine
        affine[:3, :3] = axes * image.GetSpacing()[:3]
    affine[:3, 3] = image.GetOrigin()[:3]
    return Volume(values, affine, _label_names(reader))


def _data_type(reader: Any) -> np.dtype[Any]:
    """Type of a voxel; several numbers per voxel count as a structure."""
    kind = import_module("SimpleITK").GetPixelIDValueAsString(reader.GetPixelID())
    if kind.startswith("complex"):
        return np.dtype(np.complex64)
    return np.dtype("V1" if kind.startswith("vector") else np.float64)


def _label_names(reader: Any) -> dict[int, str]:
    """Names of the label values in a segmentation by 3D Slicer (.seg.nrrd)."""
    keys = set(reader.GetMetaDataKeys())
    names = {}
    for key in keys:
        value_key = key.removesuffix("_Name") + "_LabelValue"
        if key.startswith("Segment") and key.endswith("_Name") and value_key in keys:
            value = reader.GetMetaData(value_key)
            if value.isdecimal():
                names[int(value)] = reader.GetMetaData(key)
    return names


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
