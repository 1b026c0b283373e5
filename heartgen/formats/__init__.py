"""Meshes out to the field's tools, each by a writer that says what it loses, and in again.

Writers are ours where those of meshio 5.3, trimesh 5.2 and PyVista 0.49 would lose something:

- STL, PLY, OBJ: trimesh writes single precision or 8 decimals, STL and PLY without the surfaces'
  names, and OBJ with the points on a rim once for each surface, so that surfaces do not meet.
- INP: meshio has no surfaces of elements, which pressure needs, and no orientations for fibers.
- XDMF: meshio writes no time, without which PyVista opens no file, and keeps no named sets.
- Plain VTU: meshio's files call themselves older than those in which cubic cells are read in
  VTK's order, which the exact format needs; the same 97 lines write both.
- glTF: trimesh would lose nothing, but would be one more package for all who install heartgen, in
  place of 90 lines. PyVista stands on VTK, which the core does without.

`to_meshio` and `HexMesh.to_pyvista` give the mesh to these packages, and to all that they write.
"""

from heartgen.formats.assembled import MeshFile
from heartgen.formats.ex1 import write_ex1
from heartgen.formats.exf import write_exf
from heartgen.formats.mesh_reading import READERS, convert, read_mesh, read_mesh_file
from heartgen.formats.meshio_mesh import to_meshio
from heartgen.formats.resampling import Resampling
from heartgen.formats.table import (
    FORMATS,
    Format,
    cells_of,
    fields_held,
    file_name,
    write_mesh,
)
from heartgen.formats.vtu import write_vtu
from heartgen.formats.written import Written, write_text

__all__ = [
    "FORMATS",
    "READERS",
    "Format",
    "MeshFile",
    "Resampling",
    "Written",
    "cells_of",
    "convert",
    "fields_held",
    "file_name",
    "read_mesh",
    "read_mesh_file",
    "to_meshio",
    "write_ex1",
    "write_exf",
    "write_mesh",
    "write_text",
    "write_vtu",
]
