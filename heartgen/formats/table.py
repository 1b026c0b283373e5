"""The table of formats, and `write_mesh`, which looks up in it what a file name asks for."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from heartgen.errors import InputError
from heartgen.formats.abaqus import write_abaqus
from heartgen.formats.cheart import write_cheart
from heartgen.formats.ex1 import write_ex1
from heartgen.formats.exf import write_exf
from heartgen.formats.febio import write_febio
from heartgen.formats.fieldml import write_fieldml
from heartgen.formats.grids import write_cells_vtu, write_xdmf
from heartgen.formats.mfem import write_mfem
from heartgen.formats.msh import write_msh
from heartgen.formats.opencarp import write_opencarp
from heartgen.formats.resampling import Resampled, Resampling
from heartgen.formats.resampling.cell_files import CellFormat, CellWriter
from heartgen.formats.surface_files import write_glb, write_obj, write_ply, write_stl
from heartgen.formats.vtu import write_bezier_vtu, write_legacy_vtk, write_vtu
from heartgen.formats.written import Written
from heartgen.mesh.field import MeshField, fitting
from heartgen.mesh.hexmesh import HexMesh

Writer = Callable[[HexMesh, Path, tuple[MeshField, ...]], Written]
"""Writes a mesh and its fields, and says which files it made and what the user should know."""

SurfaceWriter = Callable[[Resampled, Path], Written]

SURFACE_PIECES = (1, 6, 6)
"""Pieces of elements for their surfaces alone: within 0.05 mm of a usual human heart on average."""


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
        A `CellFormat` if the mesh is resampled to linear or quadratic cells, which can then be
        chosen.
    fields : bool
        False if it has no place for fields; the writer is then given none.
    exact : bool
        The file holds the very same geometry.

    Examples
    --------
    >>> from heartgen.formats import FORMATS
    >>> print(FORMATS["vtu"])
    VTK, cubic cells: ParaView, PyVista (.vtu), exact
    >>> FORMATS["stl"].exact, FORMATS["stl"].fields
    (False, False)
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


def _of_cells(
    name: str,
    ending: str,
    title: str,
    write: CellWriter,
    kind: str,
    fields: bool = True,
    only_directions: bool = False,
) -> Format:
    """A format of linear or quadratic cells."""
    how = CellFormat(write, Resampling(kind), only_directions)
    return Format(name, ending, title, how, fields=fields, exact=False)


def _of_surfaces(name: str, ending: str, title: str, write: SurfaceWriter) -> Format:
    """A format of triangles."""
    how = CellFormat(
        lambda cells, path, _: write(cells, path),
        Resampling("tet4", SURFACE_PIECES),
        only_surfaces=True,
    )
    return Format(name, ending, title, how, fields=False, exact=False)


FORMATS = _table(
    Format("exf", ".exf", "EX version 3: OpenCMISS, zinc, scaffoldmaker", write_exf),
    Format("ex1", ".exelem", "EX version 1, two files: cmGui and tools of its time", write_ex1),
    Format(
        "fieldml",
        ".fieldml",
        "FieldML 0.5: zinc, OpenCMISS; needs heartgen[fieldml]",
        write_fieldml,
    ),
    Format("vtu", ".vtu", "VTK, cubic cells: ParaView, PyVista", write_vtu),
    Format("vtu-bezier", ".vtu", "VTK, Bezier cells: ParaView, PyVista", write_bezier_vtu),
    Format("vtk", ".vtk", "legacy VTK 5.1, cubic cells: ParaView, meshio", write_legacy_vtk),
    Format("msh", ".msh", "Gmsh MSH 2.2, order 3: Gmsh, MFEM, meshio", write_msh),
    Format("mfem", ".mesh", "MFEM, order 3", write_mfem),
    _of_cells(
        "vtu-cells",
        ".vtu",
        "VTK, linear or quadratic cells: ParaView, svFSI",
        write_cells_vtu,
        "hex8",
    ),
    _of_cells("xdmf", ".xdmf", "XDMF: FEniCS, ParaView, PyVista", write_xdmf, "tet4"),
    _of_cells("inp", ".inp", "Abaqus, CalculiX", write_abaqus, "hex8", only_directions=True),
    _of_cells("feb", ".feb", "FEBio", write_febio, "hex8"),
    _of_cells("pts", ".pts", "openCARP", write_opencarp, "tet4", only_directions=True),
    _of_cells("cheart", ".x", "CHeart", write_cheart, "tet10", fields=False),
    _of_surfaces("stl", ".stl", "STL, surfaces: 3-D printing", write_stl),
    _of_surfaces("ply", ".ply", "PLY, surfaces", write_ply),
    _of_surfaces("obj", ".obj", "Wavefront OBJ, surfaces", write_obj),
    _of_surfaces("glb", ".glb", "glTF, surfaces: browsers, slides, augmented reality", write_glb),
)
"""All formats by name. Of those with the same ending, the first is meant by a file name."""


def write_mesh(
    mesh: HexMesh,
    path: str | Path,
    fields: Iterable[MeshField] = (),
    format: str | None = None,
    cells: Resampling | None = None,
) -> Written:
    """Write a mesh in the format that is named, or that its file name asks for.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    path : path
        Its folder is created if absent.
    fields : iterable of MeshField
        Written along if the format has a place for them.
    format : str, optional
        One of `FORMATS`; by the ending of the file name if omitted.
    cells : Resampling, optional
        Simple cells to which the mesh is resampled; the usual ones of the format if omitted.

    Returns
    -------
    Written
        The files, and notes on what they do not hold, and on what resampling has cost.

    Raises
    ------
    InputError
        If there is no such format, the file name does not end as its files do, or the format holds
        no linear or quadratic cells and they were asked for.
    MeshError
        If the format cannot hold the mesh, or a field is not one of this mesh.
    HeartgenError
        If the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> with TemporaryDirectory() as folder:
    ...     written = heartgen.write_mesh(mesh, Path(folder) / "mesh.vtu")
    ...     tetrahedra = heartgen.write_mesh(mesh, Path(folder) / "mesh.xdmf")
    >>> written.files[0].name, written.notes
    ('mesh.vtu', ())
    >>> tetrahedra.notes[0].split(":")[0]
    'resampled to 13536 tet4'
    """
    chosen = format_of(path, format, simple=cells is not None)
    fields = fitting(fields, mesh.n_elements)
    taken = fields if chosen.fields else ()
    if isinstance(chosen.write, CellFormat):
        written = chosen.write(mesh, Path(path), taken, cells)
    else:
        written = chosen.write(mesh, Path(path), taken)
    if fields and not chosen.fields:
        names = ", ".join(field.name for field in fields)
        note = f"{Path(path).name} does not hold the fields, which have no place in it: {names}"
        written = replace(written, notes=(*written.notes, note))
    return written


def file_name(stem: str, name: str) -> str:
    """File name for a format, by which `write_mesh` needs no other word if it is the usual one.

    Parameters
    ----------
    stem : str
        The name without its ending.
    name : str
        One of `FORMATS`.

    Examples
    --------
    >>> from heartgen.formats import file_name
    >>> file_name("mesh", "vtu"), file_name("mesh", "vtu-cells")
    ('mesh.vtu', 'mesh-vtu-cells.vtu')
    """
    ending = _named(name).ending
    usual = next(each for each in FORMATS.values() if each.ending == ending)
    return f"{stem}{ending}" if usual.name == name else f"{stem}-{name}{ending}"


def format_of(path: str | Path, name: str | None = None, simple: bool = False) -> Format:
    """Format by its name, or by the ending of a file name; `InputError` if there is none.

    With `simple`, only formats of linear or quadratic cells will do.

    Parameters
    ----------
    path : path
        Name of the file.
    name : str, optional
        One of `FORMATS`; by the ending of the file if omitted.
    simple : bool
        Whether only formats of linear or quadratic cells will do.
    """
    candidates = list(FORMATS.values()) if name is None else [_named(name)]
    if simple:
        candidates = [each for each in candidates if isinstance(each.write, CellFormat)]
    for each in candidates:
        if _ends(path, each):
            return each
    if not candidates or (simple and any(_ends(path, each) for each in FORMATS.values())):
        raise InputError(
            f"{path}: This format holds the mesh itself: leave out the choice of cells."
        )
    endings = " or ".join(dict.fromkeys(each.ending for each in candidates))
    raise InputError(f"{path}: A mesh cannot be written in this format: end the name in {endings}.")


def resampling_for(
    path: str | Path,
    name: str | None,
    cells: str | None,
    pieces: tuple[int, int, int] | None,
) -> Resampling | None:
    """What to resample to for a file, if anything was asked for; `InputError` if that cannot be.

    Cells or pieces that are not given are the usual ones of the format.

    Parameters
    ----------
    path : path
        Name of the file.
    name : str or None
        One of `FORMATS`; None to go by the ending of the file.
    cells : str or None
        Kind of cells; None for the usual ones.
    pieces : (int, int, int) or None
        Of an element (radial, circumferential, longitudinal); None for the usual ones.
    """
    chosen = format_of(path, name, simple=cells is not None or pieces is not None)
    if not isinstance(chosen.write, CellFormat) or (cells is None and pieces is None):
        return None
    return Resampling(cells or chosen.write.usual.kind, pieces or (0, 0, 0))


def cells_of(name: str, kind: str | None) -> Resampling | None:
    """Cells of a kind, if one is given, where a format by its name leaves the choice; else None.

    Parameters
    ----------
    name : str
        One of `FORMATS`.
    kind : str or None
        Such as ``"tet4"``; None for the usual cells.

    Examples
    --------
    >>> from heartgen.formats import cells_of
    >>> cells_of("xdmf", "tet10").kind
    'tet10'
    >>> cells_of("vtu", "tet10") is None  # it holds the cubic elements themselves
    True
    """
    chosen = _named(name).write
    if kind is None or not isinstance(chosen, CellFormat) or chosen.only_surfaces:
        return None
    return Resampling(kind)


def fields_held(name: str) -> Literal["all", "directions", "none"]:
    """For which fields a format by its name has a place; directions are fibers and sheets.

    Parameters
    ----------
    name : str
        One of `FORMATS`.

    Examples
    --------
    >>> from heartgen.formats import fields_held
    >>> fields_held("vtu"), fields_held("inp"), fields_held("stl")
    ('all', 'directions', 'none')
    """
    chosen = _named(name)
    if not chosen.fields:
        return "none"
    how = chosen.write
    return "directions" if isinstance(how, CellFormat) and how.only_directions else "all"


def _ends(path: str | Path, format: Format) -> bool:
    """Whether a file name ends as files of a format do."""
    return format.ending == Path(path).suffix.lower()


def _named(name: str) -> Format:
    if name not in FORMATS:
        raise InputError(f"format {name!r} is not known: choose one of {', '.join(FORMATS)}")
    return FORMATS[name]
