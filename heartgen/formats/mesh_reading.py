"""`read_mesh` and its table of readers; `convert`, which reads and writes again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from heartgen.errors import InputError
from heartgen.formats.assembled import MeshFile
from heartgen.formats.exread import read_ex
from heartgen.formats.table import resampling_for, write_mesh
from heartgen.formats.vturead import read_vtu
from heartgen.formats.written import Written
from heartgen.mesh.bases import deviation
from heartgen.mesh.hexmesh import HexMesh

READERS: dict[str, Callable[[Path], MeshFile]] = {
    **dict.fromkeys((".exf", ".exfile", ".ex2", ".exnode", ".exelem"), read_ex),
    ".vtu": read_vtu,
}
"""Reader for each ending of a file name."""

BASES = ("hermite", "lagrange")


def read_mesh(path: str | Path) -> HexMesh:
    """Read a mesh of cubic hexahedra, with its named surfaces and regions.

    Parameters
    ----------
    path : path
        Ends in one of `READERS`. Of a pair of EX files, either.

    Returns
    -------
    HexMesh
        In the basis of the file; mm, world (LPS), as the file is taken to be.

    Raises
    ------
    InputError
        If the file cannot be read, or holds other elements.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> with TemporaryDirectory() as folder:
    ...     path = heartgen.write_mesh(mesh, Path(folder) / "mesh.exf").files[0]
    ...     again = heartgen.read_mesh(path)
    >>> again.topology.basis, sorted(again.topology.surfaces)
    ('hermite', ['base', 'epi', 'lv_endo'])
    """
    return read_mesh_file(path).mesh


def read_mesh_file(path: str | Path) -> MeshFile:
    """Read a mesh and its fields, and tell what was not read; otherwise as `read_mesh`.

    Parameters
    ----------
    path : path
        Of one of the formats in `READERS`, by its ending.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import make_fields
    >>> from heartgen.formats import read_mesh_file
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "mesh.vtu"
    ...     written = heartgen.write_mesh(mesh, path, make_fields(mesh, ["thickness"]))
    ...     read = read_mesh_file(path)
    >>> read.mesh.topology.basis, [field.name for field in read.fields]
    ('lagrange', ['wall thickness'])
    """
    ending = Path(path).suffix.lower()
    if ending not in READERS:
        raise InputError(
            f"{path}: A mesh cannot be read in this format: give a file whose name ends in "
            f"{' or '.join(READERS)}."
        )
    return READERS[ending](Path(path))


def convert(
    source: str | Path,
    target: str | Path,
    format: str | None = None,
    basis: str | None = None,
    order: int = 3,
    cells: str | None = None,
    pieces: tuple[int, int, int] | None = None,
) -> Written:
    """Read a mesh and write it, with its fields, in another format.

    Parameters
    ----------
    source, target : path
        File to read, and file to write.
    format : str, optional
        One of `heartgen.formats.FORMATS`; by the ending of `target` if omitted.
    basis : {"hermite", "lagrange"}, optional
        That of the mesh that is written; as it is read if omitted.
    order : {1, 2, 3}
        Of the elements in the Lagrange basis; lower ones than 3 resample the mesh.
    cells : {"hex8", "hex20", "hex27", "tet4", "tet10"}, optional
        Simple cells to which the mesh is resampled; the usual ones of the format if omitted.
    pieces : (int, int, int), optional
        Of an element (radial, circumferential, longitudinal); the usual ones if omitted.

    Returns
    -------
    Written
        With notes on what was lost on the way.

    Raises
    ------
    HeartgenError
        If the mesh cannot be read or written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.formats import convert
    >>> with TemporaryDirectory() as folder:
    ...     source = heartgen.write_mesh(mesh, Path(folder) / "mesh.exf").files[0]
    ...     written = convert(source, Path(folder) / "mesh.vtu")
    >>> written.files[0].name
    'mesh.vtu'
    """
    if basis is not None and basis not in BASES:
        raise InputError(f"basis {basis!r} is not known: choose hermite or lagrange")
    if order != 3 and basis != "lagrange":
        raise InputError(f"order {order} is one of the Lagrange basis: add --basis lagrange")
    wanted = resampling_for(target, format, cells, pieces)
    read = read_mesh_file(source)
    mesh, notes = read.mesh, list(read.notes)
    if basis == "hermite":
        mesh = mesh.to_hermite()
    elif basis == "lagrange":
        mesh = read.mesh.to_lagrange(order)
        if order != 3:
            moved = deviation(mesh, read.mesh)
            notes.append(f"elements of order {order} lie up to {moved:.3g} mm from the mesh")
    written = write_mesh(mesh, target, read.fields, format, wanted)
    return replace(written, notes=(*notes, *written.notes))
