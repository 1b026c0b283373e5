"""Pictures of fibers: glyphs on sheets in the wall, colored by the helix angle."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.fields import FiberRule, fiber_frames, heart_axes
from heartgen.fields.coordinate_lines import lines
from heartgen.fields.fibers import helix_angle
from heartgen.fields.wall import wall_of
from heartgen.mesh import HexMesh, MeshField
from heartgen.viewing.camera import frame_of, look_at
from heartgen.viewing.contours import TUBE_SIDES
from heartgen.viewing.polydata import INWARD, SUBDIVISION, poly_data
from heartgen.viewing.scene import DARK, MESH, SCALAR_BAR, SURFACE_LOOK
from heartgen.viewing.windows import Window

Array = NDArray[np.float64]

PLACES = 12
"""Places on an element's edge at which a fiber may stand."""

SPACING = 0.04
"""Of the fibers, over the size of the mesh."""

LENGTH, RADIUS = 0.05, 0.0035
"""Of a fiber, over the size of the mesh."""

DEPTHS = {"endocardium": 0.0, "mid-wall": 0.5, "epicardium": 1.0}
"""Depths across the wall at which fibers are drawn."""


def plot_fibers(
    mesh: HexMesh,
    rule: FiberRule | None = None,
    *,
    screenshot: str | Path | None = None,
    window_size: tuple[int, int] = (1500, 560),
) -> pv.Plotter:
    """Show the fibers on endocardium, mid-wall and epicardium, side by side.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    rule : FiberRule, optional
        Fiber angles; the usual ones if omitted.
    screenshot : path, optional
        Write a picture there (PNG); otherwise the scene is made, to be shown or changed further.
    window_size : (int, int)
        Pixels.

    Returns
    -------
    pyvista.Plotter

    Raises
    ------
    HeartgenError
        If a picture is asked for where there is no graphics library.
    """
    window = Window(True, screenshot, window_size)
    plotter = window.empty(shape=(1, len(DEPTHS)), border=False)
    for column, name in enumerate(DEPTHS):
        plotter.subplot(0, column)
        plotter.add_text(name, position=(0.05, 0.92), font_size=11, color=DARK, viewport=True)
        add_fibers(plotter, mesh, name, rule, key=column == 1)
        look_at(plotter, mesh, frame_of(heart_axes(mesh)))
    return window.shown(plotter)


def add_fibers(
    plotter: Any, mesh: HexMesh, depth: str, rule: FiberRule | None = None, key: bool = True
) -> None:
    """Fibers as glyphs on a sheet in the wall, at one of `DEPTHS`, colored by the helix angle.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Drawn into.
    mesh : HexMesh
        mm, world (LPS).
    depth : str
        Name of the sheet, one of `DEPTHS`.
    rule : FiberRule, optional
        Fiber angles; the usual ones if omitted.
    key : bool
        Show what the colors mean.
    """
    tubes, limit = fiber_tubes(mesh, DEPTHS[depth], rule)
    bar: Any = {"title": "helix angle (degrees)\n", "color": DARK, **SCALAR_BAR, "fmt": "%.0f"}
    plotter.add_mesh(fiber_sheet(mesh, DEPTHS[depth]), color=MESH, **SURFACE_LOOK)
    plotter.add_mesh(
        tubes,
        scalars="helix",
        cmap="viridis",
        clim=(-limit, limit),
        scalar_bar_args=bar,
        show_scalar_bar=key,
        **SURFACE_LOOK,
    )


def fiber_tubes(
    mesh: HexMesh, depth: float, rule: FiberRule | None = None
) -> tuple[pv.PolyData, float]:
    """Fibers at a depth in the wall, and the largest helix angle in it.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    depth : float
        From 0, endocardium, to 1, epicardium.
    rule : FiberRule, optional
        Fiber angles; the usual ones if omitted.

    Returns
    -------
    tubes : PolyData
        mm, world (LPS), with the ``helix`` angle at the points, degrees.
    limit : float
        Largest absolute angle, degrees.
    """
    rule = rule or FiberRule()
    helix = MeshField("helix", helix_angle(wall_of(mesh), rule)[..., None])
    fiber = MeshField("fiber", fiber_frames(mesh, rule)[..., 0])
    tubes = _glyphs(mesh, depth, fiber, helix).cell_data_to_point_data()
    return tubes, float(np.abs(helix.values).max())


def _within(mesh: HexMesh, depth: float) -> tuple[NDArray[np.intp], Array]:
    """Elements (n,) that a sheet at a depth crosses, and xi3 (n,) where it does."""
    elements, places = [], []
    for line in lines(mesh.topology, 2):
        layer = min(int(depth * len(line)), len(line) - 1)
        elements.append(line[layer])
        places.append(depth * len(line) - layer)
    return np.array(elements), np.array(places)


def _on_sheet(mesh: HexMesh, depth: float, uv: Array, *fields: MeshField) -> list[Array]:
    """Places, tangents along xi1 and xi2, and values of fields at (n, q) points of a sheet."""
    elements, level = _within(mesh, depth)
    shape = (len(elements), len(uv))
    out = [np.empty((*shape, 3)) for _ in range(3)]
    out += [np.empty((*shape, field.components)) for field in fields]
    for xi3 in np.unique(level):
        xi = np.column_stack([uv, np.full(len(uv), xi3)])
        on = level == xi3
        values = [mesh.evaluate(xi), *np.moveaxis(mesh.gradient(xi)[..., :2], -1, 0)]
        values += [field.evaluate(xi) for field in fields]
        for each, value in zip(out, values, strict=True):
            each[on] = value[elements[on]]
    return out


def fiber_sheet(mesh: HexMesh, depth: float) -> pv.PolyData:
    """Surface at a depth in the wall.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    depth : float
        From 0, endocardium, to 1, epicardium.
    """
    t = np.linspace(0, 1, SUBDIVISION + 1)
    v, u = np.meshgrid(t, t, indexing="ij")
    points = _on_sheet(mesh, depth, np.stack([u.ravel(), v.ravel()], -1))[0]
    inside = np.clip(np.stack([u.ravel(), v.ravel()], -1), INWARD, 1 - INWARD)
    _, one, two = _on_sheet(mesh, depth, inside)
    normals = np.cross(one, two)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    grid = np.arange(u.size).reshape(u.shape)
    quad = np.stack([grid[:-1, :-1], grid[:-1, 1:], grid[1:, 1:], grid[1:, :-1]], -1).reshape(-1, 4)
    quads = (quad + u.size * np.arange(len(points))[:, None, None]).reshape(-1, 4)
    return poly_data(points.reshape(-1, 3), quads, normals.reshape(-1, 3))


def _glyphs(mesh: HexMesh, depth: float, fiber: MeshField, helix: MeshField) -> pv.PolyData:
    """Short tubes along the fibers at a depth, on the outer side of its sheet."""
    t = (np.arange(PLACES) + 0.5) / PLACES
    v, u = np.meshgrid(t, t, indexing="ij")
    values = _on_sheet(mesh, depth, np.stack([u.ravel(), v.ravel()], -1), fiber, helix)
    size = float(np.ptp(values[0].reshape(-1, 3), axis=0).max())
    kept = _evenly(values[1], values[2], SPACING * size)
    places, one, two, direction, angle = (a[kept] for a in values)
    normal = np.cross(one, two)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    places = places + 2 * RADIUS * size * normal
    half = LENGTH * size / 2 * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    ends = np.stack([places - half, places + half], 1).reshape(-1, 3)
    rows = np.column_stack([np.full(len(places), 2), np.arange(len(ends)).reshape(-1, 2)])
    segments = pv.PolyData(ends, lines=rows.ravel())
    segments.cell_data["helix"] = angle[:, 0]
    tubes: pv.PolyData = segments.tube(radius=RADIUS * size, n_sides=TUBE_SIDES)
    return tubes


def _evenly(one: Array, two: Array, spacing: float) -> NDArray[np.bool_]:
    """Which of `PLACES` x `PLACES` points of each element (n, q) lie about a spacing apart.

    By the tangents (n, q, 3) there: each row along xi1 may have a number of its own, as the rows
    near a pole are short.
    """
    width, height = (np.linalg.norm(a, axis=-1).reshape(-1, PLACES, PLACES) for a in (one, two))
    strides = np.array([n for n in range(1, PLACES + 1) if PLACES % n == 0])
    kept = []
    for edge in (width.mean(2), height.mean((1, 2))[:, None]):  # (n, rows)
        enough = strides * edge[..., None] / PLACES >= spacing
        stride = np.where(enough.any(-1), strides[enough.argmax(-1)], PLACES)
        kept.append(np.arange(PLACES) % stride[..., None] == stride[..., None] // 2)
    along, across = kept[0], np.swapaxes(kept[1], 1, 2)
    return np.asarray((along & across).reshape(len(one), -1))
