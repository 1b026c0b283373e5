"""Optimization after the warp: the mesh itself is optimized for accuracy, quality and fairness.

An energy is a list of `terms`: `distances`, `quality`, `lines`; `energy` puts them together,
`gauss_newton` minimizes them, and `policy` says when a mesh is good enough. All numbers are in
`settings`.
"""

from __future__ import annotations

from heartgen.optimization.distances import misfit
from heartgen.optimization.interior import relax
from heartgen.optimization.policy import Optimized, optimize
from heartgen.optimization.settings import FitSettings, settings_for
from heartgen.optimization.target import FitTarget, fit_target

__all__ = [
    "FitSettings",
    "FitTarget",
    "Optimized",
    "fit_target",
    "misfit",
    "optimize",
    "relax",
    "settings_for",
]
