"""From labels to myocardium: the walls of the ventricles asked for."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from heartgen.images.checks import check_affine
from heartgen.images.file_kinds import refuse
from heartgen.images.fitting import guess_scheme, misfit
from heartgen.images.labels import describe_present, not_labels
from heartgen.images.mask import BESIDE, LEFT_BLOOD, RIGHT_BLOOD, WALL, Finding
from heartgen.images.rv_wall import Parts, build_rv_wall
from heartgen.images.schemes import Scheme
from heartgen.images.volume import Volume
from heartgen.wording import wording

VentricleChoice: TypeAlias = Literal["auto", "lv", "biv"]
"""Which ventricles to take: all that are labeled, the left, both."""

RV_WALL = 3.0
"""Thickness of a healthy right ventricular wall in mm; above 5 it is hypertrophied (Rudski et al.
2010)."""

RV_WALLS = (0.05, 30.0)
"""Thicknesses in mm that a right ventricular wall may have, newborn mouse to horse."""


def check_choices(ventricles: str, rv_wall: float, name: str) -> None:
    """Refuse a choice of ventricles that there is not, or a wall that no heart has.

    Parameters
    ----------
    ventricles : str
        What was asked for: "auto", "lv" or "biv".
    rv_wall : float
        Thickness of the right ventricular wall, mm.
    name : str
        Name of the image, for messages.
    """
    if ventricles not in get_args(VentricleChoice):
        refuse(name, f"The ventricles {ventricles!r} are unknown: give 'auto', 'lv' or 'biv'.")
    if not RV_WALLS[0] <= rv_wall <= RV_WALLS[1]:
        refuse(
            name,
            f"A right ventricular wall of {rv_wall:g} mm is not possible: give its thickness in "
            f"mm, from {RV_WALLS[0]:g} to {RV_WALLS[1]:g}.",
        )


def ventricular_walls(
    volume: Volume, scheme: Scheme | None, ventricles: VentricleChoice, rv_wall: float
) -> tuple[NDArray[np.uint8] | None, tuple[Finding, ...]]:
    """Unite the walls of the ventricles, the right one built if it is not labeled.

    Parameters
    ----------
    volume : Volume
        Labels, three axes, finite.
    scheme : Scheme or None
        What the labels mean; None to find the scheme that fits.
    ventricles : {"auto", "lv", "biv"}
        Which ventricles to take.
    rv_wall : float
        Thickness of the right ventricular wall if it has to be built, mm.

    Returns
    -------
    parts : (nx, ny, nz) uint8 or None
        `WALL` in the myocardium, `LEFT_BLOOD` and `RIGHT_BLOOD` in the pools of the ventricles
        taken, `BESIDE` in a right pool that is not; None if it cannot be told.
    findings : tuple of Finding
        Why it cannot, or how it was made.
    """
    if check_affine(volume.affine) is not None:  # said by who checks the image
        return None, ()
    values, names = volume.values, volume.label_names
    gray = not_labels(values)
    if gray is not None:
        return None, (gray,)
    findings: tuple[Finding, ...] = ()
    if scheme is None:
        spacing = np.linalg.norm(volume.affine[:3, :3], axis=0)
        scheme, guess = guess_scheme(values, spacing, names)
        findings += (guess,)
        if scheme is None:
            return None, findings
    wrong = _check_labels(volume, scheme, ventricles)
    if wrong is None and not scheme.is_one_wall:  # of one wall, none of the sides can be asked
        wrong = _check_sides(volume, scheme)
    if wrong is not None:
        return None, (*findings, wrong)
    unknown = np.setdiff1d(values, [0, *scheme.labels])
    if scheme.name != "given" and unknown.size:
        left_out = np.where(np.isin(values, unknown), values, 0)
        findings += (
            Finding(
                "labels",
                f"The scheme {scheme.name} does not know the labels "
                f"{describe_present(left_out, names)}: they were taken for background.",
            ),
        )
    lv_wall = np.isin(values, scheme.lv_wall)
    lv_pool = np.isin(values, scheme.lv_pool)
    rv_labeled = np.isin(values, scheme.rv_myocardium)
    rv_pool = np.isin(values, scheme.rv_pool)
    if ventricles == "lv" and not scheme.is_one_wall:
        return _united(lv_wall, {LEFT_BLOOD: lv_pool, BESIDE: rv_pool}), findings
    if not rv_labeled.any() and rv_pool.any():
        parts = Parts(lv_wall, lv_pool, rv_pool, np.isin(values, scheme.rv_openings))
        rv_labeled, said = build_rv_wall(parts, volume.affine, rv_wall)
        findings += said
    beside = np.isin(values, scheme.beside)
    pools = {LEFT_BLOOD: lv_pool, RIGHT_BLOOD: rv_pool, BESIDE: beside}
    return _united(lv_wall | rv_labeled, pools), findings


def _united(wall: NDArray[np.bool_], pools: Mapping[int, NDArray[np.bool_]]) -> NDArray[np.uint8]:
    """Wall, and pools by their codes, in one array."""
    parts = np.zeros(wall.shape, dtype=np.uint8)
    for code, pool in pools.items():
        parts[pool] = code
    parts[wall] = WALL
    return parts


def _check_labels(volume: Volume, scheme: Scheme, ventricles: str) -> Finding | None:
    """The labels that are needed are there: all that were given, of a named scheme the least."""
    present = np.unique(volume.values)
    right = scheme.rv_pool + scheme.rv_myocardium
    if scheme.name == "given":
        missing = [str(label) for label in scheme.labels if label not in present]
    else:
        missing = [str(label) for label in scheme.lv_myocardium if label not in present]
    held = describe_present(volume.values, volume.label_names)
    if missing:
        return Finding(
            "labels",
            f"There is no label {' or '.join(missing)} in the image, which holds {held}: give the "
            "scheme of its labels, or the labels themselves, "
            f"{wording('as scheme=...', 'as --labels', 'under File is')}.",
            fatal=True,
        )
    if ventricles == "biv" and not np.isin(present, right).any():
        return Finding(
            "labels",
            f"No right ventricle is labeled in the image, which holds {held}: label it, or take "
            "the left ventricle alone.",
            fatal=True,
        )
    return None


def _check_sides(volume: Volume, scheme: Scheme) -> Finding | None:
    """Wall and blood pools lie as those of a heart do."""
    spacing = np.linalg.norm(volume.affine[:3, :3], axis=0)
    wrong = misfit(volume.values, scheme, spacing)
    if wrong is None:
        return None
    return Finding(
        "labels",
        f"The labels do not fit the scheme {scheme.name}: {wrong}: give the scheme of its labels, "
        "or 'auto'.",
        fatal=True,
    )
