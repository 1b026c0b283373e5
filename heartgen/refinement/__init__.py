"""Refinement after the warp: the mesh itself is optimized for accuracy, quality and fairness.

An energy is a list of `terms`: `distances`, `quality`, `lines`; `energy` puts them together,
`gauss_newton` minimizes them, and `policy` says when a mesh is good enough. All numbers are in
`settings`.
"""

from __future__ import annotations

from heartgen.refinement.distances import misfit
from heartgen.refinement.interior import relax
from heartgen.refinement.policy import Refined, refine
from heartgen.refinement.settings import FitSettings, settings_for
from heartgen.refinement.target import FitTarget, fit_target

__all__ = [
    "FitSettings",
    "FitTarget",
    "Refined",
    "fit_target",
    "misfit",
    "refine",
    "relax",
    "settings_for",
]
