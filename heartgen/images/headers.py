"""Declared size against the size of the file, before a voxel is allocated.

A damaged or hostile header of 400 bytes can declare 18 GB, and the usual readers believe it.
"""

from __future__ import annotations

import math
import re
import zlib
from dataclasses import dataclass
from pathlib import Path

from heartgen.images.checks import check_size, report
from heartgen.images.file_kinds import refuse
from heartgen.images.units import meta_is_spaced, meta_unit, nrrd_is_spaced, nrrd_unit

MAX_HEADER = 1024**2
"""Longest text header, bytes; those of segmentations of a hundred parts have some 100 kB."""

MAX_FIELD = 512
"""Longest line of a text header. Teem, which SimpleITK reads NRRD with, overruns its buffers on
lines of some 700 characters (seen with SimpleITK 2.5.7); real ones are below 400."""

MAX_NAME = 250
"""Longest name of a MetaImage; MetaIO overruns its buffer on one of 300 (SimpleITK 2.5.7)."""

FREE_TEXT = ("comment",)
"""Fields of any length."""

CHUNK = 1024**2
"""Bytes unpacked at a time."""

ZLIB_OR_GZIP = zlib.MAX_WBITS | 32
"""zlib's code for either kind of packing, as the data say."""

NRRD_BYTES = {
    1: "signed char, int8, int8_t, uchar, unsigned char, uint8, uint8_t",
    2: "short, short int, signed short, signed short int, int16, int16_t, "
    "ushort, unsigned short, unsigned short int, uint16, uint16_t",
    4: "int, signed int, int32, int32_t, uint, unsigned int, uint32, uint32_t, float",
    8: "longlong, long long, long long int, signed long long, signed long long int, int64, "
    "int64_t, ulonglong, unsigned long long, unsigned long long int, uint64, uint64_t, double",
}
"""Bytes of a value of each NRRD type (teem.sourceforge.net/nrrd/format.html)."""

META_BYTES = {
    1: "MET_CHAR, MET_UCHAR",
    2: "MET_SHORT, MET_USHORT",
    4: "MET_INT, MET_UINT, MET_LONG, MET_ULONG, MET_FLOAT",
    8: "MET_LONG_LONG, MET_ULONG_LONG, MET_DOUBLE",
}
"""Bytes of a value of each MetaImage type (itk.org/Wiki/MetaIO/Documentation)."""


@dataclass(frozen=True)
class Declared:
    """What a header says about the voxels.

    Attributes
    ----------
    shape : tuple of int
        Number of values along each axis, channels included.
    value_bytes : int
        Bytes of a value in the file; the least, if values are written as text.
    file : Path
        The file with the values.
    start : int
        Where in that file the values, or their packing, begin.
    packed : bool
        Whether they are packed by zlib or gzip.
    skip : int
        Bytes before the values once unpacked.
    unit : float
        Length of the header's unit of length, mm.
    spaced : bool
        Whether the header says how large the voxels are.
    layered : bool
        Whether the values of a voxel are a list: frames of a cine, or layers of segments.
    """

    shape: tuple[int, ...]
    value_bytes: int
    file: Path
    start: int = 0
    packed: bool = False
    skip: int = 0
    unit: float = 1.0
    spaced: bool = True
    layered: bool = False

    @property
    def values(self) -> int:
        """Number of values."""
        return math.prod(self.shape)


def check_file_size(declared: Declared, name: str) -> None:
    """Compare what a header declares with what its file holds.

    Parameters
    ----------
    declared : Declared
        Read from the header.
    name : str
        Name of the image.

    Raises
    ------
    InputError
        If the image is too large, or larger than its file, or the packing is damaged.
    """
    report(name, [check_size(declared.shape)])
    needed = declared.values * declared.value_bytes
    if declared.packed:
        held = _unpacked_bytes(declared, declared.skip + needed, name) - declared.skip
    else:
        held = declared.file.stat().st_size - declared.start - declared.skip
    if held < needed:
        refuse(
            name,
            f"The file is truncated, it holds {max(held, 0):,} of the {needed:,} bytes that its "
            "header declares: copy or export it again.",
        )


def nrrd_header(path: Path) -> Declared:
    """Read what the header of a .nrrd or .nhdr file declares; `InputError` if it is damaged.

    Parameters
    ----------
    path : Path
        The header's file.
    """
    head = _head(path)
    blank = re.search(rb"\r?\n\r?\n", head)
    fields = _fields(head[: blank.start()] if blank else head, b":", path.name)
    detached = fields.get("data file", fields.get("datafile"))
    if detached is None and blank is None:
        refuse(path.name, "The header has no end: the file is truncated, copy or export it again.")
    encoding = fields.get("encoding", "").lower()
    if encoding not in ("raw", "gz", "gzip", "txt", "text", "ascii", "hex"):
        refuse(path.name, f"The encoding {encoding[:20]!r} is not read: save the mask with gzip.")
    _check_spacings(fields.get("spacings", ""), path.name)
    value_bytes = _value_bytes(fields.get("type", ""), NRRD_BYTES, path.name)
    return Declared(
        shape=_whole_numbers(fields.get("sizes", ""), "sizes", path.name),
        value_bytes=value_bytes if encoding in ("raw", "gz", "gzip") else 1,
        file=_data_file(path, detached),
        start=blank.end() if blank and detached is None else 0,
        packed=encoding in ("gz", "gzip"),
        unit=nrrd_unit(fields, path.name),
        spaced=nrrd_is_spaced(fields),
        layered="list" in fields.get("kinds", "").lower().split(),
    )


def meta_header(path: Path) -> Declared:
    """Read what the header of a .mha or .mhd file declares; `InputError` if it is damaged.

    Parameters
    ----------
    path : Path
        The header's file.
    """
    head = _head(path)
    last = re.search(rb"^[ \t]*ElementDataFile[ \t]*[=:].*\n?", head, re.MULTILINE)
    if last is None:
        refuse(path.name, "The header does not say where its data are: export the mask again.")
    fields = _fields(head[: last.end()], b"[=:]", path.name)
    shape = _whole_numbers(fields.get("dimsize", ""), "DimSize", path.name)
    if _whole_numbers(fields.get("ndims", ""), "NDims", path.name) != (len(shape),):
        refuse(path.name, "The header is damaged, NDims and DimSize disagree: export it again.")
    channels = _whole_numbers(fields.get("elementnumberofchannels", "1"), "channels", path.name)
    _check_spacings(fields.get("elementspacing", fields.get("elementsize", "")), path.name)
    value_bytes = _value_bytes(fields.get("elementtype", ""), META_BYTES, path.name)
    source = fields["elementdatafile"]
    local = source.lower() == "local"
    return Declared(
        shape=shape if channels == (1,) else channels + shape,
        value_bytes=value_bytes if _is_true(fields.get("binarydata", "true")) else 1,
        file=_data_file(path, None if local else source),
        start=last.end() if local else 0,
        packed=_is_true(fields.get("compresseddata", "false")),
        unit=meta_unit(fields, path.name),
        spaced=meta_is_spaced(fields),
    )


def _head(path: Path) -> bytes:
    """Beginning of a file, long enough for any text header."""
    with path.open("rb") as file:
        return file.read(MAX_HEADER)


def _fields(text: bytes, separator: bytes, name: str) -> dict[str, str]:
    """Fields of a text header, one a line; their names in lower case."""
    fields: dict[str, str] = {}
    for line in text.splitlines():
        if line.startswith(b"#") or b":=" in line:  # NRRD's comments and free text
            continue
        key, *rest = re.split(separator, line, maxsplit=1)
        key = key.decode("latin-1").strip().lower()
        if len(line) > (MAX_NAME if key == "name" else MAX_FIELD) and key not in FREE_TEXT:
            refuse(name, f"The header is damaged, a line of it is too long ({line[:20]!r} ...).")
        if rest and key in fields:
            refuse(name, f"The header is damaged, it has two lines {key[:20]!r}: export it again.")
        if rest:
            fields[key] = rest[0].decode("utf-8", "replace").strip()
    return fields


def _whole_numbers(text: str, what: str, name: str) -> tuple[int, ...]:
    """Whole numbers of a field."""
    # Longer runs of digits are no sizes, and Python refuses to convert very long ones.
    if not re.fullmatch(r"\d{1,18}(\s+\d{1,18})*", text, re.ASCII):
        refuse(name, f"The header is damaged, its {what} are {text[:40]!r}: export it again.")
    return tuple(map(int, text.split()))


def _check_spacings(text: str, name: str) -> None:
    """Refuse voxel sizes that are not positive; readers make mirrored images of them."""
    for word in text.split():
        try:
            positive = not float(word) <= 0
        except ValueError:
            positive = False
        if not positive:
            refuse(
                name,
                f"The header declares a voxel size of {text[:40]} mm, which is not positive: "
                "correct it.",
            )


def _value_bytes(kind: str, table: dict[int, str], name: str) -> int:
    """Bytes of a value of the type that a header names."""
    for size, kinds in table.items():
        if kind in kinds.split(", "):
            return size
    refuse(name, f"The voxels are of type {kind[:40]!r}: save the mask with whole numbers.")


def _is_true(word: str) -> bool:
    """MetaIO's reading of a truth value."""
    return word[:1] in ("T", "t", "1")


def _data_file(path: Path, named: str | None) -> Path:
    """The file with the voxels: the header's own, or the one it names in its folder."""
    if named is None:
        return path
    if named.split()[:1] == ["LIST"] or "%" in named:
        refuse(path.name, "The voxels lie in several files: save the mask as a single file.")
    # A header that comes from elsewhere must not make us read any file of this machine.
    if Path(named).is_absolute() or ".." in Path(named).parts:
        refuse(path.name, f"The data file {named} is not beside its header: move it there.")
    file = path.parent / named
    try:
        found = file.is_file()
    except OSError:
        found = False
    if not found:
        refuse(path.name, f"Its data file {named[:80]!r} is missing: put it beside the header.")
    return file


def _unpacked_bytes(declared: Declared, enough: int, name: str) -> int:
    """Bytes the packed data unpack to, counted until they are enough; checksums are checked."""
    total = 0
    stream = zlib.decompressobj(ZLIB_OR_GZIP)
    try:
        with declared.file.open("rb") as file:
            file.seek(declared.start)
            packed = file.read(CHUNK)
            while packed and total <= enough:
                total += len(stream.decompress(packed, CHUNK))
                packed = stream.unconsumed_tail or stream.unused_data or file.read(CHUNK)
                if stream.eof:
                    if total >= enough:
                        return total
                    # A gzip file may consist of several, one after the other.
                    stream = zlib.decompressobj(ZLIB_OR_GZIP)
        return total + len(stream.flush()) if total < enough else total
    except zlib.error as error:
        refuse(name, f"The compression is damaged ({error}): copy or export the file again.")
