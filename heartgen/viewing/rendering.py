"""Publication pictures: a row for each coloring, a column for each view (paper, figs. 4 to 11)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import pyvista as pv

from heartgen.anatomy import Anatomy, analyze
from heartgen.errors import InputError
from heartgen.fields import heart_axes
from heartgen.images.levelset import LevelSet
from heartgen.images.mask import Mask
from heartgen.mesh import HexMesh
from heartgen.renamed import new_word, takes_former_keywords
from heartgen.viewing.camera import AZIMUTH, ELEVATION, UPRIGHT, frame_of, look_at
from heartgen.viewing.fiber_glyphs import DEPTHS, add_fibers
from heartgen.viewing.fields import (
    FIELD_STYLES,
    add_scalars,
    add_segments,
)
from heartgen.viewing.polydata import MAX_TRIANGLES, mask_surface, mesh_surface
from heartgen.viewing.scene import (
    DARK,
    ERROR_LIMIT,
    LIGHT,
    SURFACE_LOOK,
    add_edges,
    add_surface,
)
from heartgen.viewing.windows import Window

if TYPE_CHECKING:
    from collections.abc import Callable

VIEWS = {
    "oblique": (AZIMUTH, ELEVATION),
    "septal": (0.0, 0.0),
    "anterior": (90.0, 0.0),
    "lateral": (180.0, 0.0),
    "inferior": (270.0, 0.0),
    "basal": (0.0, UPRIGHT),
    "apical": (0.0, -UPRIGHT),
}
"""Degrees around the long axis, from the septum to the anterior wall, and above the plane across
it, from which one looks."""

PLAIN = ("plain", "overlay", "change", "error", "quality", "region", "aha")
FIBERS = {
    f"fibers-{name}": depth for name, depth in zip(("endo", "mid", "epi"), DEPTHS, strict=True)
}
"""Fibers as glyphs, at one of `heartgen.viewing.fiber_glyphs.DEPTHS`."""

COLORS = (*PLAIN, *FIELD_STYLES, *FIBERS)
"""What can be shown. ``overlay`` is the mask in red over the mesh (paper, figures 4 and 11);
``change`` another mesh in red over this one in green (figure 7)."""

NEEDS_MASK = frozenset({"overlay", "error"})


WHITE, RED, GREEN = "#f4f4f2", "#d55e00", "#009e73"
"""Of this mesh, of what is compared with it, and of this mesh beside another: red and green that
the color-blind tell apart (palette of Okabe and Ito, 2008)."""


ROOM = 0.88
"""Size of the mesh in a panel, over that which would fill it: the key is below."""

PANEL = 700
"""Pixels of a panel's edge."""


class LookOptions(TypedDict, total=False):
    """How pictures look; `render` takes these by keyword.

    Attributes
    ----------
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, see `heartgen.fields.heart_axes`.
    edges : bool
        Draw the edges of the elements, but for fibers.
    error_limit : float
        Distance at the end of the color scale, mm.
    panel : int
        Pixels of the edge of each picture.
    """

    septal_direction: Sequence[float] | None
    edges: bool
    error_limit: float
    panel: int


@dataclass(frozen=True)
class Look:
    """How pictures look.

    Attributes
    ----------
    septal_direction, edges, error_limit, panel : as of `LookOptions`
        With edges, up to `ERROR_LIMIT` and of `PANEL` pixels if omitted.
    """

    septal_direction: Sequence[float] | None = None
    edges: bool = True
    error_limit: float = ERROR_LIMIT
    panel: int = PANEL


@takes_former_keywords
def render(
    mesh: HexMesh,
    screenshot: str | Path | None = None,
    *,
    colors: Sequence[str] = ("region",),
    views: Sequence[str] = ("oblique",),
    mask: Mask | Anatomy | None = None,
    other: HexMesh | None = None,
    **look: Unpack[LookOptions],
) -> pv.Plotter:
    """Draw a mesh for print, as many pictures in one as there are colorings and views.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    screenshot : path, optional
        Write a picture there (PNG); otherwise the scene is made, to be shown or changed further.
    colors : sequence of str
        Of `COLORS`, a row each.
    views : sequence of str
        Of `VIEWS`, a column each.
    mask : Mask or Anatomy, optional
        What the mesh was fitted to, for ``overlay`` and ``error``. A mask is analyzed under the
        usual options; under others, the surface fitted may be another: give the anatomy.
    other : HexMesh, optional
        For ``change``.
    **look : LookOptions
        ``septal_direction``, ``edges``, ``error_limit`` and ``panel``: see `LookOptions`.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    InputError
        If a coloring or view is not known, or what a coloring needs is missing.
    HeartgenError
        If a picture is asked for where there is no graphics library.
    """
    colors = [new_word(color) for color in colors]
    _check(colors, views, mask, other)
    level = None if NEEDS_MASK.isdisjoint(colors) else _level(mask)
    shape = (len(colors), len(views))
    drawn = Look(**look)
    window = Window(True, screenshot, (drawn.panel * shape[1], drawn.panel * shape[0]))
    plotter: Any = window.empty(shape=shape, border=False)
    axes = heart_axes(mesh, drawn.septal_direction)
    for row, color in enumerate(colors):
        add = _adder(mesh, color, level, other, drawn)
        for column, view in enumerate(views):
            plotter.subplot(row, column)
            add(plotter, column == len(views) // 2)
            if drawn.edges and color not in FIBERS:
                add_edges(plotter, mesh, LIGHT if color == "error" else DARK)
            if len(views) > 1 and row == 0:
                _name(plotter, view)
            look_at(plotter, mesh, frame_of(axes), *VIEWS[view])
            plotter.camera.zoom(ROOM)
    return window.shown(plotter)


def _check(
    colors: Sequence[str],
    views: Sequence[str],
    mask: Mask | Anatomy | None,
    other: HexMesh | None,
) -> None:
    """Refuse what cannot be drawn."""
    for kind, asked, known in (("coloring", colors, COLORS), ("view", views, tuple(VIEWS))):
        if not asked:
            raise InputError(f"no {kind} was asked for: choose among {', '.join(known)}")
        for word in asked:
            if word not in known:
                raise InputError(f"{kind} {word!r} is not known: choose among {', '.join(known)}")
    for color in colors:
        if color in NEEDS_MASK and mask is None:
            raise InputError(f"coloring {color} needs the mask the mesh was fitted to: add it")
        if color == "change" and other is None:
            raise InputError("coloring change needs another mesh to compare with: add it")


def _level(mask: Mask | Anatomy | None) -> LevelSet | None:
    """Level function of the surface that a mesh is fitted to."""
    anatomy = analyze(mask) if isinstance(mask, Mask) else mask
    return None if anatomy is None else anatomy.myocardium


def _adder(
    mesh: HexMesh,
    color: str,
    level: LevelSet | None,
    other: HexMesh | None,
    look: Look,
) -> Callable[[Any, bool], None]:
    """What adds the surfaces of a row to a panel, with or without the key of their colors."""
    if color in FIELD_STYLES:
        return lambda plotter, key: add_scalars(
            plotter, mesh, FIELD_STYLES[color], look.septal_direction, key
        )
    if color in FIBERS:
        return lambda plotter, key: add_fibers(plotter, mesh, FIBERS[color], key=key)
    if color == "aha":
        axes = heart_axes(mesh, look.septal_direction)
        return lambda plotter, key: add_segments(plotter, mesh, axes)
    if color in ("error", "quality", "region"):
        known: Any = color
        return lambda plotter, key: add_surface(plotter, mesh, known, level, look.error_limit, key)
    surface = mesh_surface(mesh)
    layers: list[tuple[pv.PolyData, str]] = [(surface, WHITE)]
    if color == "overlay" and level is not None:
        layers.append((mask_surface(level, MAX_TRIANGLES), RED))
    if color == "change" and other is not None:
        layers = [(surface, GREEN), (mesh_surface(other), RED)]

    def add(plotter: Any, _: bool) -> None:
        for layer, shade in layers:
            plotter.add_mesh(layer, color=shade, **SURFACE_LOOK)

    return add


def _name(plotter: Any, view: str) -> None:
    """The name of a view at the top of its column."""
    plotter.add_text(view, position=(0.05, 0.93), font_size=11, color=DARK, viewport=True)
