"""An image as a file holds it, before anything is known about the heart in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from heartgen.images.mask import Finding

Label: TypeAlias = int | str | Sequence[int | str]
"""Number(s) or name(s) of the structure(s) to take as myocardium."""

LPS_FROM_RAS = np.array([[-1.0], [-1.0], [1.0], [1.0]])
"""Factors of the rows of an affine, from NIfTI's world (right, anterior, superior) to ours."""


@dataclass(frozen=True)
class Coded:
    """Codes that a writer gave a structure.

    Attributes
    ----------
    values : tuple of str
        Code values of type, modifier and region, in this order.
    meanings : tuple of str
        Their meanings in words.
    """

    values: tuple[str, ...] = ()
    meanings: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Volume:
    """Voxel values in the world.

    Attributes
    ----------
    values : (nx, ny, nz) or (nx, ny, nz, nt) of any type
        Voxel values; index order (i, j, k), frames last.
    affine : (4, 4) float64
        Voxel index to world coordinates, mm, LPS.
    label_names : mapping of int to str
        Names of the label values, where the file knows them.
    findings : tuple of Finding
        What the checks of the file saw.
    label_codes : mapping of int to Coded
        Codes of the label values, where the file has some.
    """

    values: NDArray[Any]
    affine: NDArray[np.float64]
    label_names: Mapping[int, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    label_codes: Mapping[int, Coded] = field(default_factory=dict)
