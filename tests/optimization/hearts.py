"""A patient and a mesh that is small enough to be optimized in a moment."""

from __future__ import annotations

from dataclasses import dataclass

from heartgen.anatomy import Anatomy
from heartgen.heart_kinds import kind_of
from heartgen.mesh import HexMesh
from heartgen.optimization import FitSettings, FitTarget, settings_for
from heartgen.optimization.energy import Energy


@dataclass(frozen=True)
class Heart:
    """A patient and an unoptimized mesh."""

    anatomy: Anatomy
    target: FitTarget
    mesh: HexMesh

    def settings(self, lod: int = 3, quality: float = 1.0) -> FitSettings:
        """The usual settings for such a mesh."""
        weights = kind_of(self.anatomy).weights
        return settings_for(lod, quality, weights, columns=self.mesh.topology.shape[1])

    def energy(self) -> Energy:
        """Its energy under these."""
        return Energy(self.mesh, self.target, self.settings())

    def finer(self, *elements: int) -> Heart:
        """The same patient with another template."""
        made = kind_of(self.anatomy).template(self.anatomy, elements)
        return Heart(self.anatomy, self.target, made)
