"""The page's own 3-D view in a file of its own, with the colorings that one may choose among."""

from __future__ import annotations

import html
import json
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import replace
from string import Template
from typing import Any

from heartgen.widgets.colors import Painted
from heartgen.widgets.mesh_scene import Scene
from heartgen.widgets.panels.view import key_html
from heartgen.widgets.parts import STYLES
from heartgen.widgets.scene_parts import opaque
from heartgen.widgets.scene_widget import SCRIPTS
from heartgen.widgets.transfer import WEB
from heartgen.widgets.viewer import HeartView

OF_ALL_WIDGETS = ("layout", "tabbable", "tooltip")
"""Attributes that say nothing of a scene."""


def scene_file(scene: Scene, colorings: Mapping[str, Painted], title: str) -> str:
    """Make a page that shows a scene, and needs no kernel.

    Parameters
    ----------
    scene : Scene
        What it shows.
    colorings : dict of str to Painted
        What its mesh can be colored by; the first is shown at first.
    title : str
        Of the page.
    """
    painted = list(colorings.values())
    mesh = scene.mesh.copy(deep=False)
    mesh.point_data["rgba"] = opaque(painted[0].rgb)
    view = HeartView()
    view.show(replace(scene, mesh=mesh))
    state = {
        name: value
        for name, value in view.widget.get_state().items()
        if not name.startswith("_") and name not in OF_ALL_WIDGETS
    }
    view.close()
    masked = scene.mask.n_points > 0
    chosen = {
        name: {"colors": each.rgb.tobytes(), "key": key_html(each, masked)}
        for name, each in colorings.items()
    }
    told = json.dumps(_plain({"scene": state, "colorings": chosen})).replace("</", "<\\/")
    return Template((WEB / "standalone.html").read_text(encoding="utf-8")).substitute(
        title=html.escape(title),
        style="".join((WEB / name).read_text(encoding="utf-8") for name in STYLES),
        script="\n".join((WEB / name).read_text(encoding="utf-8") for name in SCRIPTS),
        state=told,
    )


def _plain(value: Any) -> Any:
    """Values as JSON takes them: bytes as base 64."""
    if isinstance(value, bytes | memoryview):
        return {"base64": b64encode(value).decode()}
    if isinstance(value, Mapping):
        return {name: _plain(each) for name, each in value.items()}
    return [_plain(each) for each in value] if isinstance(value, list | tuple) else value
