"""From a file or an array to a checked mask: `read_mask` and `mask_from_array`."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.images.checks import (
    check_affine,
    check_background,
    check_data_type,
    check_dimensions,
    check_empty,
    check_extent,
    check_finite,
    check_scale,
    check_size,
    report,
)
from heartgen.images.dicom import read_segmentation
from heartgen.images.files import identify, refuse
from heartgen.images.itk import read_itk
from heartgen.images.labels import myocardium
from heartgen.images.mask import Mask
from heartgen.images.nifti import read_nifti
from heartgen.images.repairs import keep_largest, pad_border
from heartgen.images.volume import LPS_FROM_RAS, Label, Volume


def read_mask(path: str | PathLike[str], *, label: Label | None = None) -> Mask:
    """Read and check a mask of the myocardium.

    Parameters
    ----------
    path : path-like
        NIfTI, NRRD, MetaImage or any other volume that SimpleITK reads; or a DICOM segmentation
        (SEG), as a file or as the folder it is in.
    label : int, str, or sequence of them, optional
        What is myocardium in a label image or a segmentation, by number or by name; several are
        united. Not needed if the image is binary: 0 and one other value.

    Returns
    -------
    Mask
        In one piece, with background around it, its `findings` saying what was mended.

    Raises
    ------
    InputError
        If no heart can be meshed from the file; the message names every reason that was found.
    """
    file = Path(path)
    form = identify(file)
    try:
        if form.startswith("DICOM"):
            return _checked(read_segmentation(file, label), None, file.resolve().name)
        volume = read_nifti(file) if form.startswith("NIfTI") else read_itk(file, form)
        return _checked(volume, label, file.name)
    except MemoryError:
        refuse(file.name, "The image is too large for this machine's memory: crop it to the heart.")


def mask_from_array(
    voxels: ArrayLike,
    affine: ArrayLike,
    *,
    name: str = "mask",
    label: Label | None = None,
    frame: Literal["LPS", "RAS"] = "LPS",
) -> Mask:
    """Check an array and take it for a mask of the myocardium.

    Parameters
    ----------
    voxels : (nx, ny, nz) array-like
        Binary, or labels.
    affine : (4, 4) array-like
        Voxel index to world coordinates, mm.
    name : str
        Name for reports.
    label : int, or sequence of int, optional
        What is myocardium in a label image.
    frame : {"LPS", "RAS"}
        Frame of the world `affine` leads to; nibabel's and NIfTI's affines are RAS.

    Returns
    -------
    Mask
        In one piece, with background around it, its `findings` saying what was mended.

    Raises
    ------
    InputError
        If no heart can be meshed from the array; the message names every reason that was found.
    """
    world = _matrix(affine, name)
    if frame not in ("LPS", "RAS"):
        refuse(name, f"The frame {frame!r} is unknown: give 'LPS' or 'RAS'.")
    if frame == "RAS" and world.shape == (4, 4):
        world = LPS_FROM_RAS * world
    return _checked(Volume(np.asarray(voxels), world), label, name)


def _checked(volume: Volume, label: Label | None, name: str) -> Mask:
    """The mask in a volume, once every check has seen it."""
    shape = volume.values.shape
    report(name, [check_size(shape), check_dimensions(shape), check_data_type(volume.values.dtype)])
    values = volume.values.reshape(shape[:3])
    findings = [*volume.findings, check_affine(volume.affine), check_finite(values)]
    voxels = None
    if findings[-1] is None:
        voxels, untold = myocardium(values, label, volume.label_names)
        findings.append(untold)
    if voxels is not None:
        findings += [check_empty(voxels), check_background(voxels), check_extent(voxels)]
    seen = report(name, findings)
    assert voxels is not None  # else one of the findings was fatal
    mask = Mask(np.ascontiguousarray(voxels), volume.affine, name)
    mask, dropped = keep_largest(mask)
    scale = check_scale(mask.voxels, mask.affine)
    seen += report(name, [dropped, check_extent(mask.voxels), scale])
    mask, padded = pad_border(mask)
    return replace(mask, findings=seen + report(name, [padded]))


def _matrix(affine: ArrayLike, name: str) -> NDArray[np.float64]:
    """An affine as an array of its own."""
    try:
        return np.array(affine, dtype=np.float64)
    except (TypeError, ValueError):
        refuse(name, "The affine is not a matrix of numbers: give the 4 x 4 voxel-to-world matrix.")
