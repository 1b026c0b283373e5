"""`compare`: what a pair or a series of meshes of one heart tells about its motion."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Protocol

import numpy as np

from heartgen.errors import InputError, MeshError
from heartgen.fields import Indices, Strains, clinical_indices, global_strains
from heartgen.fields.indices import DENSITY
from heartgen.mesh import HexMesh
from heartgen.renamed import takes_former_keywords

SAME_WALL = 0.15
"""By how much, as a share, left ventricular walls of one heart may differ in volume unremarked.

Muscle keeps its volume within 4 % (Yin et al. 1996, doi:10.1152/ajpheart.1996.271.5.H1864); more
is for contours: between diastole and systole of 60 patients, labels differ by 15 % (median), and
78 % of all pairs of these patients by more than that."""


class HasMesh(Protocol):
    """A result of `heartgen.personalize`, or whatever else has a mesh."""

    @property
    def mesh(self) -> HexMesh:
        """The mesh; mm, world (LPS)."""


@dataclass(frozen=True)
class Comparison:
    """A heart in several states.

    Attributes
    ----------
    names : tuple of str
        Of the states, in order.
    indices : tuple of Indices
        Clinical indices of each state.
    diastole, systole : int
        States with the largest and the smallest left cavity, counted from 0.
    lv_stroke_volume, lv_ejection_fraction : float
        Difference of the left cavity's volume between these, ml, and as a share of the largest.
    rv_stroke_volume, rv_ejection_fraction : float or None
        Of the right cavity, from its own largest to its own smallest volume; None without one.
    strains : tuple of Strains or None
        Of each state against the diastole; None where elements do not correspond.
    notes : tuple of str
        That the states may be of two hearts; why strains are missing, or of part of the wall only.
    """

    names: tuple[str, ...]
    indices: tuple[Indices, ...]
    diastole: int
    systole: int
    lv_stroke_volume: float
    lv_ejection_fraction: float
    rv_stroke_volume: float | None
    rv_ejection_fraction: float | None
    strains: tuple[Strains | None, ...]
    notes: tuple[str, ...] = ()

    def to_json(self) -> str:
        """JSON text."""
        return json.dumps(asdict(self), indent=1, allow_nan=False)

    def __str__(self) -> str:
        lines = [
            f"{self.names[self.diastole]} to {self.names[self.systole]}: "
            f"ejection fraction {self.lv_ejection_fraction:.1%}"
        ]
        found = self.strains[self.systole]
        if found is not None:
            lines.append(
                f"  strains: longitudinal {found.longitudinal:+.1%}, circumferential "
                f"{found.circumferential:+.1%}, radial {found.radial:+.1%}"
            )
        return "\n".join(lines + [f"  note: {note}" for note in self.notes])


@takes_former_keywords
def compare(
    results: Sequence[HasMesh | HexMesh],
    names: Sequence[str] | None = None,
    septal_direction: Sequence[float] | None = None,
) -> Comparison:
    """Compare meshes of one heart in several states, such as diastole and systole.

    Parameters
    ----------
    results : sequence of Personalization or HexMesh
        At least two, fitted with the same options: strains need elements that correspond.
    names : sequence of str, optional
        Of the states; numbered from 1 if omitted.
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, see `heartgen.fields.heart_axes`.

    Returns
    -------
    Comparison

    Raises
    ------
    InputError
        If there is nothing to compare.

    Examples
    --------
    >>> import heartgen
    >>> import numpy as np
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> mesh = heartgen.personalize(mask, optimize=False).mesh
    >>> smaller = mesh.transformed(np.diag([0.9, 0.9, 0.9, 1.0]))
    >>> found = heartgen.compare([mesh, smaller], ["diastole", "systole"])
    >>> round(found.lv_ejection_fraction, 3)
    0.271
    >>> round(found.strains[1].longitudinal, 2)
    -0.1
    """
    meshes = [each if isinstance(each, HexMesh) else each.mesh for each in results]
    called = tuple(str(n + 1) for n in range(len(meshes))) if names is None else tuple(names)
    if len(meshes) < 2 or len(called) != len(meshes):
        raise InputError(
            f"{len(meshes)} meshes and {len(called)} names make no comparison: give at least two "
            "meshes of one heart, and a name for each or none"
        )
    indices = tuple(clinical_indices(mesh, septal_direction) for mesh in meshes)
    left = np.array([found.lv_cavity_volume for found in indices])
    right = [found.rv_cavity_volume for found in indices if found.rv_cavity_volume is not None]
    diastole, systole = int(left.argmax()), int(left.argmin())
    rv_stroke = max(right) - min(right) if len(right) == len(meshes) else None
    strains, notes = _strains(meshes, called, diastole)
    return Comparison(
        names=called,
        indices=indices,
        diastole=diastole,
        systole=systole,
        lv_stroke_volume=float(left.max() - left.min()),
        lv_ejection_fraction=float(1 - left.min() / left.max()),
        rv_stroke_volume=rv_stroke,
        rv_ejection_fraction=None if rv_stroke is None else rv_stroke / max(right),
        strains=strains,
        notes=_two_hearts(indices, called) + notes,
    )


def _two_hearts(indices: Sequence[Indices], names: Sequence[str]) -> tuple[str, ...]:
    """A note if the walls differ more than those of one heart do."""
    walls = np.array([found.lv_mass / DENSITY for found in indices])
    small, large = int(walls.argmin()), int(walls.argmax())
    more = walls[large] / walls[small] - 1
    if not more > SAME_WALL:
        return ()
    return (
        f"{names[large]} and {names[small]}: the left ventricle's wall has {walls[large]:.0f} and "
        f"{walls[small]:.0f} ml, {more:.0%} more, though muscle keeps its volume: make sure that "
        "these are states of one patient, and that the masks show the same part of the wall",
    )


def _strains(
    meshes: Sequence[HexMesh], names: Sequence[str], reference: int
) -> tuple[tuple[Strains | None, ...], tuple[str, ...]]:
    """Strains of all meshes against one of them, and why some are missing or not of all."""
    strains: list[Strains | None] = []
    notes = []
    for mesh, name in zip(meshes, names, strict=True):
        try:
            found = global_strains(meshes[reference], mesh)
            strains.append(found)
            if not found.whole:
                notes.append(
                    f"{name}: strains of {found.share:.0%} of the wall: the right ventricle begins "
                    f"at other elements than in {names[reference]}"
                )
        except MeshError as error:
            strains.append(None)
            notes.append(f"{name}: no strains against {names[reference]}: {error}")
    return tuple(strains), tuple(notes)
