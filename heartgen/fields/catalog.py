"""The fields that can be had by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from heartgen.errors import InputError
from heartgen.fields.axes import HeartAxes, heart_axes
from heartgen.fields.coordinates import circumferential, longitudinal
from heartgen.fields.euler import fiber_angles
from heartgen.fields.fibers import FiberRule, fiber_frames
from heartgen.fields.segments import segments_of_elements
from heartgen.fields.wall import wall_of
from heartgen.fields.wall_shape import curvatures, wall_thickness
from heartgen.mesh.field import MeshField
from heartgen.mesh.hexmesh import HexMesh
from heartgen.renamed import new_word, takes_former_keywords

FIBER, SHEET, SHEET_NORMAL = "fiber", "sheet", "sheet normal"
"""Names of the fields of directions."""

DIRECTIONS = "fibers"
"""By which these three are asked for."""

FIBER_ANGLES = "fiber angles"
"""Name of the field of angles from which cmGui, zinc and OpenCMISS make fibers."""

AHA = "aha segment"
"""Name of the field of segments."""


@takes_former_keywords
def make_fields(
    mesh: HexMesh,
    names: Iterable[str] | None = None,
    *,
    rule: FiberRule | None = None,
    septal_direction: Sequence[float] | None = None,
) -> tuple[MeshField, ...]:
    """Make fields on a mesh.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    names : iterable of str, optional
        Of `FIELDS`; all if omitted.
    rule : FiberRule, optional
        Angles of the fibers.
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, world (LPS), see `heart_axes`.

    Returns
    -------
    tuple of MeshField

    Raises
    ------
    InputError
        If there is no such field.
    MeshError
        If the direction does not tell where the septum is.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> from heartgen.fields import make_fields
    >>> for field in make_fields(mesh, ["aha", "fibers"]):
    ...     print(field.name, field.values.shape)
    aha segment (72, 1)
    fiber (72, 64, 3)
    sheet (72, 64, 3)
    sheet normal (72, 64, 3)
    """
    chosen = check_names(FIELDS if names is None else names)
    if not chosen:
        return ()
    axes, rule = heart_axes(mesh, septal_direction), rule or FiberRule()
    return tuple(field for name in chosen for field in FIELDS[name](mesh, axes, rule))


def check_names(names: Iterable[str]) -> tuple[str, ...]:
    """Names, each once; `InputError` if there is no such field.

    Parameters
    ----------
    names : iterable of str
        Of fields, see `FIELDS`.
    """
    chosen = tuple(dict.fromkeys(new_word(name.strip()) for name in names))
    for name in chosen:
        if name not in FIELDS:
            raise InputError(f"field {name!r} is not known: choose among {', '.join(FIELDS)}")
    return chosen


def _coordinates(mesh: HexMesh, axes: HeartAxes, _: FiberRule) -> list[MeshField]:
    wall = wall_of(mesh)
    coordinates = [
        MeshField("transmural", wall.depth[..., None]),
        MeshField("longitudinal", longitudinal(mesh)[..., None]),
        MeshField("circumferential", circumferential(mesh, axes)[..., None]),
    ]
    if wall.free_wall.any():
        coordinates.append(MeshField("ventricle", wall.free_wall[:, None].astype(float)))
    return coordinates


def _segments(mesh: HexMesh, axes: HeartAxes, _: FiberRule) -> list[MeshField]:
    return [MeshField(AHA, segments_of_elements(mesh, axes)[:, None].astype(float))]


def _fibers(mesh: HexMesh, _: HeartAxes, rule: FiberRule) -> list[MeshField]:
    frames = np.moveaxis(fiber_frames(mesh, rule), -1, 0)
    names = (FIBER, SHEET, SHEET_NORMAL)
    return [MeshField(name, frame) for name, frame in zip(names, frames, strict=True)]


def _angles(mesh: HexMesh, _: HeartAxes, rule: FiberRule) -> list[MeshField]:
    return [MeshField(FIBER_ANGLES, fiber_angles(mesh, fiber_frames(mesh, rule)))]


def _thickness(mesh: HexMesh, _: HeartAxes, __: FiberRule) -> list[MeshField]:
    return [MeshField("wall thickness", wall_thickness(mesh)[..., None])]


def _curvature(mesh: HexMesh, _: HeartAxes, __: FiberRule) -> list[MeshField]:
    return [MeshField("curvature", curvatures(mesh))]


FIELDS: dict[str, Callable[[HexMesh, HeartAxes, FiberRule], list[MeshField]]] = {
    "coordinates": _coordinates,
    "aha": _segments,
    DIRECTIONS: _fibers,
    "angles": _angles,
    "thickness": _thickness,
    "curvature": _curvature,
}
"""What can be asked for, and its maker: transmural, longitudinal and circumferential coordinate
and, with two of them, the ventricle (0 left and septum, 1 right); AHA segment; fiber, sheet and
sheet-normal direction; angles of these from the local coordinates, rad; wall thickness, mm;
circumferential and longitudinal curvature, 1/mm."""
