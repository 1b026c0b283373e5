"""From a mesh to a file of linear or quadratic cells: resample, measure, sample fields, write."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from heartgen.errors import MeshError
from heartgen.formats.directions import FIBER, SHEET
from heartgen.formats.resampling.data import Data, sample
from heartgen.formats.resampling.fidelity import fidelity, surface_distance
from heartgen.formats.resampling.kinds import TET4
from heartgen.formats.resampling.resample import Resampled, Resampling, resample
from heartgen.formats.written import Written
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import HexMesh

CellWriter = Callable[[Resampled, Path, Data], Written]
"""Writes cells and the fields on them."""


@dataclass(frozen=True)
class CellFormat:
    """How a format of linear or quadratic cells is written.

    Attributes
    ----------
    write : CellWriter
        Writes a resampled mesh and its data to a path.
    usual : Resampling
        What a mesh is resampled to unless something else is asked for.
    only_directions : bool
        Of all fields, it has a place only for the directions of fibers and sheets.
    only_surfaces : bool
        It holds the triangles of linear tetrahedra on the surfaces, and nothing inside.
    """

    write: CellWriter
    usual: Resampling
    only_directions: bool = False
    only_surfaces: bool = False

    def __call__(
        self,
        mesh: HexMesh,
        path: Path,
        fields: tuple[MeshField, ...],
        wanted: Resampling | None = None,
    ) -> Written:
        """Resample a mesh and write it; the notes say what that has cost."""
        chosen = wanted or self.usual
        if self.only_surfaces and chosen.kind != TET4.name:
            raise MeshError(f"{path.name}: A file of surfaces holds flat triangles: choose tet4.")
        cells = resample(mesh, chosen)
        notes = [_triangles(mesh, cells) if self.only_surfaces else str(fidelity(mesh, cells))]
        written = self.write(cells, path, sample(cells, fields))
        lost = [f.name for f in fields if self.only_directions and f.name not in (FIBER, SHEET)]
        if lost:
            notes.append(f"{path.name} has no place for the fields {', '.join(lost)}")
        return replace(written, notes=(*notes, *written.notes))


def _triangles(mesh: HexMesh, cells: Resampled) -> str:
    """What surfaces as triangles have cost."""
    mean, largest = surface_distance(mesh, cells)
    count = sum(len(faces) for faces in cells.surfaces.values())
    return (
        f"{count} triangles: {mean:.3f} mm from the exact surface on average and {largest:.3f} mm "
        "at most"
    )
