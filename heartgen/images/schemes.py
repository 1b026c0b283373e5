"""What the labels of a label map mean: known schemes, and free ones."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeAlias

from heartgen.errors import InputError
from heartgen.images.file_kinds import refuse
from heartgen.images.labels import find_labels
from heartgen.images.volume import Label

ROLES = ("lv_myocardium", "lv_pool", "rv_pool", "rv_myocardium")
"""What a label may stand for in a free scheme."""


@dataclass(frozen=True)
class Scheme:
    """Labels of the parts of a heart.

    Attributes
    ----------
    name : str
        Name for reports.
    lv_myocardium, lv_pool, rv_pool, rv_myocardium : tuple of int
        Labels of walls and blood pools; empty if there are none.
    rv_openings : tuple of int
        Labels of what the right ventricle opens into: right atrium, pulmonary artery.
    others : tuple of int
        Labels of the scheme that no wall depends on.
    scars : tuple of int
        Labels within the left ventricle's myocardium, and a part of it: infarct, no-reflow.
    beside : tuple of int
        Labels of the right blood pool where the left ventricle alone is taken.
    """

    name: str
    lv_myocardium: tuple[int, ...]
    lv_pool: tuple[int, ...] = ()
    rv_pool: tuple[int, ...] = ()
    rv_myocardium: tuple[int, ...] = ()
    rv_openings: tuple[int, ...] = ()
    others: tuple[int, ...] = ()
    scars: tuple[int, ...] = ()
    beside: tuple[int, ...] = ()

    @property
    def lv_wall(self) -> tuple[int, ...]:
        """Labels of the left ventricle's myocardium, healthy or not."""
        return self.lv_myocardium + self.scars

    @property
    def is_one_wall(self) -> bool:
        """Whether both ventricles' walls have the same labels."""
        return bool(set(self.lv_wall) & set(self.rv_myocardium))

    @property
    def labels(self) -> tuple[int, ...]:
        """All labels of the scheme."""
        walls = self.lv_wall + self.rv_myocardium
        return walls + self.lv_pool + self.rv_pool + self.rv_openings + self.others + self.beside


Labeling: TypeAlias = str | Scheme | Mapping[str, Label]
"""A scheme: by name, as such, or as a label or labels for each role."""

SCHEMES = {
    scheme.name: scheme
    for scheme in (
        Scheme("acdc", lv_myocardium=(2,), lv_pool=(3,), rv_pool=(1,)),
        Scheme(
            "mmwhs",
            lv_myocardium=(205,),
            lv_pool=(500,),
            rv_pool=(600,),
            rv_openings=(550, 850),
            others=(420, 820),
        ),
        Scheme("ukbb", lv_myocardium=(2,), lv_pool=(1,), rv_pool=(3,)),
        Scheme("mnms", lv_myocardium=(2,), lv_pool=(1,), rv_pool=(3,)),
        Scheme("emidec", lv_myocardium=(2,), lv_pool=(1,), scars=(3, 4)),
        Scheme(
            "totalsegmentator",
            lv_myocardium=(1,),
            lv_pool=(3,),
            rv_pool=(5,),
            rv_openings=(4, 7),
            others=(2, 6),
        ),
    )
}
"""Of the challenges ACDC (Bernard et al. 2018), MM-WHS (Zhuang et al. 2019), M&Ms (Campello et al.
2021) and EMIDEC (Lalande et al. 2020), of UK Biobank segmentations (Bai et al. 2018), of
TotalSegmentator's task heartchambers_highres."""

KEPT = Scheme("heartgen", (1,), lv_pool=(2,), rv_pool=(3,), rv_myocardium=(1,), beside=(4,))
"""Of masks that heartgen itself writes: both walls are one. It is never guessed."""

KNOWN = f"{', '.join(SCHEMES)}, auto"
"""Names a user may give."""

EXAMPLE = "lv_myocardium=2,lv_pool=3,rv_pool=1"
"""A free scheme as it is written on the command line."""


def find_scheme(labeling: Labeling, names: Mapping[int, str], image: str) -> Scheme | None:
    """Turn what a user gives for a scheme into one.

    Parameters
    ----------
    labeling : str, Scheme, or mapping of str to labels
        See `Labeling`.
    names : mapping of int to str
        Names of the label values, if any are known.
    image : str
        Name of the image, for messages.

    Returns
    -------
    Scheme or None
        None for ``"auto"``: the image has to be asked, with `heartgen.images.fitting.guess_scheme`.

    Raises
    ------
    InputError
        If there is no such scheme, or roles and labels contradict each other.
    """
    if isinstance(labeling, Scheme):
        return labeling
    if isinstance(labeling, Mapping):
        return _free(labeling, names, image)
    name = str(labeling).strip().lower()
    if name == "auto":
        return None
    if name == KEPT.name:
        return KEPT
    if name not in SCHEMES:
        refuse(
            image,
            f"The scheme of labels {labeling!r} is unknown: give one of {KNOWN}, or the labels "
            f"themselves, such as {EXAMPLE}.",
        )
    return SCHEMES[name]


def scheme_from_text(text: str) -> Labeling:
    """Read a scheme as a user writes it.

    Parameters
    ----------
    text : str
        The name of a scheme, or roles and their labels: ``role=label,role=label``.

    Returns
    -------
    Labeling
        A role may be given more than once; a label that is no number is taken for a name.

    Raises
    ------
    InputError
        If a role has no label.
    """
    if "=" not in text:
        return text
    roles: dict[str, list[int | str]] = {}
    for part in text.split(","):
        role, _, label = part.partition("=")
        if not label.strip():
            raise InputError(
                f"labels {text!r} are not roles with their labels: write them like {EXAMPLE}"
            )
        roles.setdefault(role.strip(), []).append(label_from_text(label))
    return roles


def label_from_text(text: str) -> int | str:
    """Read a label: by its number if it is one, else by its name.

    Parameters
    ----------
    text : str
        A number or a name.
    """
    return int(text) if re.fullmatch(r"\s*-?\d+\s*", text) else text.strip()


def _free(roles: Mapping[str, Label], names: Mapping[int, str], image: str) -> Scheme:
    """A scheme from the labels of each role."""
    strange = [str(role) for role in roles if role not in ROLES]
    if strange:
        refuse(image, f"There is no role {', '.join(strange)}: give some of {', '.join(ROLES)}.")
    found: dict[str, tuple[int, ...]] = {}
    for role, label in roles.items():
        numbers, unknown = find_labels(label, names)
        if unknown or not numbers:
            what = " or ".join(unknown) or "given"
            refuse(
                image,
                f"There is no label {what} for {role}: give its number, such as {EXAMPLE}.",
            )
        found[role] = tuple(numbers)
    if "lv_myocardium" not in found:
        refuse(image, f"The label of lv_myocardium is missing: give it, such as {EXAMPLE}.")
    given = [number for numbers in found.values() for number in numbers]
    twice = sorted({number for number in given if given.count(number) > 1})
    if twice:
        refuse(image, f"Label {twice[0]} is given twice: give each label for one role.")
    return Scheme(name="given", **found)
