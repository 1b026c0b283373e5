"""From a path to what the file holds: voxel values, or named structures."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from heartgen.images.dicom import read_structures
from heartgen.images.file_kinds import FOLDER, identify, refuse
from heartgen.images.folder import folder_structures, structure_files
from heartgen.images.itk import read_itk
from heartgen.images.nifti import read_nifti
from heartgen.images.structures import Structures
from heartgen.images.volume import Volume


def open_image(path: Path) -> Volume | Structures:
    """Read what a file or a folder holds.

    Parameters
    ----------
    path : Path
        A file of any format that is read, a folder of DICOM files, or one with a file for each
        structure.

    Returns
    -------
    Volume or Structures

    Raises
    ------
    InputError
        If it cannot be read.
    """
    form = identify(path)
    if form == FOLDER and structure_files(path):
        return folder_structures(path, _volume)
    if form == FOLDER or form.startswith("DICOM"):
        return read_structures(path)
    return read_nifti(path) if form.startswith("NIfTI") else read_itk(path, form)


def name_of(path: Path) -> str:
    """Name for reports, also of the folder one is in.

    Parameters
    ----------
    path : Path
        A file or a folder.
    """
    try:
        return path.resolve().name if path.is_dir() else path.name
    except (OSError, ValueError):  # a path that cannot be; who opens it says so
        return path.name


@contextmanager
def enough_memory(path: Path) -> Iterator[None]:
    """Say so if an image is too large for this machine.

    Parameters
    ----------
    path : Path
        Of the image, for the message.
    """
    try:
        yield
    except MemoryError:
        refuse(path.name, "The image is too large for this machine's memory: crop it to the heart.")


def _volume(path: Path) -> Volume:
    """Voxel values of a file for one structure."""
    held = open_image(path)
    if isinstance(held, Structures):
        refuse(path.name, "The file holds several structures: give it by itself.")
    frames = held.values.shape[3:]
    if frames not in ((), (1,)):
        refuse(path.name, "The file holds several frames: save the one you want by itself.")
    return held
