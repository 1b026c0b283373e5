"""Functions that are no more, for one release, made of what is there instead."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.connectivity import random_dofs
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.topology import Topology
from heartgen.options import option_from_text


@dataclass(frozen=True, eq=False)
class NodalParameters:
    """Parameters of all nodes, and which of them each element corner takes.

    Attributes
    ----------
    values : (m, 3) float64
        Parameters, mm, world (LPS), ordered by node, derivative and version.
    counts : (n, 8) int
        Versions of each derivative at each node.
    version : (e, 8, 8) int
        Version, counted from 0, of each derivative at each element corner, xi1 fastest.
    """

    values: NDArray[np.float64]
    counts: NDArray[np.intp]
    version: NDArray[np.intp]


def nodal_parameters(mesh: HexMesh) -> NodalParameters:
    """Nodal parameters of a mesh, by the versions of its topology.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    """
    versions = mesh.topology.versions
    values = np.asarray(versions.weights @ mesh.dofs)
    return NodalParameters(values, versions.counts, versions.version)


def generic_mesh(topology: Topology) -> HexMesh:
    """Mesh of a topology with generic degrees of freedom of size 1.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    """
    generic = topology.generic_dofs
    return HexMesh(random_dofs(topology.extraction) if generic is None else generic, topology)


def empty_scene(window_size: tuple[int, int], **options: Any) -> Any:
    """An empty white scene that opens no window.

    Parameters
    ----------
    window_size : (int, int)
        Pixels.
    **options : object
        Passed on to `pyvista.Plotter`.
    """
    from heartgen.viewing.windows import Window

    return Window(off_screen=True, window_size=window_size).empty(**options)


def finished(plotter: Any, screenshot: str | Path | None) -> Any:
    """The scene, and its picture if one was asked for.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Holds the scene.
    screenshot : path or None
        Picture to write (PNG); None for none.
    """
    from heartgen.viewing.windows import Window, require_graphics

    if screenshot is not None:
        require_graphics(plotter)
    return Window(off_screen=True, screenshot=screenshot).shown(plotter)


def elements_from_text(text: str) -> tuple[int, int, int]:
    """Numbers of elements from a text such as ``1x12x6``.

    Parameters
    ----------
    text : str
        What the user wrote.
    """
    return cast("tuple[int, int, int]", option_from_text("elements", text))


def direction_from_text(text: str) -> tuple[float, float, float]:
    """A direction from a text such as ``-1/-1/0``.

    Parameters
    ----------
    text : str
        What the user wrote.
    """
    return cast("tuple[float, float, float]", option_from_text("septal_direction", text))
