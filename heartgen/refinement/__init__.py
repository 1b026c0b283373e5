"""Refinement after the warp: the mesh itself is optimised for accuracy and for element quality."""

from __future__ import annotations

from heartgen.refinement.descent import Weights, refine, weights_for
from heartgen.refinement.interior import relax
from heartgen.refinement.patient import Patient, patient_of

__all__ = ["Patient", "Weights", "patient_of", "refine", "relax", "weights_for"]
