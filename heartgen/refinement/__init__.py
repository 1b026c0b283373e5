"""Refinement after the warp: the mesh itself is optimised for accuracy and for element quality."""

from __future__ import annotations

from heartgen.refinement.descent import Weights, refine, weights_for
from heartgen.refinement.distances import misfit
from heartgen.refinement.interior import relax
from heartgen.refinement.patient import Patient, patient_of
from heartgen.refinement.rounds import refine_in_rounds

__all__ = [
    "Patient",
    "Weights",
    "misfit",
    "patient_of",
    "refine",
    "refine_in_rounds",
    "relax",
    "weights_for",
]
