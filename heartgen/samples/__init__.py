"""Hearts of known truth: ``samples.load("lifelike")`` gives a mask and what it hides."""

from __future__ import annotations

from heartgen.samples.biventricular import biv
from heartgen.samples.catalog import load, names
from heartgen.samples.phantoms import ideal_cup, lifelike_lv
from heartgen.samples.placement import Placement
from heartgen.samples.right import RightVentricle
from heartgen.samples.sample import Sample
from heartgen.samples.truth import Truth

__all__ = [
    "Placement",
    "RightVentricle",
    "Sample",
    "Truth",
    "biv",
    "ideal_cup",
    "lifelike_lv",
    "load",
    "names",
]
