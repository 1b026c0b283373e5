"""What to take of what a file holds: which frame, which structures, by which scheme."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from heartgen.images.checks import check_affine, check_finite
from heartgen.images.cine_frames import Frame, enclosed_volume, find_frame
from heartgen.images.fitting import guess_scheme
from heartgen.images.labels import describe_label, myocardium, not_labels, whole_numbers
from heartgen.images.mask import WALL, Finding
from heartgen.images.names import scheme_of_names
from heartgen.images.schemes import ROLES, Labeling, Scheme, find_scheme
from heartgen.images.structures import Structures, choose, joined, united
from heartgen.images.ventricles import RV_WALL, VentricleChoice, ventricular_walls
from heartgen.images.volume import Label, Volume

Found: TypeAlias = tuple[NDArray[np.bool_] | NDArray[np.uint8] | None, tuple[Finding, ...]]
"""Myocardium (nx, ny, nz), or what each voxel is (`WALL` and blood), and what there is to say."""

Select: TypeAlias = Callable[[Volume], Found]
"""Takes a volume; returns what was found in it."""

MM3_PER_ML = 1000.0


@dataclass(frozen=True)
class Taking:
    """What to take of what a file holds.

    Attributes
    ----------
    label : Label or None
        Labels or structures that are myocardium.
    scheme : Labeling or None
        What all labels are. With neither, the image is a mask, unless names tell more.
    ventricles : {"auto", "lv", "biv"}
        Which to take from a label map.
    rv_wall : float
        Thickness of a right ventricular wall that has to be built, mm.
    frame : int, str or None
        Which frame of a cine: number from 1, ``"ED"`` or ``"ES"``.
    """

    label: Label | None = None
    scheme: Labeling | None = None
    ventricles: VentricleChoice = "auto"
    rv_wall: float = RV_WALL
    frame: Frame | None = None


def take(held: Volume | Structures, taking: Taking, name: str) -> tuple[Volume, Select]:
    """Take one volume of what a file holds, and say how the myocardium is selected in it.

    Parameters
    ----------
    held : Volume or Structures
        What the file holds.
    taking : Taking
        What to take of it.
    name : str
        Name of the file, for messages.

    Returns
    -------
    volume : Volume
        Values (nx, ny, nz).
    select : callable
        See `Select`.

    Raises
    ------
    InputError
        If there is no such frame, structure or scheme.
    """
    is_map, scheme, told = _meaning(held, taking, name)
    select = (
        partial(
            ventricular_walls,
            scheme=scheme,
            ventricles=taking.ventricles,
            rv_wall=taking.rv_wall,
        )
        if is_map
        else partial(myocardium, label=None if isinstance(held, Structures) else taking.label)
    )

    def at(index: int) -> Volume:
        if isinstance(held, Volume):
            values = held.values[..., index] if held.values.ndim > 3 else held.values
            return replace(held, values=values)
        if is_map:
            return joined(held, scheme, index)
        return united(held, choose(held, taking.label), index)

    frames = held.frames if isinstance(held, Structures) else int(np.prod(held.values.shape[3:]))
    index, found = find_frame(
        taking.frame, frames, lambda i: _cavity(at(i), is_map, scheme, select), name
    )
    volume = at(index)
    return replace(volume, findings=told + found + volume.findings), select


def _meaning(
    held: Volume | Structures, taking: Taking, name: str
) -> tuple[bool, Scheme | None, tuple[Finding, ...]]:
    """Whether it is a label map, by which scheme (None: to be guessed), and what is to say."""
    if taking.label is not None:
        return False, None, ()
    if isinstance(held, Structures):
        names, named = held.names, scheme_of_names(held.names, held.codes)
    else:
        names, named = held.label_names, scheme_of_names(held.label_names, held.label_codes)
        if named is not None and taking.scheme is None:
            present = np.isin(named.labels, held.values)
            named = named if present.sum() > 1 else None  # a mask, if only one is there
    if taking.scheme is None:
        return named is not None, named, _read_by(named, names)
    scheme = find_scheme(taking.scheme, names, name)
    if scheme is None:
        return True, named, _read_by(named, names)
    return True, scheme, ()


def _read_by(scheme: Scheme | None, names: Mapping[int, str]) -> tuple[Finding, ...]:
    """Say what names were understood to mean."""
    if scheme is None:
        return ()
    understood = [
        f"{' and '.join(describe_label(number, names) for number in numbers)} as {role}"
        for role in (*ROLES, "scars")
        if (numbers := getattr(scheme, role))
    ]
    return (Finding("labels", f"The labels were read by their names: {', '.join(understood)}."),)


def _cavity(volume: Volume, is_map: bool, scheme: Scheme | None, select: Select) -> float:
    """Volume of the left ventricle's cavity, ml; 0 if none can be told."""
    if check_affine(volume.affine) or check_finite(volume.values):
        return 0.0
    volume = replace(volume, values=whole_numbers(volume.values))
    spacing = np.linalg.norm(volume.affine[:3, :3], axis=0)
    if is_map and scheme is None:
        if not_labels(volume.values):
            return 0.0
        scheme, _ = guess_scheme(volume.values, spacing, volume.label_names)
        if scheme is None:
            return 0.0
    if scheme is not None and scheme.lv_pool:
        voxels = int(np.isin(volume.values, scheme.lv_pool).sum())
        return voxels * float(np.prod(spacing)) / MM3_PER_ML
    parts, _ = select(volume)
    return 0.0 if parts is None else enclosed_volume(parts == WALL, volume.affine)
