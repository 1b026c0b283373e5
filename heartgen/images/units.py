"""Units of length that headers of text declare, and whether they declare a voxel size at all."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping

from heartgen.images.file_kinds import refuse

LENGTHS = {
    1e3: ("m", "meter", "metre"),
    10.0: ("cm", "centimeter", "centimetre"),
    1.0: ("mm", "millimeter", "millimetre"),
    1e-3: ("um", "μm", "µm", "micron", "micrometer", "micrometre"),
    1e-6: ("nm", "nanometer", "nanometre"),
}
"""Names of units, without a plural, by their length in mm."""

TIMES = ("s", "sec", "second", "ms", "msec", "millisecond", "us", "min", "hz")
"""Units of an axis that is no length."""

UNSAID = ("", "?", "???", "none", "unknown", "n/a")
"""Words for a unit that is not given: mm is meant, as in other formats."""

AXES = 3
"""Axes of the world."""


def nrrd_unit(fields: Mapping[str, str], name: str) -> float:
    """Length in mm of the unit that the header of an NRRD image declares.

    Parameters
    ----------
    fields : mapping of str to str
        Fields of the header, their names in lower case.
    name : str
        Name of the image.

    Returns
    -------
    float
        That of ``space units`` for an image in the world, else of its axes' ``units``.

    Raises
    ------
    InputError
        If a unit is not known, or axes have different ones.
    """
    placed = "space directions" in fields
    text = fields.get("space units" if placed else "units", "")
    quoted = re.findall(r'"([^"]*)"', text)
    return _common(quoted or text.split(), name)


def meta_unit(fields: Mapping[str, str], name: str) -> float:
    """Length in mm of the ``DistanceUnits`` of a MetaImage; parameters as of `nrrd_unit`.

    Parameters
    ----------
    fields : mapping of str to str
        Fields of the header, their names in lower case.
    name : str
        Name of the image.
    """
    return _common([fields.get("distanceunits", "")], name)


def nrrd_is_spaced(fields: Mapping[str, str]) -> bool:
    """Whether the header of an NRRD image says how large the voxels are along three axes.

    Parameters
    ----------
    fields : mapping of str to str
        Fields of the header, their names in lower case.
    """
    directions = re.findall(r"\([^()]*\)", fields.get("space directions", ""))
    return len(directions) >= AXES or _finite(fields.get("spacings", "")) >= AXES


def meta_is_spaced(fields: Mapping[str, str]) -> bool:
    """Whether the header of a MetaImage says how large the voxels are along three axes.

    Parameters
    ----------
    fields : mapping of str to str
        Fields of the header, their names in lower case.
    """
    return any(_finite(fields.get(key, "")) >= AXES for key in ("elementspacing", "elementsize"))


def _common(words: Iterable[str], name: str) -> float:
    """The one unit of all axes that are lengths."""
    found = {_length(word, name): word for word in words if _plain(word) not in TIMES}
    if len(found) > 1:
        refuse(
            name,
            f"The header gives its axes different units ({', '.join(found.values())}): write it "
            "with one for all.",
        )
    return next(iter(found), 1.0)


def _length(word: str, name: str) -> float:
    """Length of a unit, mm."""
    plain = _plain(word)
    if plain in UNSAID:
        return 1.0
    for length, names in LENGTHS.items():
        if plain in names:
            return length
    refuse(
        name,
        f"The header gives lengths in {word[:20]!r}, a unit that is not known: write them in mm.",
    )


def _plain(word: str) -> str:
    """A unit in lower case, without a plural."""
    word = word.strip().lower()
    return word.removesuffix("s") if len(word) > len("nms") else word


def _finite(text: str) -> int:
    """How many finite numbers stand in a field."""
    count = 0
    for word in text.split():
        try:
            count += math.isfinite(float(word))
        except ValueError:
            continue
    return count
