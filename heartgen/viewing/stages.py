"""The mesh on its way through the pipeline: what each step makes of it (paper, figure 1)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pyvista as pv
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.assessment import mean_error
from heartgen.images import Mask
from heartgen.images.isosurface import isosurface
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.viewing.polydata import element_faces, mesh_surface
from heartgen.viewing.slice_views import EPI, SLICES, SliceView, draw_section, slice_view

if TYPE_CHECKING:
    from heartgen.result import Personalization

Array = NDArray[np.float64]
Move = Callable[[NDArray[Any]], Array]

WIDTH, HEIGHT = 3.0, 4.4
"""Of one picture, inches."""

LINE = 1.2
"""Width of the elements' edges, points."""

LONG_AXIS = SLICES[0]
"""The slice that is drawn: it shows both ventricles where there are two."""


@dataclass(frozen=True)
class Stage:
    """A state of the mesh on its way through the pipeline.

    Attributes
    ----------
    key, title, explanation : str
        Its name in the program, its name for users, and a sentence about it.
    mesh : callable
        The mesh of a result at that stage.
    registered : bool
        Show the template's points moved by the deformation, not a mesh of their own.
    """

    key: str
    title: str
    explanation: str
    mesh: Callable[[Personalization], HexMesh]
    registered: bool = False


STAGES = (
    Stage("template", "Template", "An ellipsoid tailored to the heart", lambda r: r.template),
    Stage(
        "registered",
        "Registered",
        "The template's points, moved by the deformation",
        lambda r: r.template,
        registered=True,
    ),
    Stage("warped", "Warped", "The cubic mesh that follows the deformation", lambda r: r.warped),
    Stage("enhanced", "Enhanced", "Straight across the wall", lambda r: r.enhanced),
    Stage("optimized", "Optimized", "The result", lambda r: r.mesh),
)


def stages_of(result: Personalization) -> tuple[Stage, ...]:
    """Stages that a result went through.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and all on the way to it.
    """
    skipped = set()
    if not result.options.optimize:
        skipped.add("optimized")
    if not result.options.enhance:
        skipped.add("enhanced")
    return tuple(stage for stage in STAGES if stage.key not in skipped)


def registered(points: NDArray[Any], result: Personalization) -> Array:
    """Points (n, 3) of the template, mm, world (LPS), moved by the deformation.

    Parameters
    ----------
    points : (n, 3) float64
        Of the template, mm, world (LPS).
    result : Personalization
        Whose last deformation is used.
    """
    return np.asarray(result.deformations[-1](np.asarray(points, dtype=float)))


def draw_stages(result: Personalization) -> Figure:
    """Draw the elements of every stage where a long-axis slice of the mask cuts them.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and all on the way to it.

    Returns
    -------
    matplotlib.figure.Figure
        A picture for each stage, with its mean error as the report has it, and its quality. Not
        bound to any window.
    """
    stages = stages_of(result)
    moves = [partial(registered, result=result) if s.registered else None for s in stages]
    meshes = [stage.mesh(result) for stage in stages]
    return _drawn(result.mask, result.anatomy, [s.title for s in stages], meshes, moves)


def draw_mesh(mesh: HexMesh, mask: Mask, anatomy: Anatomy, title: str = "") -> Figure:
    """Draw the elements of a mesh where a long-axis slice of the mask cuts them.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    mask : Mask
        The myocardium, in the world (LPS).
    anatomy : Anatomy
        Of that mask.
    title : str
        Above the picture.

    Returns
    -------
    matplotlib.figure.Figure
        With the mean error as the report has it, and the quality. Not bound to any window.
    """
    return _drawn(mask, anatomy, [title], [mesh], [None])


def _drawn(
    mask: Mask,
    anatomy: Anatomy,
    titles: Sequence[str],
    meshes: Sequence[HexMesh],
    moves: Sequence[Move | None],
) -> Figure:
    """A picture of each mesh, its points moved first where there is a move."""
    view = slice_view(mask, anatomy)
    slices = anatomy.slices
    target = isosurface(anatomy.myocardium) if slices is None else slices.outline
    size = (WIDTH * len(meshes), HEIGHT)
    figure = Figure(figsize=size, layout="constrained", facecolor="white")
    panels = figure.subplots(1, len(meshes), squeeze=False)[0]
    for axes, title, mesh, move in zip(panels, titles, meshes, moves, strict=True):
        draw_section(axes, LONG_AXIS, view)
        faces, surface = element_faces(mesh), mesh_surface(mesh)
        if move is not None:
            for data in (faces, surface):
                data.points = move(data.points).astype(np.float32)
        _draw_cut(axes, faces, view)
        told = title
        if move is None:  # of moved points there is no mesh of their own
            error = mean_error(mesh, target)
            told += f"\nerror {error:.2f} mm, Q {jacobian_ratio(mesh).mean():.2f}"
        axes.set_title(told, fontsize="medium")
        axes.set_axis_off()
    return figure


def _draw_cut(axes: Axes, surface: pv.PolyData, view: SliceView) -> None:
    """The lines in which the slice cuts a surface."""
    turn, shift = view.frame[:3, :3], view.frame[:3, 3]
    across = 3 - LONG_AXIS.across - LONG_AXIS.up
    cut = surface.slice(normal=turn[:, across], origin=turn @ view.center + shift)
    points = (np.asarray(cut.points, dtype=float) - shift) @ turn
    flat = points[:, [LONG_AXIS.across, LONG_AXIS.up]]
    lines = flat[cut.lines.reshape(-1, 3)[:, 1:]]
    axes.add_collection(LineCollection(list(lines), colors=EPI, linewidths=LINE))
