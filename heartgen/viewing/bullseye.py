"""Bull's-eye plots: a value for each of the 17 segments of the left ventricle.

The apex is in the middle, the base outside, the anterior wall above and the septum on the left, as
in Cerqueira et al. (2002), doi:10.1161/hc0402.102975.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib
import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Wedge

from heartgen.comparison import Comparison
from heartgen.errors import MeshError
from heartgen.fields import segment_strains
from heartgen.mesh import HexMesh

SIZE = (3.6, 4.35)
"""Of a picture, inches."""

RINGS = {
    "basal": (0.75, 1.0, range(1, 7)),
    "mid": (0.5, 0.75, range(7, 13)),
    "apical": (0.25, 0.5, range(13, 17)),
    "apex": (0.0, 0.25, range(17, 18)),
}
"""Inner and outer radius of each level, and its segments, counterclockwise from the top."""

TOP = 90.0
"""Angle of the middle of the anterior segments, degrees."""

WALLS = (("anterior", 0, 1.09), ("septal", -1.09, 0), ("inferior", 0, -1.09), ("lateral", 1.09, 0))
"""Words around the plot, and where they are."""

ABSENT = "#e8ecf0"
"""Color of segments without a value."""

DARK_FROM = 0.55
"""Lightness of a color above which dark letters are read on it."""

LUMINANCE = (0.2126, 0.7152, 0.0722)
"""Of red, green and blue (ITU-R BT.709)."""


@dataclass(frozen=True)
class Bullseye:
    """Values of segments, and how they are drawn.

    Attributes
    ----------
    key, title : str
        Its name in programs and in print, with the unit.
    values : mapping of int to float
        By AHA segment.
    limits : (float, float)
        Ends of the color scale.
    colors : str
        A map of matplotlib that the color-blind can read.
    percent : bool
        Values are shares to be shown in percent.
    digits : int
        Behind the point, of values that are no shares.
    """

    key: str
    title: str
    values: Mapping[int, float]
    limits: tuple[float, float]
    colors: str = "viridis"
    percent: bool = False
    digits: int = 1

    def text(self, value: float) -> str:
        """A value in print.

        Parameters
        ----------
        value : float
            Of a segment.
        """
        return f"{100 * value:+.0f}" if self.percent else f"{value:.{self.digits}f}"


def bullseyes(
    comparison: Comparison,
    meshes: Sequence[HexMesh],
    septal_direction: Sequence[float] | None = None,
) -> tuple[Bullseye, ...]:
    """Wall thickness at both extremes, and what changes from diastole to systole.

    Parameters
    ----------
    comparison : Comparison
        A heart in several states.
    meshes : sequence of HexMesh
        That were compared, in the same order.
    septal_direction : (3,) float, optional
        Direction from the left ventricle to the septum, see `heartgen.fields.heart_axes`.

    Returns
    -------
    tuple of Bullseye
        Without strains where elements do not correspond.
    """
    large, small = comparison.diastole, comparison.systole
    before, after = (comparison.indices[n].wall_thickness for n in (large, small))
    both = [*before.values(), *after.values()]
    ends = float(np.floor(min(both))), float(np.ceil(max(both)))
    found = [
        Bullseye(key, f"wall, {comparison.names[n]} (mm)", values, ends)
        for key, n, values in (("diastole", large, before), ("systole", small, after))
    ]
    change = {s: after[s] / before[s] - 1 for s in before if s in after}
    found.append(_around_zero("thickening", "wall thickening (%)", change))
    try:
        strains = segment_strains(meshes[large], meshes[small], septal_direction)
    except MeshError:  # the comparison has a note that says why
        return tuple(found)
    for name in ("longitudinal", "circumferential", "radial"):
        values = {s: float(getattr(strain, name)) for s, strain in strains.items()}
        found.append(_around_zero(name, f"{name} strain (%)", values))
    return tuple(found)


def draw_bullseye(shown: Bullseye) -> Figure:
    """Draw the values of the segments.

    Parameters
    ----------
    shown : Bullseye
        What is drawn.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    figure = Figure(figsize=SIZE, layout="constrained", facecolor="white")
    axes = figure.subplots()
    scale, colors = Normalize(*shown.limits), matplotlib.colormaps[shown.colors]
    for inner, outer, segments in RINGS.values():
        width = 360 / len(segments)
        for n, segment in enumerate(segments):
            middle = TOP + n * width
            value = shown.values.get(segment)
            color: Any = ABSENT if value is None else colors(scale(value))
            start, end = (0, 360) if inner == 0 else (middle - width / 2, middle + width / 2)
            axes.add_patch(
                Wedge((0, 0), outer, start, end, width=outer - inner, fc=color, ec="white", lw=1.2)
            )
            radius = 0 if inner == 0 else (inner + outer) / 2
            at = radius * np.cos(np.radians(middle)), radius * np.sin(np.radians(middle))
            dark = value is None or float(np.dot(color[:3], LUMINANCE)) > DARK_FROM
            axes.annotate(
                "–" if value is None else shown.text(value),
                at,
                ha="center",
                va="center",
                fontsize=9,
                color="#26303b" if dark else "white",
            )
    for word, x, y in WALLS:
        axes.text(x, y, word, ha="center", va="center", fontsize=8, rotation=90 * abs(np.sign(x)))
    axes.set(xlim=(-1.16, 1.16), ylim=(-1.16, 1.16), aspect="equal")
    axes.set_axis_off()
    axes.set_title(shown.title, fontsize=11)
    bar = figure.colorbar(
        matplotlib.cm.ScalarMappable(scale, colors),
        ax=axes,
        orientation="horizontal",
        fraction=0.05,
        pad=0.02,
        format=(lambda v, _: f"{100 * v:.0f}") if shown.percent else None,
    )
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8)
    return figure


def _around_zero(key: str, title: str, values: Mapping[int, float]) -> Bullseye:
    """Values of a change, on a scale whose middle is none."""
    most = max((abs(value) for value in values.values()), default=0.0)
    end = max(0.1, float(np.ceil(10 * most) / 10))
    return Bullseye(key, title, values, (-end, end), "RdBu", percent=True)
