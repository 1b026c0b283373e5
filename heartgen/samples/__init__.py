"""Hearts of known truth: ``samples.load("lifelike")`` gives a mask and what it hides."""

from __future__ import annotations

from heartgen.samples.biv_phantom import biv
from heartgen.samples.named import load, names
from heartgen.samples.phantoms import ideal_cup, lifelike_lv
from heartgen.samples.placement import Placement
from heartgen.samples.rv_truth import RightVentricle
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
