"""A page that compares states of a heart: ejection, strains, and the largest in the smallest."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pyvista as pv

from heartgen import __version__
from heartgen.comparison import Comparison
from heartgen.fields import heart_axes
from heartgen.mesh import HexMesh
from heartgen.viewing.camera import frame_of, look_at
from heartgen.viewing.page import fill_page, scene_page, section_table
from heartgen.viewing.polydata import mesh_surface
from heartgen.viewing.scene import DARK, SURFACE_LOOK, add_edges
from heartgen.viewing.states import changes, headline, states
from heartgen.viewing.windows import Window

LARGE, SMALL = "#56b4e9", "#d55e00"
"""Of the states with the largest and the smallest cavity (palette of Okabe and Ito, 2008)."""

OPACITY = 0.35
"""Of the larger one, through which the other is seen."""


def compare_html(
    comparison: Comparison, meshes: Sequence[HexMesh], path: str | Path, name: str
) -> Path:
    """Write a page with the comparison, and both extreme states in 3-D.

    Parameters
    ----------
    comparison : Comparison
        What the page shows.
    meshes : sequence of HexMesh
        That were compared, in the same order.
    path : path
        The file appears whole or not at all.
    name : str
        What the page is called.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    HeartgenError
        If it cannot be written.
    """
    plotter = plot_change(meshes[comparison.diastole], meshes[comparison.systole])
    scene = scene_page(plotter)
    plotter.close()
    table = states(comparison)
    large, small = (comparison.names[n] for n in (comparison.diastole, comparison.systole))
    said = headline(comparison)
    return fill_page(
        "states.html",
        path,
        scene,
        name=html.escape(name),
        headline=html.escape(said[0].upper() + said[1:]),
        sections="\n".join(map(section_table, changes(comparison))),
        notes="\n".join(f"<li>{html.escape(note)}</li>" for note in comparison.notes),
        made=html.escape(f"heartgen {__version__} · {len(meshes)} states"),
        large=html.escape(large),
        small=html.escape(small),
        large_color=LARGE,
        small_color=SMALL,
        heads="".join(f"<th>{html.escape(state)}</th>" for state in table.names),
        rows="\n".join(_row(*row) for row in table.rows),
    )


def plot_change(large: HexMesh, small: HexMesh) -> pv.Plotter:
    """Show one mesh through another, upright; opens no window.

    Parameters
    ----------
    large : HexMesh
        Drawn as lines around the other; mm, world (LPS).
    small : HexMesh
        Drawn as a surface; mm, world (LPS).
    """
    plotter: Any = Window(off_screen=True).empty()
    plotter.add_mesh(mesh_surface(small), color=SMALL, name="small", **SURFACE_LOOK)
    add_edges(plotter, small, DARK)
    plotter.add_mesh(
        mesh_surface(large), color=LARGE, opacity=OPACITY, name="large", **SURFACE_LOOK
    )
    look_at(plotter, large, frame_of(heart_axes(large)))
    return plotter  # type: ignore[no-any-return]


def _row(name: str, values: Sequence[str]) -> str:
    """A row of a table."""
    cells = "".join(f"<td>{html.escape(value)}</td>" for value in values)
    return f"<tr><th>{html.escape(name)}</th>{cells}</tr>"
