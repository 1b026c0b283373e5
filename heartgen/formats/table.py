"""The table of formats, and `write_mesh`, which looks up in it what a file name asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from heartgen.errors import InputError
from heartgen.formats.ex1 import write_ex1
from heartgen.formats.exf import write_exf
from heartgen.formats.files import Written
from heartgen.formats.mfem import write_mfem
from heartgen.formats.msh import write_msh
from heartgen.formats.vtu import write_bezier_vtu, write_legacy_vtk, write_vtu
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh

Writer = Callable[[HexMesh, Path, tuple[MeshField, ...]], Written]
"""Writes a mesh and its fields, and says which files it made and what the user should know."""


@dataclass(frozen=True)
class Format:
    """A way to write a mesh.

    Attributes
    ----------
    name : str
        By which it is asked for.
    ending : str
        Of its file names, lower case with the dot.
    title : str
        What it is and whose, for people.
    write : Writer
    fields : bool
        False if it has no place for fields; the writer is then given none.
    exact : bool
        The file holds the very same geometry.
    """

    name: str
    ending: str
    title: str
    write: Writer
    fields: bool = True
    exact: bool = True

    def __str__(self) -> str:
        return f"{self.title} ({self.ending}){', exact' if self.exact else ''}"


def _table(*formats: Format) -> dict[str, Format]:
    return {each.name: each for each in formats}


FORMATS = _table(
    Format("exf", ".exf", "EX version 3: OpenCMISS, zinc, scaffoldmaker", write_exf),
    Format("ex1", ".exelem", "EX version 1, two files: cmGui and tools of its time", write_ex1),
    Format("vtu", ".vtu", "VTK, cubic cells: ParaView, PyVista", write_vtu),
    Format("vtu-bezier", ".vtu", "VTK, Bezier cells: ParaView, PyVista", write_bezier_vtu),
    Format("vtk", ".vtk", "legacy VTK 5.1, cubic cells: ParaView, meshio", write_legacy_vtk),
    Format("msh", ".msh", "Gmsh MSH 2.2, order 3: Gmsh, MFEM", write_msh),
    Format("mfem", ".mesh", "MFEM, order 3", write_mfem),
)
"""All formats by name. Of those with the same ending, the first is meant by a file name."""


def write_mesh(
    mesh: HexMesh,
    path: str | Path,
    fields: Iterable[MeshField] = (),
    format: str | None = None,
) -> Written:
    """Write a mesh in the format that is named, or that its file name asks for.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Written along if the format has a place for them.
    format : str, optional
        One of `FORMATS`; by the ending of the file name if omitted.

    Returns
    -------
    Written
        The files, and notes on what they do not hold.

    Raises
    ------
    InputError
        If there is no such format, or the file name does not end as its files do.
    MeshError
        If the format cannot hold the mesh, or a field is not one of this mesh.
    HeartgenError
        If the file cannot be written.
    """
    chosen = format_of(path, format)
    fields = fitting(fields, mesh.n_elements)
    written = chosen.write(mesh, Path(path), fields if chosen.fields else ())
    if fields and not chosen.fields:
        names = ", ".join(field.name for field in fields)
        note = f"{Path(path).name} does not hold the fields, which have no place in it: {names}"
        written = replace(written, notes=(*written.notes, note))
    return written


def file_name(stem: str, name: str) -> str:
    """File name for a format, by which `write_mesh` needs no other word if it is the usual one."""
    ending = _named(name).ending
    usual = next(each for each in FORMATS.values() if each.ending == ending)
    return f"{stem}{ending}" if usual.name == name else f"{stem}-{name}{ending}"


def format_of(path: str | Path, name: str | None = None) -> Format:
    """Format by its name, or by the ending of a file name; `InputError` if there is none."""
    candidates = list(FORMATS.values()) if name is None else [_named(name)]
    for each in candidates:
        if each.ending == Path(path).suffix.lower():
            return each
    endings = " or ".join(dict.fromkeys(each.ending for each in candidates))
    raise InputError(f"{path}: A mesh cannot be written in this format: end the name in {endings}.")


def _named(name: str) -> Format:
    if name not in FORMATS:
        raise InputError(f"format {name!r} is not known: choose one of {', '.join(FORMATS)}")
    return FORMATS[name]
