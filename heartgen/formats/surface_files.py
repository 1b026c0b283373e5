"""Named surfaces as triangles: STL, PLY, OBJ and glTF.

Outward normals, counter-clockwise. STL, PLY and OBJ are in mm, world (LPS); glTF is in its own
frame, meters with y up and the chest in front.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.files import replacing
from heartgen.formats.resampling.resample import Resampled
from heartgen.formats.text import rows
from heartgen.formats.written import Written, write_text

COLORS = {
    "lv_endo": (0.835, 0.369, 0.0),
    "rv_endo": (0.902, 0.624, 0.0),
    "epi": (0.337, 0.706, 0.914),
    "base": (0.0, 0.620, 0.451),
}
"""Of the surfaces, red, green and blue (palette of Okabe and Ito, 2008)."""

GRAY = (0.7, 0.7, 0.7)
"""Of all other surfaces."""

GLTF_FROM_WORLD = (0.001, 0, 0, 0, 0, 0, -0.001, 0, 0, 0.001, 0, 0, 0, 0, 0, 1)
"""Column by column: meters from mm; left stays, superior is up, anterior is in front."""


def write_stl(cells: Resampled, path: Path) -> Written:
    """Write all surfaces as an ASCII STL file, a named solid for each.

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    """
    lines: list[str] = []
    for name, triangles in _triangles(cells).items():
        corners = cells.points[triangles]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        lines.append(f"solid {name}")
        for normal, triangle in zip(rows(normals), corners, strict=True):
            lines += [f"facet normal {normal}", "outer loop"]
            lines += [f"vertex {vertex}" for vertex in rows(triangle)]
            lines += ["endloop", "endfacet"]
        lines.append(f"endsolid {name}")
    return write_text("\n".join(lines) + "\n", path)


def write_ply(cells: Resampled, path: Path) -> Written:
    """Write all surfaces as one ASCII PLY mesh; each face has the number of its surface.

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    """
    surfaces = _triangles(cells)
    number, points = _compact(cells.points, surfaces)
    faces = [
        f"3 {row} {n}"
        for n, triangles in enumerate(surfaces.values(), start=1)
        for row in rows(number[triangles])
    ]
    lines = [
        "ply",
        "format ascii 1.0",
        "comment Coordinates in mm, world (LPS)",
        *(f"comment surface {n} is {name}" for n, name in enumerate(surfaces, start=1)),
        f"element vertex {len(points)}",
        *(f"property double {axis}" for axis in "xyz"),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "property int surface",
        "end_header",
        *rows(points),
        *faces,
    ]
    return write_text("\n".join(lines) + "\n", path)


def write_obj(cells: Resampled, path: Path) -> Written:
    """Write all surfaces as a Wavefront OBJ file of shared vertices, a group for each.

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    """
    surfaces = _triangles(cells)
    number, points = _compact(cells.points, surfaces)
    lines = ["# Coordinates in mm, world (LPS)", *(f"v {row}" for row in rows(points))]
    for name, triangles in surfaces.items():
        lines += [f"g {name}", *(f"f {row}" for row in rows(number[triangles] + 1))]
    return write_text("\n".join(lines) + "\n", path)


def write_glb(cells: Resampled, path: Path) -> Written:
    """Write all surfaces as a binary glTF 2.0 file, a named and colored node for each.

    Parameters
    ----------
    cells : Resampled
        The resampled mesh, mm, world (LPS).
    path : Path
        File to write.
    """
    surfaces = _triangles(cells)
    content: dict[str, Any] = {
        "asset": {"version": "2.0", "generator": "heartgen"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [
            {
                "name": "heart",
                "matrix": GLTF_FROM_WORLD,
                "children": list(range(1, len(surfaces) + 1)),
            },
            *({"name": name, "mesh": n} for n, name in enumerate(surfaces)),
        ],
        "materials": [_material(name) for name in surfaces],
        "meshes": [],
        "accessors": [],
        "bufferViews": [],
    }
    chunks: list[bytes] = []
    for n, (name, triangles) in enumerate(surfaces.items()):
        used, corners = np.unique(triangles, return_inverse=True)
        points = cells.points[used].astype("<f4")
        primitive = {
            "attributes": {"POSITION": _accessor(content, chunks, points, "VEC3")},
            "indices": _accessor(content, chunks, corners.ravel().astype("<u4"), "SCALAR"),
            "material": n,
        }
        content["meshes"].append({"name": name, "primitives": [primitive]})
    binary = b"".join(chunks)
    content["buffers"] = [{"byteLength": len(binary)}]
    with replacing(path) as temporary:
        temporary.write_bytes(b"".join(_glb(json.dumps(content).encode(), binary)))
    return Written((Path(path),))


def _triangles(cells: Resampled) -> dict[str, NDArray[np.intp]]:
    """Triangles (t, 3) of each surface of tetrahedra, counter-clockwise seen from outside."""
    return {name: cells.facets(name)[0] for name in cells.surfaces}


def _compact(
    points: NDArray[np.float64], surfaces: dict[str, NDArray[np.intp]]
) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
    """New number of each point (p,), and the points that the surfaces have."""
    used = np.unique(np.concatenate(list(surfaces.values())))
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    return number, points[used]


def _material(name: str) -> dict[str, Any]:
    """A matt material in the color of a surface."""
    color = [*COLORS.get(name, GRAY), 1.0]
    return {
        "name": name,
        "pbrMetallicRoughness": {
            "baseColorFactor": color,
            "metallicFactor": 0.0,
            "roughnessFactor": 0.8,
        },
    }


FLOAT, UNSIGNED = 5126, 5125
"""glTF's numbers of component types."""

VERTICES, INDICES = 34962, 34963
"""glTF's numbers of what a buffer is for."""


def _accessor(
    content: dict[str, Any], chunks: list[bytes], values: NDArray[np.generic], kind: str
) -> int:
    """Add an array to the binary chunk; its number."""
    of_floats = values.dtype.kind == "f"
    data = values.tobytes()
    view = {"buffer": 0, "byteOffset": sum(map(len, chunks)), "byteLength": len(data)}
    content["bufferViews"].append(view | {"target": VERTICES if of_floats else INDICES})
    chunks.append(data)
    entry = {
        "bufferView": len(content["bufferViews"]) - 1,
        "componentType": FLOAT if of_floats else UNSIGNED,
        "count": len(values),
        "type": kind,
    }
    if of_floats:
        entry |= {"min": values.min(0).tolist(), "max": values.max(0).tolist()}
    content["accessors"].append(entry)
    return len(content["accessors"]) - 1


def _glb(text: bytes, binary: bytes) -> Iterator[bytes]:
    """Bytes of a GLB file: a header, the JSON chunk, the binary chunk, each in fours."""
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    yield struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + len(binary))
    yield struct.pack("<I4s", len(text), b"JSON") + text
    yield struct.pack("<I4s", len(binary), b"BIN\0") + binary
