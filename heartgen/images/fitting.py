"""Which scheme a label map fits, by where its labels lie: wall around pool, pools apart."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from heartgen.images.distance import box_around, inner_distance
from heartgen.images.faces import shared_faces
from heartgen.images.labels import describe_present
from heartgen.images.mask import Finding
from heartgen.images.schemes import EXAMPLE, SCHEMES, Scheme

ENCLOSED = 0.6
"""Share of a pool's surface from which the myocardium on it is the pool's own wall. A left
ventricle is open at the base alone, and at a right one only the septum is left ventricular: 0.89 to
1.00 and 0.16 to 0.34 in 40 stacks of ACDC."""

TOUCHING = 0.06
"""Share of a structure's surface on the left ventricle's pool from which it is no right pool: the
septum parts them, and 0.03 is the most in 120 stacks of ACDC (where slices of 10 mm meet). An
infarct has some 0.3 there, a left atrium 0.1."""

BELONGING = 0.41
"""`belonging` from which a structure is a part of the left ventricle's wall: 0.36 at most of right
pools in 120 stacks of ACDC; 0.46 at least of 238 scars drawn into these walls, through them or in
their outer half, over 25 to 200 degrees."""

THICKNESS = 95.0
"""Percentile of the wall's distances from the pool that counts as its thickness; beyond lie the
apex under the lowest pool, and stray voxels."""


def guess_scheme(
    values: NDArray[Any], spacing: NDArray[np.float64], names: Mapping[int, str]
) -> tuple[Scheme | None, Finding]:
    """Find the only known scheme that fits a label map.

    It fits if it knows all labels of the map, if what it calls the left ventricle's blood pool is
    enclosed by what it calls the left ventricle's myocardium, and if the other parts lie where
    `misfit` asks them to. Schemes that mean the same by the labels of the map count as one.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Voxel values, finite.
    spacing : (3,) float64
        Voxel size, mm.
    names : mapping of int to str
        Names of the label values, if any are known.

    Returns
    -------
    scheme : Scheme or None
        None if not exactly one fits.
    finding : Finding
        Which one fits, or, fatal, that none or several do, and why.
    """
    present = np.unique(values[values != 0])
    fitting: dict[tuple[tuple[int, ...], ...], list[Scheme]] = {}
    reasons = []
    for scheme in SCHEMES.values():
        if not np.isin(present, scheme.labels).all():
            continue
        if enclosure(values, scheme.lv_pool, scheme.lv_wall, spacing) <= ENCLOSED:
            continue
        wrong = misfit(values, scheme, spacing) or _swapped(values, scheme, spacing)
        if wrong is None:
            fitting.setdefault(_meaning(scheme, present), []).append(scheme)
        else:
            reasons.append(f"{scheme.name} because {wrong}")
    if len(fitting) == 1:
        found, *same = next(iter(fitting.values()))
        also = "".join(f", as in {scheme.name}" for scheme in same)
        return found, Finding("labels", f"The labels were read by the scheme {found.name}{also}.")
    several = ", ".join(scheme.name for alike in fitting.values() for scheme in alike)
    why = f" ({'; '.join(f'not {reason}' for reason in reasons)})" if reasons else ""
    return None, Finding(
        "labels",
        f"{f'Several schemes ({several}) fit' if fitting else 'No scheme fits'} the labels "
        f"{describe_present(values, names)}{why}: give one of {', '.join(SCHEMES)}, or the labels "
        f"themselves, such as {EXAMPLE}.",
        fatal=True,
    )


def misfit(values: NDArray[Any], scheme: Scheme, spacing: NDArray[np.float64]) -> str | None:
    """Say why labels do not lie as a scheme has them.

    The left ventricle's myocardium lies around its own pool; the right pool lies outside that
    myocardium and apart from the left pool; scars lie within the myocardium.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Labels.
    scheme : Scheme
        What they are said to mean.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    str or None
        A clause, with the numbers of the labels; None if nothing contradicts the scheme.
    """
    wall, left, right = (_numbers(s) for s in (scheme.lv_wall, scheme.lv_pool, scheme.rv_pool))
    around_left, around_right = (
        enclosure(values, pool, scheme.lv_wall, spacing)
        for pool in (scheme.lv_pool, scheme.rv_pool)
    )
    if around_right > max(around_left, ENCLOSED):
        return (
            f"the left ventricle's myocardium (label {wall}) encloses the right ventricle's pool "
            f"({right}) and not the left's ({left})"
        )
    if belonging(values, scheme.rv_pool, scheme, spacing) > BELONGING:
        return (
            f"what would be the right ventricle's pool (label {right}) lies within the left "
            f"ventricle's wall ({wall}), as a scar does"
        )
    if enclosure(values, scheme.rv_pool, scheme.lv_pool, spacing) > TOUCHING:
        return (
            f"what would be the right ventricle's pool (label {right}) touches the left "
            f"ventricle's ({left}), with no wall between them"
        )
    if not np.isin(values, scheme.scars).any():
        return None
    scar, muscle = (_numbers(s) for s in (scheme.scars, scheme.lv_myocardium))
    if belonging(values, scheme.scars, scheme, spacing) <= BELONGING:
        return f"what would be scar (label {scar}) lies outside the left wall ({muscle})"
    return None


def enclosure(
    values: NDArray[Any],
    pool: tuple[int, ...],
    wall: tuple[int, ...],
    spacing: NDArray[np.float64],
) -> float:
    """Share of a pool's surface that a wall covers; 0 without a pool.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Labels.
    pool, wall : tuple of int
        Labels of blood pool and myocardium.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    float
    """
    inside = np.isin(values, pool)
    surface = float(shared_faces(inside, ~inside, spacing).sum())
    covered = float(shared_faces(inside, np.isin(values, wall), spacing).sum())
    return covered / surface if surface > 0 else 0.0


def belonging(
    values: NDArray[Any], part: tuple[int, ...], scheme: Scheme, spacing: NDArray[np.float64]
) -> float:
    """How much a part belongs to the left ventricle's wall.

    The mean of two shares: of its voxels, those as near to the left pool as the myocardium is; of
    its surface, what the rest of the left ventricle covers.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Labels.
    part : tuple of int
        Labels of the part.
    scheme : Scheme
        Says which labels are the left ventricle's.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    float
        From 0 to 1; 0 if there is no part, no pool or no myocardium.
    """
    box = box_around(np.isin(values, scheme.labels), 0.0, spacing)
    asked, pool, wall = (
        np.isin(values[box], labels) for labels in (part, scheme.lv_pool, scheme.lv_myocardium)
    )
    if not (asked.any() and pool.any() and wall.any()):
        return 0.0
    distance = inner_distance(~pool, spacing)
    near = float((distance[asked] <= np.percentile(distance[wall], THICKNESS)).mean())
    rest = tuple(label for label in scheme.lv_wall + scheme.lv_pool if label not in part)
    return (near + enclosure(values[box], part, rest, spacing)) / 2


def _swapped(values: NDArray[Any], scheme: Scheme, spacing: NDArray[np.float64]) -> str | None:
    """Say so if scar and pool seem to have each other's labels: a pool is the thicker one."""
    pool, scar = (depth(values, part, spacing) for part in (scheme.lv_pool, scheme.scars))
    if scar < pool:
        return None
    return (
        f"what would be scar (label {_numbers(scheme.scars)}) is thicker than the left pool "
        f"({_numbers(scheme.lv_pool)})"
    )


def depth(values: NDArray[Any], part: tuple[int, ...], spacing: NDArray[np.float64]) -> float:
    """Distance from a part's innermost voxel to the nearest one outside it, mm; 0 without a part.

    Parameters
    ----------
    values : (nx, ny, nz) of a real type
        Labels.
    part : tuple of int
        Labels of the part.
    spacing : (3,) float64
        Voxel size, mm.

    Returns
    -------
    float
    """
    return float(inner_distance(np.isin(values, part), spacing).max())


def _meaning(scheme: Scheme, present: NDArray[Any]) -> tuple[tuple[int, ...], ...]:
    """What a scheme makes of the labels that are there."""
    parts = (scheme.lv_wall, scheme.lv_pool, scheme.rv_pool, scheme.rv_myocardium)
    return tuple(tuple(label for label in part if label in present) for part in parts)


def _numbers(labels: tuple[int, ...]) -> str:
    """Labels as text."""
    return " and ".join(map(str, labels))
