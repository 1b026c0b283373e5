"""Hearts at the end of diastole and of systole, to try comparisons of states with.

The wall keeps its volume within 3 %; end systole is that of a healthy heart, with an ejection
fraction between 0.5 and 0.6.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from numpy.typing import ArrayLike

from heartgen.errors import InputError
from heartgen.samples.biv_phantom import biv
from heartgen.samples.phantoms import LIFELIKE, in_wall, lifelike_lv
from heartgen.samples.sample import Sample, make_sample

DIASTOLE, SYSTOLE = "end diastole", "end systole"
"""Names of the states."""

BEATS = {"lv": "Left ventricle", "biv": "Both ventricles"}
"""Titles of the beats, by name."""

SPACING = 1.5
"""Distance between voxels, mm: fine enough for the wall, and quick to mesh."""

SQUEEZED = replace(
    LIFELIKE,
    endo=replace(LIFELIKE.endo, radius=15.5, length=53.0),
    epi=replace(LIFELIKE.epi, radius=29.3, length=60.5),
    base_height=14.0,
)
"""The lifelike ventricle at the end of systole."""


def beat(name: str, spacing: ArrayLike = SPACING) -> dict[str, Sample]:
    """Make a heart in two states.

    Parameters
    ----------
    name : {"lv", "biv"}
        Left ventricle, or both.
    spacing : float or (3,) array, mm
        Distance between voxels along the index axes.

    Returns
    -------
    dict of str to Sample
        By the names of the states, in order of time.

    Raises
    ------
    InputError
        If there is no such heart.

    Examples
    --------
    >>> from heartgen.samples.beats import beat
    >>> states = beat("lv", 4.0)
    >>> list(states)
    ['end diastole', 'end systole']
    >>> large, small = (state.truth.cavity_volume for state in states.values())
    >>> round(1 - small / large, 2)
    0.59
    """
    if name not in BEATS:
        raise InputError(f"There is no beat {name!r}; choose one of {', '.join(BEATS)}.")
    if name == "biv":
        small = biv(
            spacing,
            rv_size=0.95,
            rv_wall=3.6,
            lv_wall=13.5,
            septum=13.5,
            radius=16.0,
            length=70.0,
        )
        return {DIASTOLE: _named(biv(spacing), DIASTOLE), SYSTOLE: _named(small, SYSTOLE)}
    text = "The lifelike left ventricle at the end of systole."
    squeezed = make_sample(SQUEEZED, partial(in_wall, SQUEEZED), spacing, SYSTOLE, text)
    return {DIASTOLE: _named(lifelike_lv(spacing), DIASTOLE), SYSTOLE: squeezed}


def _named(sample: Sample, name: str) -> Sample:
    """A sample whose mask has the name of the state."""
    return replace(sample, mask=replace(sample.mask, name=name))
