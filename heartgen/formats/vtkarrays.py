"""Arrays of VTK's XML files, in all encodings but LZ4 and LZMA."""

from __future__ import annotations

import base64
import binascii
import re
import zlib
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import HeartgenError, InputError, cannot_read

DTYPES = {
    **{f"Int{8 * n}": f"i{n}" for n in (1, 2, 4, 8)},
    **{f"UInt{8 * n}": f"u{n}" for n in (1, 2, 4, 8)},
    **{f"Float{8 * n}": f"f{n}" for n in (4, 8)},
}
"""numpy's name of each of VTK's types."""

APPENDED = re.compile(rb"<AppendedData[^>]*?encoding=\"(\w+)\"[^>]*>\s*_")

BROKEN = (ValueError, KeyError, IndexError, ET.ParseError, zlib.error, binascii.Error)
"""What comes of files that are damaged."""


@dataclass(frozen=True, eq=False)
class GridFile:
    """An unstructured grid as it stands in a file.

    Attributes
    ----------
    version : (int, int)
        Of the file format.
    points : (p, 3) float64
        As they stand in the file.
    connectivity, offsets, types : (n,) int
        Points of the cells one after the other, where each cell ends, and VTK's numbers of the
        kinds of cells.
    point_data, cell_data : dict of str to (n,) or (n, k) array
        Values by name.
    """

    version: tuple[int, int]
    points: NDArray[np.float64]
    connectivity: NDArray[np.intp]
    offsets: NDArray[np.intp]
    types: NDArray[np.intp]
    point_data: dict[str, NDArray[np.generic]]
    cell_data: dict[str, NDArray[np.generic]]


def read_grid(path: str | Path) -> GridFile:
    """Read an unstructured grid of one piece.

    Parameters
    ----------
    path : path
        File to read.

    Returns
    -------
    GridFile

    Raises
    ------
    InputError
        If the file cannot be read, or is none.
    """
    try:
        content = Path(path).read_bytes()
    except OSError as error:
        raise cannot_read(
            error,
            f"{path}: The file cannot be read ({error.strerror or error}): give one that exists.",
        ) from error
    try:
        return _parsed(content)
    except HeartgenError:
        raise
    except BROKEN as error:
        raise InputError(
            f"{path}: This is no VTU file that can be read ({error}): give an unstructured grid of "
            "one piece, without LZ4 or LZMA compression."
        ) from error


def _parsed(content: bytes) -> GridFile:
    appended, encoding = b"", ""
    if (found := APPENDED.search(content)) is not None:
        encoding = found[1].decode()
        end = content.rindex(b"</AppendedData>")
        appended = content[found.end() : end]
        content = content[: found.start()] + content[end + len(b"</AppendedData>") :]
    root = ET.fromstring(content)
    if root.get("type") != "UnstructuredGrid":
        raise ValueError(f"it holds {root.get('type') or root.tag}")
    pieces = root.findall("UnstructuredGrid/Piece")
    if len(pieces) != 1:
        raise ValueError(f"it has {len(pieces)} pieces")
    major, minor = (int(n) for n in root.get("version", "0.1").split(".")[:2])

    def arrays(parent: str) -> dict[str, NDArray[np.generic]]:
        of = pieces[0].find(parent)
        each = [] if of is None else of.findall("DataArray")
        return {a.get("Name", parent): _array(a, root, appended, encoding) for a in each}

    cells = {name: values.astype(np.intp) for name, values in arrays("Cells").items()}
    points = next(iter(arrays("Points").values())).astype(np.float64).reshape(-1, 3)
    point_data, cell_data = arrays("PointData"), arrays("CellData")
    for data, size in ((point_data, len(points)), (cell_data, len(cells["types"]))):
        for name, values in data.items():
            if len(values) != size:
                raise ValueError(f"the array {name!r} has {len(values)} values, not {size}")
    return GridFile(
        version=(major, minor),
        points=points,
        connectivity=cells["connectivity"],
        offsets=cells["offsets"],
        types=cells["types"],
        point_data=point_data,
        cell_data=cell_data,
    )


def _array(
    node: ET.Element, root: ET.Element, appended: bytes, encoding: str
) -> NDArray[np.generic]:
    """One array (n,) or (n, k)."""
    order = "<" if root.get("byte_order", "LittleEndian") == "LittleEndian" else ">"
    dtype = np.dtype(order + DTYPES[node.get("type", "")])
    text = (node.text or "").strip()
    if node.get("format") == "ascii":
        values = np.array(text.split()).astype(dtype)
    else:
        size = np.dtype(order + DTYPES[root.get("header_type", "UInt32")])
        compressor = root.get("compressor")
        if compressor not in (None, "vtkZLibDataCompressor"):
            raise ValueError(f"it is compressed by {compressor}")
        inline = node.get("format") == "binary"
        source = text.encode() if inline else appended[int(node.get("offset", "0")) :]
        raw = not inline and encoding == "raw"
        values = np.frombuffer(_block(source, raw, size, compressor is not None), dtype)
    components = int(node.get("NumberOfComponents", "1"))
    native = values.astype(dtype.newbyteorder("="))
    return native.reshape(-1, components) if components > 1 else native


def _block(source: bytes, raw: bool, size: np.dtype[np.generic], compressed: bool) -> bytes:
    """Bytes of an array, which follow their own sizes."""

    def start(n: int) -> bytes:
        """The first n bytes, which in base64 are a unit of their own."""
        return source[:n] if raw else base64.b64decode(source[: 4 * -(-n // 3)])

    def rest(skipped: int, n: int) -> bytes:
        if raw:
            return source[skipped : skipped + n]
        first = 4 * -(-skipped // 3)
        return base64.b64decode(source[first : first + 4 * -(-n // 3)])[:n]

    if not compressed:
        n = int(np.frombuffer(start(size.itemsize), size, 1)[0])
        whole = start(size.itemsize + n)  # size and bytes are encoded together
        return whole[size.itemsize : size.itemsize + n]
    blocks = int(np.frombuffer(start(size.itemsize), size, 1)[0])
    head = size.itemsize * (3 + blocks)
    sizes = np.frombuffer(start(head), size, 3 + blocks)[3:].astype(int)
    packed = rest(head, int(sizes.sum()))
    ends = np.cumsum(sizes)
    return b"".join(zlib.decompress(packed[a:b]) for a, b in zip(ends - sizes, ends, strict=True))
