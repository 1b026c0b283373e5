"""What a file is, by its first bytes and by its name: the two must agree."""

from __future__ import annotations

import zlib
from pathlib import Path
from typing import NoReturn

from heartgen.errors import InputError, MissingFileError, UnreadableFileError

HEAD = 352
"""Bytes of a file that are looked at: a NIfTI-1 header, the longest way to a signature."""

PACKED_HEAD = 4096
"""Bytes of a gzip file that hold as much, its own header included."""

SIGNATURES = (
    (344, b"n+1\0", "NIfTI image"),
    (344, b"ni1\0", "NIfTI image"),
    (4, b"n+2\0", "NIfTI image"),
    (4, b"ni2\0", "NIfTI image"),
    (0, (348).to_bytes(4, "little"), "Analyze image"),
    (0, (348).to_bytes(4, "big"), "Analyze image"),
    (0, b"NRRD0", "NRRD image"),
    (0, b"ObjectType", "MetaImage"),
    (128, b"DICM", "DICOM file"),
    (0, b"\x1f\x8b", "gzip file"),
    (0, b"PK\x03\x04", "ZIP archive"),
    (0, b"\x89PNG", "PNG picture"),
    (0, b"\xff\xd8\xff", "JPEG picture"),
    (0, b"GIF8", "GIF picture"),
    (0, b"BM", "BMP picture"),
    (0, b"II*\0", "TIFF picture"),
    (0, b"MM\0*", "TIFF picture"),
    (0, b"%PDF", "PDF document"),
    (0, b"<", "web page or XML text"),
)
"""Offset and bytes that give a format away. A header of 348 bytes without NIfTI's signature is
that of its ancestor, Analyze."""

ENDINGS = {
    ".nii": "NIfTI image",
    ".nii.gz": "NIfTI image",
    ".hdr": "NIfTI image",
    ".nrrd": "NRRD image",
    ".nhdr": "NRRD image",
    ".mha": "MetaImage",
    ".mhd": "MetaImage",
    ".dcm": "DICOM file",
}
"""How names of the formats with a reader of their own end."""


FOLDER = "folder"
"""Form of a folder, of DICOM files or with a file for each structure."""

VOXELS = (".img", ".img.gz")
"""How names of the second files of Analyze and NIfTI pairs end."""


def described_by(path: Path) -> Path:
    """The file whose header says what a file holds: of a pair its .hdr, else the file itself.

    Parameters
    ----------
    path : Path
        A file that is there.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If it is the second file of a pair, and the first is not beside it.
    OSError
        If it cannot be opened.
    """
    ending = next((e for e in VOXELS if path.name.lower().endswith(e)), None)
    if ending is None:
        return path
    stem = path.name[: -len(ending)]
    for header in (path.with_name(stem + e) for e in (".hdr", ".HDR", ".hdr.gz")):
        if header.is_file():
            return header
    with path.open("rb") as file:
        if _signature(file.read(HEAD)) is not None:
            return path  # another image under this name
    refuse(path.name, "The .hdr file that belongs to this .img is missing: put it beside it.")


def identify(path: Path) -> str:
    """Tell the format of an image file.

    Parameters
    ----------
    path : Path
        A file or a folder.

    Returns
    -------
    str
        One of the values of `ENDINGS`, `FOLDER`, or ``"unknown"``.

    Raises
    ------
    InputError
        If there is no such file, it cannot be opened, or it is not what its name says.
    """
    try:
        if path.is_dir():
            return FOLDER
        if not path.is_file():
            raise MissingFileError(f"{path}: There is no such file: check the path.")
        header = described_by(path)
        with header.open("rb") as file:
            head = file.read(PACKED_HEAD)
    except InputError:
        raise
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise UnreadableFileError(
            f"{path}: The file cannot be opened ({reason}): check the path and its permissions."
        ) from error
    if not head:
        refuse(path.name, "The file is empty: export it again.")
    found, expected = _signature(head), _ending(header.name)
    if header.name.lower().endswith(".gz"):
        if found != "gzip file":
            refuse(path.name, "The file is not gzip-compressed as its name says: remove the .gz.")
        found = _signature(_unpack(head, path.name))
        if expected is None:
            refuse(path.name, "The file is compressed as a whole: unpack it with gunzip first.")
    if found == expected or (expected == "MetaImage" and found is None):
        return expected or "unknown"
    if found == "DICOM file" and expected is None:
        return found
    if found == "Analyze image":
        refuse(
            path.name,
            "This is an Analyze image, which does not say which side is left: convert it to NIfTI.",
        )
    if found == "gzip file":
        refuse(path.name, "The file is gzip-compressed: end its name in .nii.gz, or unpack it.")
    if found in ENDINGS.values():
        endings = " or ".join(e for e, f in ENDINGS.items() if f == found)
        refuse(path.name, f"This is a {found}: its name must end in {endings}.")
    if found is not None:
        refuse(path.name, f"This is a {found}, not a volume: save the mask as NIfTI, NRRD or MHA.")
    refuse(
        path.name,
        f"The file has no {expected} header, as its name promises: export the mask again.",
    )


def stem(path: Path) -> str:
    """Name of a file without the ending of an image.

    Parameters
    ----------
    path : Path
        A file of any format that is read.
    """
    endings = sorted(ENDINGS, key=len, reverse=True)
    ending = next((e for e in endings if path.name.lower().endswith(e)), "")
    return path.name[: len(path.name) - len(ending)] or path.name


def refuse(name: str, sentence: str) -> NoReturn:
    """Stop reading, with one sentence; what libraries say in it may come on several lines.

    Parameters
    ----------
    name : str
        Of the file, to begin the message with.
    sentence : str
        What is wrong, and what to do.
    """
    raise InputError(f"{name}: {' '.join(sentence.split())}")


def _signature(head: bytes) -> str | None:
    """Format the first bytes give away, if any."""
    return next((f for at, sign, f in SIGNATURES if head[at : at + len(sign)] == sign), None)


def _ending(name: str) -> str | None:
    """Format the name promises, if any."""
    return next((f for ending, f in ENDINGS.items() if name.lower().endswith(ending)), None)


def _unpack(head: bytes, name: str) -> bytes:
    """First bytes of what a gzip file holds."""
    try:
        return zlib.decompressobj(wbits=zlib.MAX_WBITS | 16).decompress(head, HEAD)
    except zlib.error:
        refuse(name, "The gzip compression is damaged: copy or export the file again.")
