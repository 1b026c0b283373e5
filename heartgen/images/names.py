"""What structures of a heart are, by the names and SNOMED codes that their writers gave them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from heartgen.images.schemes import Scheme
from heartgen.images.volume import Coded

NAMED = "of the structures' names"
"""Name of a scheme that names make."""

WALLS = {"myo", "myocard", "myocardium", "myocardial", "m", "w", "muscle", "epi", "epicardium"}
"""Words for a ventricle's wall. An epicardial outline is one once its pool is taken out of it."""

SIDED_WALLS = {"wall", "walls"}
"""Words for a wall only beside that of a ventricle: chests have walls, too."""

POOLS = {"cavity", "pool", "bloodpool", "blood", "bp", "c", "endo", "endocardium", "lumen"}
"""Words for a ventricle's blood pool."""

SCARS = {"scar", "scars", "infarct", "fibrosis", "lge", "mvo", "reflow", "noreflow"}
"""Words for what lies in the left ventricle's myocardium and is a part of it."""

SEPTA = {"septum", "ivs"}
"""Words for the part of the left ventricle's wall that both ventricles share."""

ATRIA = {"atrium", "atria", "atrial", "interatrial", "appendage", "laa", "la", "ra"}
"""Words for atria; the right one opens into the right ventricle."""

ARTERIES = {"pulmonary", "pa", "rvot"}
"""Words for what the right ventricle opens into, unless it is a vein or a valve."""

APART = {"vein", "veins", "valve", "lung", "lateral", "third", "fourth", "brain", "papillary"}
"""Words that tell of something else, whatever stands beside them."""

CODES = {
    "49848007": "lv_myocardium",
    "T-32620": "lv_myocardium",
    "74281007": "lv_myocardium",
    "589001": "lv_myocardium",
    "73829009": "rv_openings",
    "T-32200": "rv_openings",
    "81040000": "rv_openings",
    "T-44000": "rv_openings",
    "45341000": "rv_openings",
    "82471001": "others",
    "T-32300": "others",
    "15825003": "others",
    "T-42000": "others",
}
"""Roles of SNOMED CT and SNOMED RT codes: myocardium of the left ventricle, myocardium, ventricular
septum; right atrium, pulmonary artery and its trunk; left atrium, aorta."""

CHAMBERS = {
    "87878005": "lv_pool",
    "T-32600": "lv_pool",
    "53085002": "rv_pool",
    "T-32500": "rv_pool",
}
"""Roles of codes of whole ventricles, which stand for their pools unless a name says more."""


BEGINNING = re.compile(r"([lr]v)(m|w|c|bp|myo\w*|endo\w*|epi\w*|wall|cavity|pool)")
END = re.compile(r"(endo|epi|myo)([lr]v)")
"""Sides and parts of ventricles that are written as one word."""


@dataclass(frozen=True)
class _Said:
    """What a name says: a role, and whether it named the part and the side of the ventricle."""

    role: str | None = None
    part: bool = True
    side: bool = True


def role_of(name: str, coded: Coded | None = None) -> str | None:
    """Tell what a structure is.

    Parameters
    ----------
    name : str
        Such as ``"LV blood pool"``, ``"Myo"`` or ``"heart_ventricle_left"``.
    coded : Coded, optional
        Its codes.

    Returns
    -------
    str or None
        A field of `Scheme`; None if that cannot be told. A name that says which part of a ventricle
        it is counts before codes, and codes count before a name that says no more than the side.
    """
    coded = coded or Coded()
    said = _read(name)
    if said.role is not None and said.part and said.side:
        return said.role
    joint = _read(" ".join((name, *coded.meanings)))
    candidates = (
        joint.role if joint.part else None,
        *(CODES.get(value) for value in coded.values),
        said.role,
        *(CHAMBERS.get(value) for value in coded.values),
        joint.role,
    )
    return next((role for role in candidates if role is not None), None)


def scheme_of_names(
    names: Mapping[int, str], codes: Mapping[int, Coded] | None = None
) -> Scheme | None:
    """Make the scheme that the names of structures tell.

    Parameters
    ----------
    names : mapping of int to str
        Names by label value or number of the structure.
    codes : mapping of int to Coded, optional
        Their codes.

    Returns
    -------
    Scheme or None
        None unless a left ventricle's myocardium is among them, and another part of ventricles.
    """
    found: dict[str, list[int]] = {}
    for number, name in names.items():
        role = role_of(name, (codes or {}).get(number))
        if role is not None:
            found.setdefault(role, []).append(number)
    parts = {"lv_myocardium", "lv_pool", "rv_pool", "rv_myocardium", "scars"} & found.keys()
    if "lv_myocardium" not in found or len(parts) < 2:
        return None
    return Scheme(NAMED, **{role: tuple(numbers) for role, numbers in found.items()})


def _read(name: str) -> _Said:
    """What a name says."""
    words = _words(name)
    if words & APART:
        return _Said("others" if words & (ATRIA | ARTERIES) else None)
    if words & ATRIA:
        right = "ra" in words or "right" in words
        return _Said("rv_openings" if right else "others")
    if words & ARTERIES:
        return _Said("rv_openings")
    if words & {"aorta", "ao", "aortic"}:
        return _Said("others")
    left = "lv" in words or {"left", "ventricle"} <= words or {"left", "ventricular"} <= words
    right = "rv" in words or {"right", "ventricle"} <= words or {"right", "ventricular"} <= words
    heart = left or right or bool(words & {"heart", "cardiac", "myocardial"})
    if words & SCARS:
        return _Said("scars" if not right else None)
    if words & SEPTA and not words & {"nasal", "nasi"}:
        return _Said("lv_myocardium")
    letters = {"m", "w", "c"}
    walls, pools = (w if left or right else w - letters for w in (WALLS, POOLS))
    if words & walls - {"muscle"} or (heart and words & (SIDED_WALLS | {"muscle"})):
        whole = words & {"epi", "epicardium"} and not heart
        wall = "rv_myocardium" if right and not left else "lv_myocardium"
        return _Said(None if whole else wall, side=left or right)
    if left == right:
        return _Said()
    return _Said("lv_pool" if left else "rv_pool", part=bool(words & pools))


def _words(name: str) -> set[str]:
    """Words of a name in lower case, those that were written as one (LVMyo, endoLV) apart."""
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = re.findall(r"[a-z]+", apart.lower())
    found: set[str] = set()
    for word in words:
        joined = BEGINNING.fullmatch(word) or END.fullmatch(word)
        found.update(joined.groups() if joined else (word,))
    return found
