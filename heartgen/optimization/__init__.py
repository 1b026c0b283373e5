"""Optimization after the warp: the mesh itself is optimized for accuracy, quality and fairness.

An energy is a list of `terms`: `distances`, `quality`, `lines`; `energy` puts them together,
`gauss_newton` minimizes them, and `policy` says when a mesh is good enough. All numbers are in
`settings`.
"""

from __future__ import annotations

from heartgen.optimization.distances import misfit
from heartgen.optimization.policy import Optimized, optimize
from heartgen.optimization.settings import FitSettings, settings_for
from heartgen.optimization.target import FitTarget, fit_target
from heartgen.optimization.transmural_lines import curve_transmural_lines
from heartgen.renamed import keep_former_names

__all__ = [
    "FitSettings",
    "FitTarget",
    "Optimized",
    "curve_transmural_lines",
    "fit_target",
    "misfit",
    "optimize",
    "settings_for",
]

keep_former_names(__name__)
