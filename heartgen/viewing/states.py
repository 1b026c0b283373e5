"""What a comparison of a heart's states tells, as rows of text, for a table or a page."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from heartgen.comparison import Comparison
from heartgen.fields import Indices, Strains
from heartgen.viewing.card import LEVELS, Section, number

MISSING = "–"
"""Where a state has no such value."""


def _thickness(indices: Indices, segments: range) -> float | None:
    """Mean of segments, mm; None if the mesh has none of them."""
    own = [indices.wall_thickness[n] for n in segments if n in indices.wall_thickness]
    return float(np.mean(own)) if own else None


MEASURES: tuple[tuple[str, Callable[[Indices], float | None]], ...] = (
    ("left cavity, ml", lambda i: i.lv_cavity_volume),
    ("right cavity, ml", lambda i: i.rv_cavity_volume),
    ("left ventricular mass, g", lambda i: i.lv_mass),
    ("right free wall, g", lambda i: i.rv_mass),
    ("long axis, mm", lambda i: i.long_axis_length),
    ("sphericity", lambda i: i.sphericity),
    *((f"{level} wall, mm", partial(_thickness, segments=of)) for level, of in LEVELS.items()),
)

STRAINS: tuple[tuple[str, Callable[[Strains], float]], ...] = (
    ("longitudinal strain", lambda s: s.longitudinal),
    ("circumferential strain", lambda s: s.circumferential),
    ("radial strain", lambda s: s.radial),
)


@dataclass(frozen=True)
class States:
    """A table with a column for each state.

    Attributes
    ----------
    names : tuple of str
        Of the states, in order.
    rows : tuple of (str, tuple of str)
        What is measured, and its value in each state.
    """

    names: tuple[str, ...]
    rows: tuple[tuple[str, tuple[str, ...]], ...]


def headline(comparison: Comparison) -> str:
    """The ejection fraction, and from what to what.

    Parameters
    ----------
    comparison : Comparison
        A heart in several states.
    """
    large, small = (comparison.names[n] for n in (comparison.diastole, comparison.systole))
    return f"ejection fraction {comparison.lv_ejection_fraction:.1%}, from {large} to {small}"


def changes(comparison: Comparison) -> tuple[Section, ...]:
    """What the ventricles eject, and the strains from diastole to systole.

    Parameters
    ----------
    comparison : Comparison
        A heart in several states.
    """
    rows = [
        ("left ejection fraction", f"{comparison.lv_ejection_fraction:.1%}"),
        ("left stroke volume", f"{number(comparison.lv_stroke_volume)} ml"),
    ]
    if comparison.rv_ejection_fraction is not None and comparison.rv_stroke_volume is not None:
        rows += [
            ("right ejection fraction", f"{comparison.rv_ejection_fraction:.1%}"),
            ("right stroke volume", f"{number(comparison.rv_stroke_volume)} ml"),
        ]
    out = [Section("Ejection", tuple(rows))]
    found = comparison.strains[comparison.systole]
    if found is not None:
        shown = tuple((name, f"{of(found):+.1%}") for name, of in STRAINS)
        out.append(Section("Mean strain at the least cavity", shown))
    return tuple(out)


def states(comparison: Comparison) -> States:
    """Indices of each state, and its strains against the one with the largest cavity.

    Parameters
    ----------
    comparison : Comparison
        A heart in several states.
    """
    rows: list[tuple[str, tuple[str, ...]]] = []
    for name, measure in MEASURES:
        values = [measure(found) for found in comparison.indices]
        if any(value is not None for value in values):
            rows.append((name, tuple(MISSING if v is None else number(v) for v in values)))
    strains = [None if n == comparison.diastole else s for n, s in enumerate(comparison.strains)]
    if any(strain is not None for strain in strains):
        for name, of in STRAINS:
            rows.append((name, tuple(MISSING if s is None else f"{of(s):+.1%}" for s in strains)))
    return States(comparison.names, tuple(rows))
