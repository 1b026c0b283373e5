"""Left ventricles of known truth: ``samples.load("lifelike")`` gives a mask and what it hides."""

from __future__ import annotations

from heartgen.samples.catalogue import load, names
from heartgen.samples.phantoms import Sample, ideal_cup, lifelike_lv
from heartgen.samples.truth import Truth

__all__ = ["Sample", "Truth", "ideal_cup", "lifelike_lv", "load", "names"]
