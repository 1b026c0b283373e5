"""Meshes as linear or quadratic cells, which all simulation codes know."""

from heartgen.formats.resampling.fidelity import Fidelity, fidelity
from heartgen.formats.resampling.resample import Cells, Resampled, Resampling, resample

__all__ = ["Cells", "Fidelity", "Resampled", "Resampling", "fidelity", "resample"]
