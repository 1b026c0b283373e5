"""Two states of a heart in one scene: a solid mesh, and another one around it that lets it show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import matplotlib
import numpy as np
import pyvista as pv
from matplotlib.colors import to_hex
from numpy.typing import NDArray

from heartgen.fields import heart_axes
from heartgen.fields.segments import segments_of_elements
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.viewing.bullseye import Bullseye
from heartgen.viewing.camera import frame_of
from heartgen.viewing.contours import EDGE_RADIUS, TUBE_SIDES
from heartgen.viewing.motion import LARGE, OPACITY, SMALL
from heartgen.viewing.polydata import mesh_edges, mesh_surface
from heartgen.viewing.scene import DARK, MESH, Scale
from heartgen.widgets.colors import STOPS, Painted
from heartgen.widgets.mesh_scene import Probe, Scene
from heartgen.widgets.scene_parts import framed, opaque, rgba
from heartgen.widgets.scene_views import views_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Overlay:
    """What is shown of two states.

    Attributes
    ----------
    solid, around : HexMesh
        mm, world (LPS); the same where one is shown alone.
    names : (str, str)
        Of both.
    bullseye : Bullseye or None
        Values by segment that color the solid one; None for one color.
    """

    solid: HexMesh
    around: HexMesh
    names: tuple[str, str]
    bullseye: Bullseye | None = None


def states_scene(overlay: Overlay) -> Scene:
    """The scene of two states, in the frame of the solid one.

    Parameters
    ----------
    overlay : Overlay
        What is shown.
    """
    axes = heart_axes(overlay.solid)
    frame = frame_of(axes)
    surface, tubes = _drawn(overlay.solid, overlay.solid)
    painted = _painted(overlay, surface.n_points)
    surface.point_data["rgba"] = opaque(painted.rgb)
    tubes.point_data["rgba"] = rgba(DARK, np.ones(tubes.n_points))
    shell = pv.PolyData()
    if overlay.around is not overlay.solid:
        shell = mesh_surface(overlay.around)
        shell.point_data["rgba"] = rgba(LARGE, np.full(shell.n_points, OPACITY))
    faces = overlay.solid.topology.external[:, 0]
    element = np.repeat(faces, surface.n_points // len(faces))
    return Scene(
        framed(surface, frame),
        framed(tubes, frame),
        framed(shell, frame),
        painted,
        frame,
        views_of(frame, axes),
        Probe(element, jacobian_ratio(overlay.solid), {}),
    )


def states_moving(states: Sequence[tuple[str, HexMesh]]) -> list[tuple[str, Array, Array]]:
    """Points of the surface and of the edges in each state, mm, in the frame of the first.

    Parameters
    ----------
    states : sequence of (str, HexMesh)
        By their names, of one topology.
    """
    first = states[0][1]
    frame = frame_of(heart_axes(first))
    out = []
    for name, mesh in states:
        surface, tubes = (framed(data, frame) for data in _drawn(mesh, first))
        out.append((name, np.asarray(surface.points), np.asarray(tubes.points)))
    return out


def _drawn(mesh: HexMesh, like: HexMesh) -> tuple[pv.PolyData, pv.PolyData]:
    """Surface and edges of a mesh, the edges as in another one of its topology."""
    edges = mesh_edges(mesh, like=like)
    radius = EDGE_RADIUS * float(np.ptp(edges.points, axis=0).max())
    return mesh_surface(mesh), edges.tube(radius=radius, n_sides=TUBE_SIDES)


def _painted(overlay: Overlay, n_points: int) -> Painted:
    """Colors of the solid mesh, and the key of both."""
    names = [(SMALL, overlay.names[0])]
    if overlay.around is not overlay.solid:
        names.append((LARGE, overlay.names[1]))
    plain = np.tile(np.array(pv.Color(SMALL).int_rgb, np.uint8), (n_points, 1))
    shown = overlay.bullseye
    if shown is None:
        return Painted(plain, _nothing, "", names=tuple(names))
    mesh, colors = overlay.solid, matplotlib.colormaps[shown.colors]
    faces = mesh.topology.external[:, 0]
    segment = segments_of_elements(mesh, heart_axes(mesh))[faces]
    low, high = shown.limits
    by_face = np.tile(np.array(pv.Color(MESH).int_rgb, np.uint8), (len(faces), 1))
    for number, value in shown.values.items():
        share = (value - low) / (high - low)
        by_face[segment == number] = colors(share, bytes=True)[:3]
    factor = 100 if shown.percent else 1
    return Painted(
        np.repeat(by_face, n_points // len(faces), axis=0),
        _nothing,
        shown.title,
        scale=Scale(shown.title, shown.colors, (factor * low, factor * high)),  # type: ignore[arg-type]
        stops=tuple(to_hex(colors(i / (STOPS - 1))) for i in range(STOPS)),
        names=tuple(names),
    )


def _nothing(elements: NDArray[np.intp]) -> NDArray[np.uint8]:
    """Colors of the inside, which is never seen."""
    return np.zeros((len(elements), 3), np.uint8)
