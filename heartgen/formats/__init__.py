"""Meshes out to the field's tools, each by a writer that says what it loses, and in again."""

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
