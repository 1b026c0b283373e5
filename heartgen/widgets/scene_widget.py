"""What the browser is told of a 3-D scene, over the kernel's own channel: no port, no proxy.

The state is all in the widget's attributes, so that whoever opens the view, whenever, has all of
it. The browser says which revision it shows; one that is not confirmed is sent again.
"""

from __future__ import annotations

import asyncio
import gzip
from collections.abc import Callable
from functools import cache
from typing import Any

import anywidget
import numpy as np
import pyvista as pv
from numpy.typing import NDArray
from traitlets import Bool, Bytes, Dict, Int, List

from heartgen.viewing.page import scene_page
from heartgen.viewing.scene import CODED_LOOK, SURFACE_LOOK
from heartgen.widgets.transfer import WEB

PARTS = ("mesh", "edges", "mask")

CONFIRM = (5.0, 10.0, 20.0, 40.0)
"""Seconds after which a revision that no browser has confirmed is sent again: a busy one is slow,
and one that is not there yet asks by itself. In all less than after which a page seems closed: a
kernel that still sends is not idle, and would not be ended."""

SCRIPTS = ("geometry.js", "view.js", "view_tools.js")


class SceneWidget(anywidget.AnyWidget):
    """A 3-D scene in the browser.

    Attributes
    ----------
    mesh, edges, mask : dict
        Points, corners of triangles and normals of each part, as bytes; see `shape_of`.
    mesh_colors, edges_colors, mask_colors : bytes
        Colors of their points; of the mask with an opacity.
    revision, shown : int
        Of what is to be seen, and of what a browser has drawn.
    camera : dict
        From where the scene is looked at when ``revision`` of it changes: ``direction``, ``up``.
    views : dict of str to (list, list)
        Direction and what is up, for each side by its name.
    frame : list of list
        From the scene to the world (LPS), (4, 4), mm; empty if it is not known.
    quality : list of float
        Jacobian ratio of each element.
    measures : dict of str to (str, str)
        Title and unit of the values of the mesh's points.
    cursor : list
        A point that is marked, (3,) mm, in the frame of the scene; empty if there is none.
    motion : list of dict
        States between which the mesh may move: a name, and the points of mesh and edges.
    can_play, can_cut : bool
        Whether these are offered.

    Parameters
    ----------
    told : callable
        Takes what a button of the view asks for, as a message.
    """

    _esm = "\n".join((WEB / name).read_text(encoding="utf-8") for name in SCRIPTS)
    page = Bytes().tag(sync=True)
    mesh: Dict[str, Any] = Dict().tag(sync=True)
    edges: Dict[str, Any] = Dict().tag(sync=True)
    mask: Dict[str, Any] = Dict().tag(sync=True)
    mesh_colors = Bytes().tag(sync=True)
    edges_colors = Bytes().tag(sync=True)
    mask_colors = Bytes().tag(sync=True)
    revision = Int(0).tag(sync=True)
    shown = Int(0).tag(sync=True)
    camera: Dict[str, Any] = Dict({"direction": [0, -1, 0], "up": [0, 0, 1], "revision": 0}).tag(
        sync=True
    )
    views: Dict[str, Any] = Dict().tag(sync=True)
    frame: List[Any] = List().tag(sync=True)
    quality: List[float] = List().tag(sync=True)
    measures: Dict[str, Any] = Dict().tag(sync=True)
    cursor: List[float] = List().tag(sync=True)
    motion: List[Any] = List().tag(sync=True)
    can_play = Bool(False).tag(sync=True)
    can_cut = Bool(False).tag(sync=True)

    def __init__(self, told: Callable[[dict[str, Any]], None] = lambda message: None) -> None:
        super().__init__(page=empty_page(), **{name: shape_of(pv.PolyData()) for name in PARTS})
        self._told = told
        self.on_msg(self._hear)

    def put(self, **state: Any) -> None:
        """Change what is shown, all at once.

        Parameters
        ----------
        **state : object
            New values of attributes.
        """
        with self.hold_sync():
            for name, value in state.items():
                setattr(self, name, value)
            self.revision += 1
        self._await(CONFIRM)

    def _await(self, waits: tuple[float, ...]) -> None:
        """Send all again unless a browser says in time that it shows it."""
        try:
            loop = asyncio.get_running_loop()
        except RuntimeError:  # no loop, no browser
            return
        if waits:
            loop.call_later(waits[0], self._insist, self.revision, waits[1:])

    def _insist(self, revision: int, waits: tuple[float, ...]) -> None:
        if revision == self.revision and self.shown < revision and self.comm is not None:
            self.send_state()
            self._await(waits)

    def _hear(self, _: Any, message: dict[str, Any], buffers: list[Any]) -> None:
        """A message of the browser: a view that has just been opened, or a button."""
        if message.get("kind") != "mounted":
            self._told(message)
        elif message.get("revision") != self.revision:
            self.send_state()


def shape_of(
    data: pv.PolyData, element: NDArray[Any] | None = None, **values: NDArray[Any]
) -> dict[str, Any]:
    """Points, triangles and normals of poly data as the browser takes them.

    Parameters
    ----------
    data : PolyData
        mm; with point normals, if there are points.
    element : (n,) int, optional
        Element in which each point is.
    **values : (n,) float
        What is measured at the points, nan where nothing is.
    """
    if data.n_points == 0:
        return {"points": b"", "corners": b"", "normals": b""}
    data = data.triangulate()
    normals = np.round(127 * np.asarray(data.point_data["Normals"])).astype(np.int8)
    made: dict[str, Any] = {
        "points": np.asarray(data.points, dtype=np.float32).tobytes(),
        "corners": data.regular_faces.astype(np.uint32).tobytes(),
        "normals": normals.tobytes(),
    }
    if element is not None:
        made["element"] = element.astype(np.uint32).tobytes()
    if values:
        made["values"] = {
            name: np.asarray(of, dtype=np.float32).tobytes() for name, of in values.items()
        }
    return made


@cache
def empty_page() -> bytes:
    """A page of vtk.js, packed by gzip, that holds the parts of a scene without anything to see."""
    with pv.vtk_verbosity("off"):
        plotter: Any = pv.Plotter(off_screen=True, notebook=False)
    plotter.set_background("white")
    for name in PARTS:
        actor = plotter.add_mesh(
            _nothing(4 if name == "mask" else 3),
            scalars="rgba",
            rgb=True,
            **(CODED_LOOK if name == "mesh" else SURFACE_LOOK) | {"smooth_shading": False},
            name=name,
            reset_camera=False,
        )
        actor.prop.interpolation = "phong"
        if name == "mask":
            actor.ForceTranslucentOn()
    packed = gzip.compress(scene_page(plotter).encode())
    plotter.close()
    return packed


def _nothing(channels: int) -> pv.PolyData:
    """A triangle without size."""
    data = pv.PolyData(np.zeros((3, 3), np.float32), faces=[3, 0, 1, 2])
    data.point_data["rgba"] = np.zeros((3, channels), np.uint8)
    data.point_data["Normals"] = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    data.point_data.active_normals_name = "Normals"
    return data
