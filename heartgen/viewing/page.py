"""A page with the report and a 3-D view that opens in any browser, without server or network.

The scene is handed to vtk.js, whose viewer comes with trame-vtk; nothing is rendered here.
"""

from __future__ import annotations

import html
import io
import json
import zipfile
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

import matplotlib
import pyvista as pv
from matplotlib.colors import to_hex
from trame_vtk.modules.vtk.serializers import (  # type: ignore[import-untyped]
    SynchronizationContext,
    extract_array_hash,
    initialize_serializers,
    reference_id,
    serialize,
)
from trame_vtk.tools.vtksz2html import write_html  # type: ignore[import-untyped]

from heartgen.formats import write_text
from heartgen.viewing.card import Section, sections, verdict
from heartgen.viewing.scene import MASK, Scale, color_scale, nice_limit, plot

if TYPE_CHECKING:
    from heartgen.report import Report
    from heartgen.result import Personalization

STOPS = 12
"""Colors of the key between which a browser interpolates; the maps are smooth."""

SCENE_STYLE = "html, body { overflow: hidden; margin: 0; height: 100% }"
"""A scene fills its frame, and needs no scrollbars."""

SIZED = """const again = () => requestAnimationFrame(() => dispatchEvent(new Event("resize")));
new ResizeObserver(again).observe(document.documentElement);"""
"""Has the viewer drawn again whenever its frame gets a size: a notebook may give it one late."""

DEPTH = 1
"""Where the serializers are to start counting."""


def view_html(result: Personalization, path: str | Path) -> Path:
    """Write a page with the report and the mesh over the mask, colored by the error.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and its report.
    path : path
        The file appears whole or not at all.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    HeartgenError
        If it cannot be written.
    """
    scale = color_scale("error", nice_limit(result.report.accuracy.p95))
    plotter: Any = plot(result, color="error", off_screen=True)
    plotter.remove_scalar_bar()
    scene = scene_page(plotter, told=("error", "distance to the mask", "mm"))
    plotter.close()
    stack = result.anatomy.slices is not None
    return fill_page("page.html", path, scene, **_fields(result.report, scale, stack))


def fill_page(template: str, path: str | Path, scene: str, **fields: str) -> Path:
    """Write a page with a scene and what else a template of this package asks for.

    Parameters
    ----------
    template : str
        File name of the template.
    path : path
        File to write.
    scene : str
        A page of its own, as of `scene_page`.
    **fields : str
        What the template's other places are filled with, by name.
    """
    text, style = (
        files("heartgen.viewing").joinpath(name).read_text(encoding="utf-8")
        for name in (template, "page.css")
    )
    write_text(Template(text).substitute(fields, style=style, scene=html.escape(scene)), path)
    return Path(path)


def _fields(report: Report, scale: Scale, stack: bool) -> dict[str, str]:
    """What the template asks for, but for the scene."""
    judged = verdict(report)
    low, high = scale.limits
    radial, circumferential, longitudinal = report.options["elements"]
    return {
        "name": html.escape(report.name),
        "level": judged.level,
        "verdict": html.escape(judged.text),
        "sections": "\n".join(map(section_table, sections(report))),
        "notes": "\n".join(f"<li>{html.escape(f.message)}</li>" for f in report.findings),
        "key": gradient(scale),
        "key_title": scale.title,
        "key_low": f"{low:g}",
        "key_middle": f"{(low + high) / 2:g}",
        "key_high": f"{high:g} or more",
        "mask_color": MASK,
        "mask": "contours in the slices" if stack else "mask, where it leaves the mesh",
        "made": html.escape(
            f"heartgen {report.versions['heartgen']} · level of detail {report.options['lod']} · "
            f"{radial} × {circumferential} × {longitudinal} elements"
        ),
    }


def section_table(section: Section) -> str:
    """A titled table.

    Parameters
    ----------
    section : Section
        Title and rows.
    """
    rows = "".join(
        f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
        for name, value in section.rows
    )
    return f"<section><h2>{html.escape(section.title)}</h2><table>{rows}</table></section>"


def gradient(scale: Scale) -> str:
    """Colors of a scale, from its lower end on, as a page takes them.

    Parameters
    ----------
    scale : Scale
        Of a quantity.
    """
    colors = matplotlib.colormaps[scale.colors]
    return ", ".join(to_hex(colors(i / (STOPS - 1))) for i in range(STOPS))


def scene_page(plotter: pv.Plotter, told: tuple[str, str, str] | None = None) -> str:
    """Make a page of vtk.js that shows what a plotter holds, all in one text.

    Parameters
    ----------
    plotter : pyvista.Plotter
        Holds the scene.
    told : (str, str, str), optional
        A scalar of points that is told where the mouse is: its array, its name and its unit.
    """
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("index.json", json.dumps(_scene(plotter.render_window)))
    page = io.StringIO()
    write_html(packed.getvalue(), page)
    made = page.getvalue()
    added = f"<style>{SCENE_STYLE}</style><script>{SIZED}</script>"
    if told is not None:
        script = files("heartgen.viewing").joinpath("hover.js").read_text(encoding="utf-8")
        added += f"<script>{script}\ntell({json.dumps(told)});</script>"
    return made.replace("</body>", f"{added}</body>", 1)


def _scene(window: Any) -> dict[str, Any]:
    """A scene as vtk.js reads it: a tree of objects, and their arrays by hash."""
    initialize_serializers()
    context = SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    state = serialize(None, window, reference_id(window), context, DEPTH)
    camera = window.GetRenderers().GetFirstRenderer().GetActiveCamera()
    state["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": camera.GetFocalPoint(),
        "camera": reference_id(camera),
    }
    arrays = {
        entry["hash"]: {**entry, "content": context.get_cached_data_array(entry["hash"], False)}
        for entry in extract_array_hash(state)
    }
    return {"scene": state, "hashes": arrays}
