"""Which hearts are in what was uploaded: one in a file or folder, or one in each of several."""

from __future__ import annotations

import lzma
import shutil
import zipfile
import zlib
from pathlib import Path
from typing import Any

from heartgen.errors import InputError
from heartgen.widgets.transfer import safe_name

ZIP = ".zip"

MOST_BYTES = 4_000_000_000
"""Of all that is unpacked from one archive."""

MOST_FILES = 5000
"""Of one archive: a series of DICOM slices has hundreds."""

DAMAGES = (
    *(zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError),
    *(OSError, RuntimeError, NotImplementedError, ValueError),
)
"""What a damaged archive, or one of another kind, ends in."""


def hearts_in(path: Path) -> list[Path]:
    """The files or folders that are each a heart.

    Parameters
    ----------
    path : Path
        A file, an archive, or a folder of files.

    Returns
    -------
    list of Path
        One for a DICOM series and for a folder with a file for each structure; else one for each
        image, by name.

    Raises
    ------
    InputError
        If an archive cannot be unpacked, or there is no image.
    """
    if path.is_file() and path.suffix.lower() == ZIP:
        path = unpacked(path)
    if not path.is_dir():
        return [path]
    return _hearts_under(path) or [path]  # reading it says that there is no image


def _hearts_under(folder: Path) -> list[Path]:
    """Hearts of a folder, and of those in it."""
    from heartgen.images.file_kinds import ENDINGS
    from heartgen.images.folder import PAIRED, is_one_heart, structure_files

    for archive in [file for file in _files(folder) if file.suffix.lower() == ZIP]:
        unpacked(archive)
    files = _files(folder)
    folders = sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
    inside = [heart for each in folders for heart in _hearts_under(each)]
    endings = tuple(ending for ending in ENDINGS if ending not in PAIRED)
    images = [file for file in files if file.name.lower().endswith(endings)]
    if files and not images and not inside:  # DICOM files often have no ending
        return [folder]
    if structure_files(folder) and is_one_heart(folder):
        return [folder, *inside]
    return [*images, *inside]


def may_have_frames(path: Path) -> bool:
    """Whether there may be frames to choose from: in an image of four dimensions, or in DICOM.

    Parameters
    ----------
    path : Path
        A file or folder.
    """
    from SimpleITK import ImageFileReader

    make: Any = ImageFileReader
    reader = make()
    reader.SetFileName(str(path))
    try:
        reader.ReadImageInformation()
    except RuntimeError:  # a folder, or no image: reading says more
        return True
    return int(reader.GetDimension()) > 3 or path.suffix.lower() == ".dcm"


def unpacked(path: Path) -> Path:
    """Unpack an archive beside itself, and remove it.

    Parameters
    ----------
    path : Path
        The archive.
    """
    folder = path.with_suffix("")
    try:
        with zipfile.ZipFile(path) as archive:
            infos = [info for info in archive.infolist() if _is_of_use(info.filename)]
            if sum(i.file_size for i in infos) > MOST_BYTES or len(infos) > MOST_FILES:
                raise InputError(f"{path.name}: This archive holds too much: send less at once.")
            for info in infos:
                info.filename = "/".join(map(safe_name, info.filename.split("/")))
                archive.extract(info, folder)  # never outside of it
    except DAMAGES as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise InputError(
            f"{path.name}: This archive cannot be unpacked ({error}): pack it again as plain zip."
        ) from error
    if not folder.is_dir():
        raise InputError(f"{path.name}: There is nothing in this archive.")
    path.unlink()
    return folder


def _is_of_use(name: str) -> bool:
    """Whether a member is a file that somebody put there, not one of the system."""
    parts = name.split("/")
    hidden = any(part.startswith((".", "__MACOSX")) for part in parts if part)
    return not hidden and not name.endswith("/")


def _files(folder: Path) -> list[Path]:
    return sorted(p for p in folder.iterdir() if p.is_file() and not p.name.startswith("."))
