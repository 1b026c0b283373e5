"""Masks and other images out to files that any viewer opens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK
from numpy.typing import NDArray

from heartgen.errors import FileError, InputError
from heartgen.files import replacing
from heartgen.images.itk import silence
from heartgen.images.mask import Mask

ENDINGS = (".nii", ".nii.gz", ".nrrd", ".mha")
"""How names of images may end."""


def write_mask(mask: Mask, path: str | Path) -> None:
    """Write a mask as an image of 0 and 1; otherwise as `write_image`.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    path : path
        Ends in one of `ENDINGS`.
    """
    write_image(mask.voxels.astype(np.uint8), mask.affine, path)


def check_image_name(path: Path) -> None:
    """Refuse a name that no image can have.

    Parameters
    ----------
    path : Path
        Where the image is to be written.
    """
    if not path.name.lower().endswith(ENDINGS):
        raise InputError(
            f"{path}: An image cannot be written in this format: end the name in "
            f"{', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}."
        )


def write_image(values: NDArray[np.generic], affine: NDArray[np.float64], path: str | Path) -> None:
    """Write an image, compressed; the file is read again, and appears whole or not at all.

    Parameters
    ----------
    values : (nx, ny, nz) uint8 or float32
        Voxel values.
    affine : (4, 4) float64
        Voxel index to world coordinates, mm, LPS; no shear.
    path : path
        Ends in one of `ENDINGS`.

    Raises
    ------
    InputError
        If the name ends otherwise.
    FileError
        If the file cannot be written; an earlier one is then untouched.
    """
    check_image_name(Path(path))
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    image: Any = SimpleITK.GetImageFromArray(np.ascontiguousarray(values.transpose(2, 1, 0)))
    image.SetSpacing(spacing.tolist())
    image.SetOrigin(affine[:3, 3].tolist())
    image.SetDirection((affine[:3, :3] / spacing).ravel().tolist())
    with replacing(path) as temporary:
        _write(image, temporary, path)


def _write(image: Any, temporary: Path, path: str | Path) -> None:
    """Write an image and read it again: on a full disk, libraries cut files off and say nothing."""
    try:
        with silence():
            SimpleITK.WriteImage(image, str(temporary), useCompression=True)
            found: Any = SimpleITK.ReadImage(str(temporary))
        whole = np.array_equal(
            SimpleITK.GetArrayViewFromImage(found), SimpleITK.GetArrayViewFromImage(image)
        )
    except RuntimeError:  # all that SimpleITK says of any trouble
        whole = False
    if not whole:
        raise FileError(
            f"{path}: The file cannot be written whole: choose a folder with free space in which "
            "you may write."
        )
