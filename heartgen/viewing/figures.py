"""Pictures of how good a mesh is: histograms of error and quality, and the levels compared."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from heartgen.assessment import QUALITY_THRESHOLD
from heartgen.images.isosurface import isosurface
from heartgen.mesh.closest import closest_points
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.viewing.card import SURFACE_NAMES
from heartgen.viewing.tradeoff import Point, draw_curves

if TYPE_CHECKING:
    from heartgen.result import Personalization

Array = NDArray[np.float64]

SIZE = (9.6, 2.9)
"""Of the histograms, inches."""

BINS = 30

BLUE, ORANGE, INK = "#0072b2", "#d55e00", "#26303b"
"""Palette of Okabe and Ito (2008), safe for the color-blind."""

BEYOND = 99.5
"""Percentile of the error at which its histogram ends."""

DENSE = 20_000
"""Points of the mask's surface that are enough for a histogram."""


def draw_histograms(result: Personalization) -> Figure:
    """Draw the distribution of error and quality, and the mean error of each surface.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and its report.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    figure = Figure(figsize=SIZE, layout="constrained", facecolor="white")
    left, middle, right = figure.subplots(1, 3)
    accuracy, quality = result.report.accuracy, result.report.quality
    error, weights = _error(result)
    end = float(np.percentile(error, BEYOND))
    left.hist(np.minimum(error, end), bins=BINS, range=(0, end), weights=weights, color=BLUE)
    _mean_line(left, accuracy.mean, f"mean {accuracy.mean:.2f}")
    left.set(xlabel="distance to the mesh (mm)", ylabel="share of the surface", title="Error")
    ratio = jacobian_ratio(result.mesh)
    middle.hist(ratio, bins=BINS, range=(min(0.0, float(ratio.min())), 1.0), color=BLUE)
    middle.yaxis.set_major_locator(MaxNLocator(integer=True))
    _mean_line(middle, quality.mean, f"mean {quality.mean:.2f}")
    middle.axvline(QUALITY_THRESHOLD, color=INK, linestyle=":", linewidth=1.2)
    middle.set(xlabel="Jacobian ratio Q", ylabel="elements", title="Quality")
    names = [SURFACE_NAMES[name] for name in accuracy.by_surface]
    bars = right.barh(names[::-1], list(accuracy.by_surface.values())[::-1], color=BLUE)
    right.bar_label(bars, fmt="%.2f", padding=3, fontsize="small")
    right.set(xlabel="mean distance (mm)", title="Error by region")
    right.margins(x=0.18)
    for axes in (left, middle, right):
        axes.spines[["top", "right"]].set_visible(False)
        axes.title.set_fontsize("medium")
    return figure


def draw_tradeoff(results: Sequence[Personalization]) -> Figure:
    """Draw accuracy against quality, a point for each level of detail (paper, figure 6).

    Parameters
    ----------
    results : sequence of Personalization
        Of one case.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window.
    """
    points = [
        Point(f"LoD {r.options.lod}", r.report.accuracy.mean, r.report.quality.mean)
        for r in results
    ]
    return draw_curves({"": points}, results[0].mask.name)


def _error(result: Personalization) -> tuple[Array, Array]:
    """Distances to the mesh, mm, as the report measures them, and the share of each."""
    anatomy = result.anatomy
    target = isosurface(anatomy.myocardium) if anatomy.slices is None else anatomy.slices.outline
    step = max(1, len(target.points) // DENSE)
    points, weights = target.points[::step], target.weights[::step]
    faces = result.mesh.topology.external
    return closest_points(result.mesh, faces, points).distance, weights / weights.sum()


def _mean_line(axes: Axes, value: float, label: str) -> None:
    """A line at the mean; its label is on the side that has more room, and before any bar."""
    low, high = axes.get_xlim()
    side = 1 if value < (low + high) / 2 else -1
    axes.axvline(value, color=ORANGE, linewidth=1.6)
    axes.annotate(
        label,
        (value, 0.98),
        xycoords=("data", "axes fraction"),
        xytext=(6 * side, 0),
        textcoords="offset points",
        ha="left" if side > 0 else "right",
        va="top",
        color=INK,
        fontsize="small",
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 1},
    )
