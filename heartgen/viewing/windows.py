"""Where a 3-D scene goes: to a window, to a picture, or to whoever draws on."""

from __future__ import annotations

from ctypes.util import find_library
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict, cast

import pyvista as pv

from heartgen.errors import HeartgenError

LAST_RESORT = "vtkOSOpenGLRenderWindow"
WITHOUT_SCREEN = ("vtkEGLRenderWindow", LAST_RESORT)
"""Classes of VTK's windows that are none."""


class WindowOptions(TypedDict, total=False):
    """What a scene that is shown takes by keyword.

    Attributes
    ----------
    off_screen : bool
        Open no window: the scene is made, to be exported or changed further.
    screenshot : path, optional
        Write a picture there (PNG) instead of opening a window.
    window_size : (int, int)
        Pixels.
    """

    off_screen: bool
    screenshot: str | Path | None
    window_size: tuple[int, int]


@dataclass(frozen=True)
class Window:
    """A window, or what stands for it.

    Attributes
    ----------
    off_screen, screenshot, window_size : as of `WindowOptions`
        900 by 900 pixels on the screen if omitted.
    """

    off_screen: bool = False
    screenshot: str | Path | None = None
    window_size: tuple[int, int] = (900, 900)

    def empty(self, **options: Any) -> pv.Plotter:
        """An empty white scene; `HeartgenError` if it could not be drawn.

        Parameters
        ----------
        **options : object
            Passed on to `pyvista.Plotter`.
        """
        hidden = self.off_screen or self.screenshot is not None
        with pv.vtk_verbosity("off"):  # that there is no screen is no news
            plotter: Any = pv.Plotter(
                off_screen=hidden, window_size=list(self.window_size), **options
            )
        if self.screenshot is not None:
            require_graphics(plotter)
        elif not (hidden or plotter.notebook):
            require_window(plotter)
        plotter.set_background("white", all_renderers=True)
        return cast("pv.Plotter", plotter)

    def shown(self, plotter: Any) -> pv.Plotter:
        """A scene that is ready, once it is shown or its picture written.

        Parameters
        ----------
        plotter : pyvista.Plotter
            That `empty` gave.
        """
        if self.screenshot is not None:
            plotter.screenshot(filename=self.screenshot)
        elif not self.off_screen:
            plotter.show()
        return cast("pv.Plotter", plotter)


def can_render(plotter: Any) -> bool:
    """Whether there is a graphics library to draw with.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of the scene.
    """
    last_resort = plotter.render_window.GetClassName() == LAST_RESORT
    return not last_resort or find_library("OSMesa") is not None


def require_graphics(plotter: Any) -> None:
    """Refuse to draw where VTK would crash: it falls back on OSMesa even where there is none.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of the scene.
    """
    if not can_render(plotter):
        raise HeartgenError(
            "pictures of the mesh need a graphics library, and this machine has none: install "
            "libegl1 and libgl1-mesa-dri, or make a page with view_html and open it in a browser"
        )


def require_window(plotter: Any) -> None:
    """Refuse to open a window where there is no screen: VTK would show nothing.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Of the scene.
    """
    if plotter.render_window.GetClassName() in WITHOUT_SCREEN:
        raise HeartgenError(
            "there is no screen to open a window on: write a picture with "
            'plot(screenshot="mesh.png"), or show it in a notebook'
        )
