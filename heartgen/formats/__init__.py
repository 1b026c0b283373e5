"""Meshes out to the field's tools, each by a writer that loses nothing."""

from __future__ import annotations

from pathlib import Path

from heartgen.errors import InputError
from heartgen.formats.exf import write_exf
from heartgen.formats.files import replacing, write_text
from heartgen.formats.vtu import write_vtu
from heartgen.mesh.hexmesh import HexMesh

__all__ = ["WRITERS", "replacing", "write_exf", "write_mesh", "write_text", "write_vtu"]

WRITERS = {".exf": write_exf, ".vtu": write_vtu}
"""Writer for each ending of a file name."""


def write_mesh(mesh: HexMesh, path: str | Path) -> None:
    """Write a mesh in the format its file name asks for.

    Parameters
    ----------
    mesh : HexMesh
    path : path
        Ends in one of `WRITERS`; its folder is created if absent.

    Raises
    ------
    InputError
        If the ending is not known.
    HeartgenError
        If the file cannot be written.
    """
    ending = Path(path).suffix.lower()
    if ending not in WRITERS:
        raise InputError(
            f"{path}: A mesh cannot be written in this format: end the name in "
            f"{' or '.join(WRITERS)}."
        )
    WRITERS[ending](mesh, path)
