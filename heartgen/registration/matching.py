"""Where and how template and patient are compared: soft images sampled on the template's surfaces.

The images are signed distances, one for each surface. They matter only near the surfaces, so the
misfit is integrated over the template's surfaces, where its image is zero by construction, rather
than over voxels.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from heartgen.images.levelset import LevelSet
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surface_faces import sample_faces
from heartgen.registration.deformation import Deformation

SAMPLES_PER_NODE = 2.0
"""Surface samples per node spacing."""

SAMPLES_LIMITS = (6, 16)
"""Least and most samples per face and direction."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of the template's surfaces at which the images are compared.

    Attributes
    ----------
    points : (n, 3) float64
        mm, world (LPS).
    weights : (n,) float64
        Area in units of a voxel's face.
    channels : tuple of (LevelSet, slice)
        The patient's image with which each range of samples is compared.
    """

    points: NDArray[np.float64]
    weights: NDArray[np.float64]
    channels: tuple[tuple[LevelSet, slice], ...]

    def moved(self, deformation: Deformation) -> Samples:
        """The samples where a deformation takes them.

        Parameters
        ----------
        deformation : Deformation
            World (LPS) to world, mm.
        """
        return replace(self, points=deformation(self.points))

    def patient(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The patient's image (n,) and its gradient (n, 3) at the samples' moved points.

        Parameters
        ----------
        points : (n, 3) float64
            Where the samples have moved, mm, world (LPS).
        """
        parts = [level.sample(points[rows]) for level, rows in self.channels]
        return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def sample_surfaces(
    template: HexMesh, images: Mapping[str, LevelSet], spacing: float, voxel: float
) -> Samples:
    """Sample the template's surfaces.

    Parameters
    ----------
    template : HexMesh
        mm, world (LPS).
    images : mapping of str to LevelSet
        The patient's signed distance for each named surface.
    spacing : float
        Node spacing that the samples must resolve, mm.
    voxel : float
        Voxel size, mm.

    Returns
    -------
    Samples
    """
    points, weights, channels = [], [], []
    start = 0
    for name, faces in template.topology.surfaces.items():
        edge = float(np.sqrt(sample_faces(template, faces, 2)[2].sum() / len(faces)))
        n = int(np.clip(np.ceil(SAMPLES_PER_NODE * edge / spacing), *SAMPLES_LIMITS))
        places, _, areas = sample_faces(template, faces, n)
        points.append(places)
        weights.append(areas / voxel**2)
        channels.append((images[name], slice(start, start + len(places))))
        start += len(places)
    return Samples(np.concatenate(points), np.concatenate(weights), tuple(channels))
