"""Regions and surfaces as numbers, for formats in which an element or a face has one tag."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.hexmesh import Topology

WALL = "myocardium"
"""Region of elements that no named region has."""


@dataclass(frozen=True, eq=False)
class Tags:
    """Every element has one region, and every named external face one surface.

    Attributes
    ----------
    regions : tuple of str
        Names, which number 1 and up stand for.
    region : (e,) int
        Number of each element's region: the first that has it.
    surfaces : tuple of str
        Names, which number 1 and up stand for.
    faces : (f, 2) int
        Faces of all surfaces, (element, face).
    surface : (f,) int
        Number of each face's surface.
    """

    regions: tuple[str, ...]
    region: NDArray[np.intp]
    surfaces: tuple[str, ...]
    faces: NDArray[np.intp]
    surface: NDArray[np.intp]


def tags(topology: Topology) -> Tags:
    """Number the regions and surfaces of a mesh.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    """
    region = np.zeros(topology.n_elements, dtype=np.intp)
    names = list(topology.parts)
    for number, part in enumerate(topology.parts.values(), start=1):
        region[part] = np.where(region[part] == 0, number, region[part])
    if np.any(region == 0):
        names.append(WALL)
        region[region == 0] = len(names)
    sizes = [len(faces) for faces in topology.surfaces.values()]
    return Tags(
        regions=tuple(names),
        region=region,
        surfaces=tuple(topology.surfaces),
        faces=topology.external,
        surface=np.repeat(np.arange(1, len(sizes) + 1), sizes),
    )
