"""The 3-D view of a page: hands scenes to the browser, and what is pointed at to the page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.viewing.camera import direction_of
from heartgen.widgets.mesh_scene import Scene
from heartgen.widgets.parts import classed
from heartgen.widgets.scene_widget import PARTS, SceneWidget, shape_of

Array = NDArray[np.float64]

MEASURES = {"error": ("error", "mm"), "thickness": ("wall", "mm")}
"""Title and unit of what is told of a point, by its name in the scene."""


class HeartView:
    """The 3-D view of a page.

    Attributes
    ----------
    widget : SceneWidget
        To be put on the page.

    Parameters
    ----------
    told : callable
        Takes what a button of the view asks for, as a message with a ``kind``.
    pointed : callable
        Takes a point (3,) that was clicked, mm, world (LPS).
    """

    def __init__(
        self,
        told: Callable[[dict[str, Any]], None] = lambda message: None,
        pointed: Callable[[Array], None] = lambda point: None,
    ) -> None:
        self.widget: SceneWidget = classed(SceneWidget(told), "hg-view")
        self.widget.observe(self._clicked, "cursor")
        self._pointed = pointed
        self._frame = np.eye(4)

    def show(self, scene: Scene, reset: bool = False, **offered: bool) -> None:
        """Show a scene; the camera stays where it is, unless it is to be reset.

        Parameters
        ----------
        scene : Scene
            What to draw.
        reset : bool
            Whether the camera moves to where all is seen.
        **offered : bool
            ``can_play`` and ``can_cut``: whether the view offers these.
        """
        widget = self.widget
        first = widget.revision == 0
        self._frame = scene.frame
        state: dict[str, Any] = {
            f"{name}_colors": _colors(getattr(scene, name), name) for name in PARTS
        }
        probe = scene.probe
        values = {} if probe is None else dict(probe.values)
        element = None if probe is None else probe.element
        widget.put(
            mesh=shape_of(scene.mesh, element, **values),
            edges=shape_of(scene.edges),
            mask=shape_of(scene.mask),
            quality=[] if probe is None else np.round(probe.quality, 3).tolist(),
            measures={name: MEASURES[name] for name in values},
            frame=scene.frame.tolist(),
            views=scene.views,
            motion=[],
            camera=self._camera(reset or first),
            **offered,
            **state,
        )

    def reset(self) -> None:
        """Look at the heart from the usual place."""
        self.widget.camera = self._camera(True)

    def mark(self, point: Array | None) -> None:
        """Mark a point.

        Parameters
        ----------
        point : (3,) float64 or None
            mm, world (LPS); None for none.
        """
        self.widget.unobserve(self._clicked, "cursor")
        rotation, origin = self._frame[:3, :3], self._frame[:3, 3]
        self.widget.cursor = [] if point is None else ((point - origin) @ rotation).tolist()
        self.widget.observe(self._clicked, "cursor")

    def move(self, states: Sequence[tuple[str, Array, Array]]) -> None:
        """Let the mesh move through states, back and forth.

        Parameters
        ----------
        states : sequence of (str, array, array)
            Name, and points of mesh and edges (n, 3), mm, frame of the scene.
        """
        self.widget.motion = [
            {"name": name, "mesh": _packed(mesh), "edges": _packed(edges)}
            for name, mesh, edges in states
        ]

    def close(self) -> None:
        """Let go of the scene."""
        self.widget.close()

    def _camera(self, again: bool) -> dict[str, Any]:
        revision = self.widget.camera["revision"] + again
        return {"direction": direction_of().tolist(), "up": [0, 0, 1], "revision": revision}

    def _clicked(self, change: Any) -> None:
        if change["new"]:
            point = np.array(change["new"]) @ self._frame[:3, :3].T + self._frame[:3, 3]
            self._pointed(point)


def _colors(data: pv.PolyData, name: str) -> bytes:
    """Colors of the points; only the mask has an opacity."""
    if data.n_points == 0:
        return b""
    rgba = np.asarray(data.point_data["rgba"])
    return (rgba if name == "mask" else rgba[:, :3]).tobytes()


def _packed(points: Array) -> bytes:
    """Points as the browser takes them."""
    return np.asarray(points, dtype=np.float32).tobytes()
