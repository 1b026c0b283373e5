"""Named structures of a file, which may overlap: segments, contours, a file for each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.images.file_kinds import refuse
from heartgen.images.labels import WRITE, describe_label, find_labels, say_labels
from heartgen.images.mask import Finding
from heartgen.images.schemes import SCHEMES, Scheme
from heartgen.images.volume import Coded, Label, Volume
from heartgen.wording import wording

PRIORITY = (
    "others",
    "rv_openings",
    "rv_myocardium",
    "lv_myocardium",
    "scars",
    "rv_pool",
    "lv_pool",
)
"""Roles in the order in which they are drawn over each other. Pools come after walls: a wall that
was drawn as an outline is what remains of it around its pool."""

HALF = 0.5
"""Where fractional structures end."""

LISTED = 6
"""Names in a message that are enough to recognize a file by."""


@dataclass(frozen=True)
class Structures:
    """Named structures on one grid.

    Attributes
    ----------
    file : str
        Name of the file or folder, for messages.
    names : mapping of int to str
        Names by the numbers of the structures.
    load : callable
        Takes numbers of structures and a frame from 0; returns a `Volume` whose values are
        (nx, ny, nz, n), one layer for each number, from 0 outside to 1 inside.
    codes : mapping of int to Coded
        Codes of the structures that have some.
    frames : int
        Frames of a cine.
    kind : str
        What the file calls its structures.
    """

    file: str
    names: Mapping[int, str]
    load: Callable[[Sequence[int], int], Volume]
    codes: Mapping[int, Coded] = field(default_factory=dict)
    frames: int = 1
    kind: str = "segment"

    def describe(self) -> str:
        """Numbers and names; of very many, the first."""
        listed = [describe_label(number, self.names) for number in self.names]
        more = [f"{len(listed) - LISTED} more"] if len(listed) > LISTED else []
        return ", ".join(listed[:LISTED] + more)


def choose(structures: Structures, label: Label | None) -> list[int]:
    """Numbers of the structures that are myocardium.

    Parameters
    ----------
    structures : Structures
        What the file holds.
    label : int, str, sequence of them, or None
        Numbers or names; None if there is only one structure.

    Returns
    -------
    list of int

    Raises
    ------
    InputError
        If there is none of that number or name, or several and no label.
    """
    names, offered, kind = structures.names, structures.describe(), structures.kind
    if label is None:
        if len(names) == 1:
            return list(names)
        refuse(
            structures.file,
            f"The file holds the {kind}s {offered}: {say_labels()}, by number or name.",
        )
    numbers, unknown = find_labels(label, names)
    unknown += [str(number) for number in numbers if number not in names]
    if unknown:
        refuse(
            structures.file,
            f"There is no {kind} {' or '.join(unknown)} in the file, which holds {offered}: "
            f"{wording('pass one of these as label=...', 'pass one of these as --label', WRITE)}.",
        )
    return numbers


def united(structures: Structures, numbers: Sequence[int], frame: int) -> Volume:
    """The union of structures; fractional ones keep their fractions.

    Parameters
    ----------
    structures : Structures
        What the file holds.
    numbers : sequence of int
        Those to unite.
    frame : int
        Frame of a cine, from 0.

    Returns
    -------
    Volume
        Values (nx, ny, nz).
    """
    layers = structures.load(numbers, frame)
    return replace(layers, values=layers.values.max(axis=-1))


def joined(structures: Structures, scheme: Scheme | None, frame: int) -> Volume:
    """Structures as a label map: the number of the structure that each voxel is in.

    Parameters
    ----------
    structures : Structures
        What the file holds.
    scheme : Scheme or None
        What they are; where two overlap, it decides. None if that is not known.
    frame : int
        Frame of a cine, from 0.

    Returns
    -------
    Volume
        Values (nx, ny, nz), 0 where there is no structure.

    Raises
    ------
    InputError
        If structures overlap and nothing is known of what they are.
    """
    numbers = list(structures.names)
    if scheme is not None and scheme.name not in SCHEMES:
        numbers = [number for number in numbers if number in scheme.labels]
    layers = structures.load(numbers, frame)
    inside = layers.values > HALF
    overlap = inside.sum(axis=-1) > 1
    if overlap.any() and scheme is None:
        first, second = np.flatnonzero(inside[overlap][0])[:2]
        roles = "lv_myocardium=NAME,lv_pool=NAME"
        named = wording(
            f"read_labels(path, dict({roles}))", f"--labels {roles}", f"{roles} under Labels"
        )
        refuse(
            structures.file,
            f"The {structures.kind}s {structures.names[numbers[first]]!r} and "
            f"{structures.names[numbers[second]]!r} overlap: say which are myocardium and pools, "
            f"such as {named}.",
        )
    values = np.zeros(inside.shape[:3], dtype=np.int32)
    for at in sorted(range(len(numbers)), key=lambda at: _rank(scheme, numbers[at])):
        values[inside[..., at]] = numbers[at]
    told = _overlap(structures, scheme, numbers, inside[overlap])
    return replace(
        layers,
        values=values,
        label_names=structures.names,
        findings=layers.findings + told,
    )


def _rank(scheme: Scheme | None, number: int) -> int:
    """When a structure is drawn; what has no role, first."""
    roles = [role for role in PRIORITY if scheme is not None and number in getattr(scheme, role)]
    return 1 + PRIORITY.index(roles[0]) if roles else 0


def _overlap(
    structures: Structures,
    scheme: Scheme | None,
    numbers: Sequence[int],
    several: NDArray[np.bool_],
) -> tuple[Finding, ...]:
    """Say what became of voxels (n, structures) that are in several structures."""
    if not len(several):
        return ()
    # A scar that is drawn over the myocardium is what a scar is.
    known = [at for at, number in enumerate(numbers) if _rank(scheme, number)]
    own = [at for at in known if scheme is not None and numbers[at] not in scheme.scars]
    crowded = several[:, own].sum(axis=1) > 1
    if not crowded.any():
        return ()
    involved = [structures.names[numbers[at]] for at in own if several[crowded, at].any()]
    return (
        Finding(
            "overlap",
            f"{structures.kind.capitalize()}s overlap in {int(crowded.sum())} voxels "
            f"({', '.join(map(repr, involved[:LISTED]))}): they were taken for blood pool before "
            "wall, and for left before right.",
        ),
    )
