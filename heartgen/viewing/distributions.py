"""How error and quality are spread over a cohort: box plots (paper, figure 10) and histograms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from heartgen.assessment import QUALITY_THRESHOLD

if TYPE_CHECKING:
    import pandas as pd

BOXES, BARS = (8.4, 3.6), (9.6, 2.7)
"""Of the pictures, inches."""

BLUE, ORANGE, INK = "#0072b2", "#d55e00", "#26303b"
"""Palette of Okabe and Ito (2008), safe for the color-blind."""

WIDTH, SPREAD = 0.5, 0.12
"""Of a box and of the points in it, where 1 is the distance between boxes."""

TURNED = 4
"""Groups from which their names are turned, to have room."""

BINS = 24

HISTOGRAMS = {
    "error_mean": "mean error (mm)",
    "q_mean": "mean quality Q",
    "q_scaled_mean": "scaled Jacobian",
    "fair_longitudinal_median": "wriggle along (degrees)",
    "seconds": "time (s)",
}


def draw_boxes(table: pd.DataFrame) -> Figure:
    """Draw box plots of error and quality, a box for each group, with all cases as points.

    Parameters
    ----------
    table : DataFrame
        Of results, with groups; cases without a mesh are left out.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    figure = Figure(figsize=BOXES, layout="constrained", facecolor="white")
    left, right = figure.subplots(1, 2)
    done = table.dropna(subset=["error_mean"])
    groups = {str(name): part for name, part in done.groupby("group", sort=False)}
    for axes, column, label in ((left, "error_mean", "error (mm)"), (right, "q_mean", "quality Q")):
        values = [part[column].to_numpy(dtype=float) for part in groups.values()]
        axes.boxplot(
            values,
            tick_labels=[f"{name} ({len(v)})" for name, v in zip(groups, values, strict=True)],
            widths=WIDTH,
            showfliers=False,
            medianprops={"color": ORANGE, "linewidth": 2},
            boxprops={"color": INK},
        )
        chance = np.random.default_rng(0)
        for place, heights in enumerate(values, start=1):
            across = place + chance.uniform(-SPREAD, SPREAD, len(heights))
            axes.plot(across, heights, "o", color=BLUE, alpha=0.5, markersize=4, zorder=3)
        axes.set(ylabel=label)
        axes.set_ylim(bottom=0)
        axes.spines[["top", "right"]].set_visible(False)
        if len(groups) >= TURNED:
            axes.tick_params(axis="x", labelrotation=30)
    _threshold(right)
    right.set_ylim(0, 1)
    return figure


def draw_distributions(table: pd.DataFrame) -> Figure:
    """Draw histograms of error, quality, wriggle and time over all cases with a mesh.

    Parameters
    ----------
    table : DataFrame
        Of results.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    figure = Figure(figsize=BARS, layout="constrained", facecolor="white")
    done = table.dropna(subset=["error_mean"])
    # Results of earlier versions lack the wriggle.
    shown = {name: label for name, label in HISTOGRAMS.items() if name in done}
    for axes, (column, label) in zip(figure.subplots(1, len(shown)), shown.items(), strict=True):
        axes.hist(done[column].to_numpy(dtype=float), bins=BINS, color=BLUE)
        axes.axvline(float(done[column].median()), color=ORANGE, linewidth=1.6)
        axes.set(xlabel=label)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set(ylabel="cases")
    return figure


def _threshold(axes: Axes) -> None:
    """The least quality of a success."""
    axes.axhline(QUALITY_THRESHOLD, color=INK, linestyle=":", linewidth=1.2)
