"""The 3-D view as a widget: vtk.js in the browser, fed by trame, or a page of its own without.

With a proxy to the kernel's port, the view is updated in place and its camera stays. Without one,
or without a graphics library, every update makes a page of vtk.js anew, which needs neither.
"""

from __future__ import annotations

import asyncio
import html
import os
import secrets
import tempfile
from typing import Any

import ipywidgets as widgets
import numpy as np
import pyvista as pv

from heartgen.viewing.camera import camera_around
from heartgen.viewing.page import scene_page
from heartgen.viewing.scene import CODED_LOOK, SURFACE_LOOK
from heartgen.viewing.windows import can_render
from heartgen.widgets.mesh_scene import Scene
from heartgen.widgets.parts import SETTLING

PROXY_VARIABLES = ("PYVISTA_TRAME_SERVER_PROXY_PREFIX", "JUPYTERHUB_SERVICE_PREFIX")
"""One of them is set where the kernel's port is reachable through the Jupyter server."""

ALTERNATIVE = "HEARTGEN_VIEW"
"""Set to ``html`` to do without a port."""

SENDINGS = (1, 3, 9, 27)
"""Times after which a browser that has just opened the view gets all again, over what a page needs
to settle: a busy one is not ready when it says so."""

PARTS = ("mesh", "edges", "mask")

HINT = "drag: turn · wheel: zoom · shift + drag: select · alt + drag: move"

TITLE = "The heart in 3-D: drag to turn, wheel to zoom"


class HeartView:
    """The 3-D view of a page.

    Attributes
    ----------
    widget : ipywidgets.Box
        To be put on the page.
    backend : {"starting", "client", "html"}
    """

    def __init__(self) -> None:
        self.backend = "starting"
        self.widget = widgets.Box([_notice("The 3-D view is starting …")])
        self.widget.add_class("hg-view")
        self._plotter, self._data = _empty_plotter()
        self._view: Any = None
        self._scene: Scene | None = None
        self._bounds: Any = None

    async def start(self) -> None:
        """Open the port of the view, or decide to do without."""
        if has_proxy() and can_render(self._plotter):
            self._view, source = await _serve(self._plotter, self.reset, self._send)
            frame = widgets.HTML(
                f'<iframe src="{html.escape(source)}" title="{TITLE}" class="hg-frame"></iframe>'
            )
            self.backend = "client"
            self.widget.children = (frame,)
        else:
            self.backend = "html"
        if self._scene is not None:
            self.show(self._scene)

    def show(self, scene: Scene, reset: bool = False) -> None:
        """Show a scene; the camera stays where it is, unless it is to be reset.

        Parameters
        ----------
        scene : Scene
            What to draw.
        reset : bool
            Whether the camera moves to where all is seen.
        """
        self._scene = scene
        for name in PARTS:
            data = getattr(scene, name)
            actor = self._plotter.actors[name]
            actor.SetVisibility(data.n_points > 0)
            if data.n_points > 0:
                self._data[name].copy_from(_ready(data, name))
        if reset or self._bounds is None:
            self._bounds = _bounds(scene)
            _place_camera(self._plotter, self._bounds)
        if self.backend == "client":
            self._view.update()
            if reset:
                self._view.push_camera()
        elif self.backend == "html":
            page = html.escape(scene_page(self._plotter))
            self.widget.children = (
                widgets.HTML(f'<iframe srcdoc="{page}" title="{TITLE}" class="hg-frame"></iframe>'),
            )

    def reset(self) -> None:
        """Look at the heart from the usual place."""
        if self._bounds is not None:
            _place_camera(self._plotter, self._bounds)
        if self.backend == "client":
            self._view.update()
            self._view.push_camera()
        elif self._scene is not None:
            self.show(self._scene)

    def _send(self, *_: Any) -> None:
        """Send all to a browser that has just opened the view: it misses what came before."""
        if self._view is not None:
            self._view.update()
            self._view.push_camera()
            for wait in SENDINGS:
                asyncio.get_running_loop().call_later(wait * SETTLING, self._view.update)

    def close(self) -> None:
        """Let go of the scene."""
        self._plotter.close()


def has_proxy() -> bool:
    """Whether the browser can reach a port of the kernel."""
    return os.environ.get(ALTERNATIVE) != "html" and any(map(os.environ.get, PROXY_VARIABLES))


async def _serve(plotter: Any, reset: Any, ready: Any) -> tuple[Any, str]:
    """Serve a plotter on a port of its own; the view, and its address behind the proxy.

    The page calls `reset` when its button is pressed, and `ready` when it can show a scene.
    """
    from trame.ui.vuetify3 import VAppLayout
    from trame.widgets import client
    from trame.widgets import html as tags
    from trame_pyvista import jupyter
    from trame_pyvista import widgets as views

    trame: Any = jupyter
    make_view: Any = views.PyVistaLocalView

    plotter.suppress_rendering = True
    os.environ.setdefault("VTK_WASM_DIR_OVERRIDE", tempfile.gettempdir())  # else it is downloaded
    server = trame.launch_server()
    await server.ready
    # Other visitors reach this port as well: only who knows the word gets in.
    word = secrets.token_urlsafe()
    server.protocol.updateSecret(word)
    name = plotter._id_name
    server.state.trame__title = "heartgen"
    with VAppLayout(server, template_name=name) as layout:
        layout.root.style = "background: white"
        fill = "position: absolute; inset: 0; width: 100%; height: 100%"
        view = make_view(plotter, style=fill)
        client.ClientTriggers(mounted=ready)
        style = (
            "background: rgba(255,255,255,.9); border: 1px solid #ccd3da; border-radius: 6px; "
            "padding: 4px 10px; font: 13px system-ui, sans-serif; color: #26303b; cursor: pointer"
        )
        with tags.Div(style="position: absolute; top: 10px; right: 10px; display: flex; gap: 6px"):
            tags.Button("Reset view", style=style, click=reset, title="Look from the usual place")
            tags.Button(
                "Save picture",
                style=style,
                title="Save what you see as PNG",
                click=f"trame.refs.view_{name}.captureImage()"
                ".then((b) => utils.download('heartgen.png', b, 'image/png'))",
            )
    return view, f"{trame.build_url(server, ui=name, server_proxy_enabled=True)}&secret={word}"


def _empty_plotter() -> tuple[Any, dict[str, pv.PolyData]]:
    """A plotter with all actors that will be needed, and their data: nothing to see yet."""
    with pv.vtk_verbosity("off"):
        plotter: Any = pv.Plotter(off_screen=True, notebook=False)
    plotter.set_background("white")
    data = {name: _ready(_nothing(), name) for name in PARTS}
    for name in PARTS:
        actor = plotter.add_mesh(
            data[name],
            scalars="rgba",
            rgb=True,
            **(CODED_LOOK if name == "mesh" else SURFACE_LOOK) | {"smooth_shading": False},
            name=name,
            reset_camera=False,
        )
        actor.prop.interpolation = "phong"
        actor.SetVisibility(False)
    plotter.actors["mask"].ForceTranslucentOn()
    return plotter, data


def _nothing() -> pv.PolyData:
    """A triangle without size."""
    data = pv.PolyData(np.zeros((3, 3), np.float32), faces=[3, 0, 1, 2])
    data.point_data["rgba"] = np.zeros((3, 4), np.uint8)
    data.point_data["Normals"] = np.tile(np.array([0, 0, 1], np.float32), (3, 1))
    return data


def _ready(data: pv.PolyData, name: str) -> pv.PolyData:
    """A copy with the arrays that are drawn, and no other; only the mask has an opacity."""
    made = pv.PolyData(data.points, faces=data.triangulate().faces)
    rgba = np.asarray(data.point_data["rgba"])
    made.point_data["rgba"] = rgba if name == "mask" else rgba[:, :3].copy()
    if "Normals" in data.point_data:
        made.point_data["Normals"] = np.asarray(data.point_data["Normals"], dtype=np.float32)
        made.point_data.active_normals_name = "Normals"
    return made


def _bounds(scene: Scene) -> Any:
    """Corners of what is to be seen, (3, 2) mm."""
    whole = scene.mask if scene.mask.n_points else scene.mesh
    return np.array(whole.bounds).reshape(3, 2)


def _place_camera(plotter: Any, bounds: Any) -> None:
    """Look from the side and a little from above."""
    eye, center = camera_around(bounds.T)
    plotter.camera.focal_point = center
    plotter.camera.position = eye
    plotter.camera.up = (0.0, 0.0, 1.0)
    plotter.reset_camera_clipping_range()


def _notice(text: str) -> widgets.HTML:
    """A line in the middle of the view."""
    notice = widgets.HTML(f"<p>{text}</p>")
    notice.add_class("hg-notice")
    return notice
