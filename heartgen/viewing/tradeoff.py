"""Accuracy against quality (paper, figure 6): of one heart, or of all hearts of a sweep."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from heartgen.assessment import QUALITY_THRESHOLD

if TYPE_CHECKING:
    import pandas as pd

SQUARE, WIDE = (5.0, 3.6), (7.5, 4.2)
"""Of the picture of one curve, and of several with their key, inches."""

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#26303b")
"""Palette of Okabe and Ito (2008), safe for the color-blind."""

MARKERS = "osD^vP*"

LEAST_SPAN = 0.4
"""Of an axis: of the error, over its largest value; of the quality."""

FAINT = 0.4
"""Opacity of the bars from the first to the third quartile."""

LIMIT = "#66717e"


@dataclass(frozen=True)
class Point:
    """A mesh, or the median of many.

    Attributes
    ----------
    label : str
        Written beside it.
    error, quality : float
        Mean distance from mask to mesh, mm, and mean Jacobian ratio.
    errors, qualities : (float, float) or None
        First and third quartile, if it is a median.
    """

    label: str
    error: float
    quality: float
    errors: tuple[float, float] | None = None
    qualities: tuple[float, float] | None = None


def draw_curves(
    curves: Mapping[str, Sequence[Point]], title: str, along: str = "level of detail"
) -> Figure:
    """Draw error against quality, a line through the points of each curve.

    Parameters
    ----------
    curves : mapping of str to sequence of Point
        By name; that of a single curve is not shown.
    title : str
        Above the picture.
    along : str
        What the labels of the points are.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    several = len(curves) > 1
    figure = Figure(figsize=WIDE if several else SQUARE, layout="constrained", facecolor="white")
    axes = figure.subplots()
    for n, (name, points) in enumerate(curves.items()):
        color = COLORS[n % len(COLORS)]
        at = [p.error for p in points], [p.quality for p in points]
        axes.plot(*at, marker=MARKERS[n % len(MARKERS)], color=color, label=name, zorder=2)
        for k, p in enumerate(points):
            bars: Any = {"color": color, "alpha": FAINT, "linewidth": 1.0, "zorder": 1}
            if p.errors is not None:
                axes.plot(p.errors, (p.quality, p.quality), **bars)
            if p.qualities is not None:
                axes.plot((p.error, p.error), p.qualities, **bars)
            axes.annotate(
                p.label,
                (p.error, p.quality),
                xytext=(6, -11) if k % 2 else (-6, 5),  # on either side: neighbors may be close
                ha="left" if k % 2 else "right",
                textcoords="offset points",
                fontsize="small",
                color=color if several else "black",
            )
    axes.axhline(QUALITY_THRESHOLD, color=LIMIT, linestyle="--", linewidth=1.2)
    axes.set(xlabel="mean error (mm)", ylabel="mean quality Q", title=title)
    axes.title.set_fontsize("medium")
    axes.margins(0.15)
    _widen(axes)
    axes.spines[["top", "right"]].set_visible(False)
    if several:
        figure.legend(
            loc="outside right upper",
            frameon=False,
            fontsize="small",
            title=f"numbers: {along}",
            title_fontsize="small",
        )
    return figure


def _widen(axes: Axes) -> None:
    """Around a single point, axes that say how much it is: no differences of rounding."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    short = LEAST_SPAN * max(abs(right), abs(left)) - (right - left)
    if short > 0:
        axes.set_xlim(max(0.0, left - short / 2), right + short / 2)
    if high - low < LEAST_SPAN:
        middle = (low + high) / 2
        axes.set_ylim(middle - LEAST_SPAN / 2, middle + LEAST_SPAN / 2)


def draw_sweep(table: pd.DataFrame, varied: Sequence[str]) -> Figure:
    """Draw the medians and quartiles over all hearts of a sweep.

    Parameters
    ----------
    table : DataFrame
        Of `heartgen.cohort.sweep`.
    varied : sequence of str
        Options that had several values. A curve runs along the levels of detail, or along the
        first of the options if there was one level; each combination of the others has its own.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    along = "lod" if "lod" in varied or not varied else varied[0]
    others = [name for name in varied if name != along]
    done = table.dropna(subset=["error_mean"]) if "error_mean" in table else table.iloc[:0]
    curves: dict[str, list[Point]] = {}
    for values, part in done.groupby([*others, along], sort=False):
        name = ", ".join(f"{o} {_word(v)}" for o, v in zip(others, values, strict=False))
        curves.setdefault(name, []).append(_median(_word(values[-1]), part))
    hearts = done["case"].nunique()
    title = (
        str(done["case"].iloc[0]) if hearts == 1 else f"medians and quartiles of {hearts} hearts"
    )
    return draw_curves(curves, title)


def _median(label: str, part: pd.DataFrame) -> Point:
    """Median and quartiles; of a single heart, the heart."""
    error, quality = (part[name].quantile([0.25, 0.5, 0.75]) for name in ("error_mean", "q_mean"))
    point = Point(label, float(error.iloc[1]), float(quality.iloc[1]))
    if len(part) == 1:
        return point
    spread = [(float(q.iloc[0]), float(q.iloc[2])) for q in (error, quality)]
    return Point(label, point.error, point.quality, spread[0], spread[1])


def _word(value: object) -> str:
    """A value in print."""
    if isinstance(value, (bool, np.bool_)):
        return "yes" if value else "no"
    return f"{value:g}" if isinstance(value, float) else str(value)
