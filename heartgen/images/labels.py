"""Which voxels are myocardium: those of a binary image, or of the label asked for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.images.mask import Finding
from heartgen.images.volume import Label, Volume
from heartgen.wording import wording

MAX_LABELS = 256
"""Distinct values beyond which an image is gray, not labeled: whole-body label maps have 120."""

WHOLE = 1e-3
"""Farthest from a whole number that a label may be: one that was saved as a scaled float and read
again comes back as 2.9999998."""

LISTED = 12
"""Labels named in a message."""

ALIKE = 0.5
"""Share of neighbors with equal values from which many values are labels: structures have an
inside, gray values change from voxel to voxel."""

WRITE = "write what they are under File is: Labels as written below"
"""What to do on the page, where no scheme fits."""


def myocardium(
    volume: Volume, label: Label | None = None
) -> tuple[NDArray[np.bool_] | None, tuple[Finding, ...]]:
    """Select the myocardium.

    Parameters
    ----------
    volume : Volume
        Three axes, of a real type, finite.
    label : int, str, sequence of them, or None
        Label(s) to take as myocardium, by value or by name; None for a binary image, in which
        every voxel that is not 0 is.

    Returns
    -------
    voxels : (nx, ny, nz) bool or None
        The myocardium; None if it cannot be told.
    findings : tuple of Finding
        Why it cannot.
    """
    values, names = volume.values, volume.label_names
    if label is None:
        voxels = values != 0
        inside = values[voxels]
        if inside.size == 0 or (inside == inside[0]).all():
            return voxels, ()
        return None, (_not_binary(values, names),)
    chosen, unknown = find_labels(label, names)
    voxels = np.isin(values, chosen)
    unknown += [str(number) for number in chosen if not (values == number).any()]
    if not unknown:
        return voxels, ()
    missing = Finding(
        "labels",
        f"There is no label {' or '.join(unknown)} in the image, which holds "
        f"{describe_present(values, names)}: "
        f"{wording('pass one of these as label=...', 'pass one of these as --label', WRITE)}.",
        fatal=True,
    )
    return None, (missing,)


def whole_numbers(values: NDArray[Any]) -> NDArray[Any]:
    """Labels that came back from floating point as whole numbers; other values as they are.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Voxel values, finite.

    Returns
    -------
    (nx, ny, nz) of a real type
    """
    if values.dtype.kind != "f":
        return values
    rounded: NDArray[Any] = np.rint(values)
    # What is far below 1 throughout is a mask of small values, not one that is empty.
    if (np.abs(values - rounded) > WHOLE).any() or not rounded.any():
        return values
    return rounded


def find_labels(label: Label, names: Mapping[int, str]) -> tuple[list[int], list[str]]:
    """Numbers of the labels asked for, and what was asked for that has none.

    Parameters
    ----------
    label : int, str or sequence of them
        What is asked for, by number or by name.
    names : mapping of int to str
        Names of the label values, if any are known.
    """
    asked = list(label) if isinstance(label, Iterable) and not isinstance(label, str) else [label]
    by_name = {name.strip().lower(): number for number, name in names.items()}
    numbers, unknown = [], []
    for one in asked:
        number = by_name.get(str(one).strip().lower())
        if number is None:
            number = _whole(one)
        if number is None:
            unknown.append(repr(one))
        else:
            numbers.append(number)
    return numbers, unknown


def describe_label(number: float, names: Mapping[int, str]) -> str:
    """A label value and, in quotes, its name if it has one.

    Parameters
    ----------
    number : float
        The label's value.
    names : mapping of int to str
        Names of the label values, if any are known.
    """
    name = names.get(int(number)) if float(number).is_integer() else None
    return f"{number:g}" if name is None else f"{number:g} {name!r}"


def describe_present(values: NDArray[Any], names: Mapping[int, str]) -> str:
    """Labels of an image and how many voxels each has; of very many, the commonest.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Labels; 0 is the background.
    names : mapping of int to str
        Names of the label values, if any are known.
    """
    labels, counts = np.unique(values[values != 0], return_counts=True)
    shown = np.sort(np.argsort(-counts, kind="stable")[:LISTED])
    listed = [f"{describe_label(labels[i], names)} ({counts[i]} voxels)" for i in shown.tolist()]
    if len(labels) > LISTED:
        listed.append(f"{len(labels) - LISTED} more")
    return ", ".join(listed) or "only 0"


def not_labels(values: NDArray[Any]) -> Finding | None:
    """Whole numbers, and not too many different ones: labels, not gray values.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Voxel values, finite.
    """
    distinct = np.unique(values)
    whole = values.dtype.kind != "f" or bool((distinct == np.round(distinct)).all())
    if len(distinct) <= LISTED and whole:
        return None
    if len(distinct) <= MAX_LABELS and whole and _share_alike(values) >= ALIKE:
        return None
    return Finding(
        "binary",
        f"The image is gray and not a mask, it holds {len(distinct)} different values from "
        f"{distinct[0]:g} to {distinct[-1]:g}: segment the myocardium, or threshold it.",
        fatal=True,
    )


def say_labels() -> str:
    """What to do where a file holds several labels and nothing is said of them."""
    return wording(
        "pass the myocardium's as label=..., or say what they all are with read_labels",
        "pass the myocardium's as --label, or say what they all are with --labels",
        "say under File is what they are",
    )


def _share_alike(values: NDArray[Any]) -> float:
    """Share of neighbors in a slice that are equal, among those of which none is 0."""
    one, other = values[1:], values[:-1]
    both = (one != 0) & (other != 0)
    return float((one == other)[both].mean()) if both.any() else 1.0


def _whole(one: int | str) -> int | None:
    """A label that is, or spells, a whole number."""
    try:
        number = float(one)
    except (TypeError, ValueError):
        return None
    return int(number) if number.is_integer() else None


def _not_binary(values: NDArray[Any], names: Mapping[int, str]) -> Finding:
    """Offer the labels of a label image; say of a gray image that it is one."""
    return not_labels(values) or Finding(
        "binary",
        f"The image is not binary, it holds the labels {describe_present(values, names)}: "
        f"{say_labels()}.",
        fatal=True,
    )
