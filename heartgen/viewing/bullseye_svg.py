"""Bull's-eye plots for pages: values on hover and read aloud, in the page's own light or dark."""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import Normalize, to_hex, to_rgb

from heartgen.fields.segments import SEGMENTS
from heartgen.viewing.bullseye import DARK_FROM, LUMINANCE, RINGS, TOP, WALLS, Bullseye
from heartgen.viewing.fields import segment_color

SIZE = 100
"""Radius, in units of the drawing."""

MARGIN = 118
"""Half of the drawing's edge."""

STOPS = 12
"""Colors of the key between which a browser interpolates."""

ABSENT = "#8a94a0"
"""Color of segments without a value."""

DARK, LIGHT = "#1b2229", "#ffffff"


def bullseye_html(shown: Bullseye) -> str:
    """Values of the segments as a picture with its title and key.

    Parameters
    ----------
    shown : Bullseye
        What is drawn.
    """
    scale, colors = Normalize(*shown.limits), matplotlib.colormaps[shown.colors]
    told = {s: shown.text(v) for s, v in shown.values.items()}
    fill = {s: to_hex(colors(scale(v))) for s, v in shown.values.items()}
    stops = ",".join(to_hex(colors(i / (STOPS - 1))) for i in range(STOPS))
    low, high = map(shown.text, shown.limits)
    title = html.escape(shown.title)
    return (
        f"<figure><figcaption>{title}</figcaption>{_svg(shown.title, told, fill)}"
        f'<div class="hg-bar"><i style="background:linear-gradient(to right,{stops})"></i>'
        f"<span><b>{low}</b><b>{high}</b></span></div></figure>"
    )


def segment_key() -> str:
    """The 17 segments in their colors and with their numbers, as a picture."""
    numbers = {segment: str(segment) for segment in SEGMENTS}
    fill = {segment: segment_color(segment) for segment in SEGMENTS}
    return _svg("AHA segments", numbers, fill)


def _svg(title: str, told: Mapping[int, str], fill: Mapping[int, str]) -> str:
    """A bull's-eye: a text and a color for each segment."""
    parts = []
    for inner, outer, segments in RINGS.values():
        width = 360 / len(segments)
        for n, segment in enumerate(segments):
            middle = TOP + n * width
            color = fill.get(segment, ABSENT)
            text = told.get(segment, "–")
            name = SEGMENTS[segment]
            said = name if text == str(segment) else f"{name}: {text}"
            x, y = _point(0.0 if inner == 0 else (inner + outer) / 2, middle)
            dark = float(np.dot(to_rgb(color), LUMINANCE)) > DARK_FROM
            outline = _wedge(inner, outer, middle, width)
            parts.append(
                f'<g><title>{segment}, {said}</title><path d="{outline}" fill="{color}"/>'
                f'<text x="{x:.1f}" y="{y + 4:.1f}" fill="{DARK if dark else LIGHT}">{text}</text>'
                "</g>"
            )
    words = "".join(
        f'<text class="hg-wall" transform="translate({SIZE * x:.0f} {-SIZE * y + 4:.0f})'
        f'{" rotate(-90)" if x else ""}">{word}</text>'
        for word, x, y in WALLS
    )
    values = ", ".join(f"{SEGMENTS[s]} {told[s]}" for s in SEGMENTS if s in told)
    return (
        f'<svg class="hg-eye" viewBox="{-MARGIN} {-MARGIN} {2 * MARGIN} {2 * MARGIN}" role="img" '
        f'aria-label="{html.escape(title)}: {values}">{"".join(parts)}{words}</svg>'
    )


def _point(radius: float, angle: float) -> Any:
    """Where a point is in the drawing, of a radius from 0 to 1 and an angle in degrees."""
    turn = np.radians(angle)
    return SIZE * radius * np.cos(turn), -SIZE * radius * np.sin(turn)


def _wedge(inner: float, outer: float, middle: float, width: float) -> str:
    """Outline of a segment as SVG takes it."""
    if inner == 0:
        r = SIZE * outer
        return f"M {-r} 0 A {r} {r} 0 1 0 {r} 0 A {r} {r} 0 1 0 {-r} 0 Z"
    begin, end = middle - width / 2, middle + width / 2
    (a, b), (c, d) = _point(outer, begin), _point(outer, end)
    (e, f), (g, h) = _point(inner, end), _point(inner, begin)
    out, back = SIZE * outer, SIZE * inner
    return (
        f"M {a:.1f} {b:.1f} A {out} {out} 0 0 0 {c:.1f} {d:.1f} "
        f"L {e:.1f} {f:.1f} A {back} {back} 0 0 1 {g:.1f} {h:.1f} Z"
    )
