"""Three slices through a mask along the heart's own axes, with what the shape analysis found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.ndimage as ndi
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.images import Mask
from heartgen.viewing.card import SURFACE_NAMES, number

Array = NDArray[np.float64]

SIZE = (12.0, 5.5)
"""Of the figure, inches."""

PIXELS = 420
"""Samples along each side of a slice: finer than the print."""

MARGIN = 0.12
"""Empty room around the heart, over its largest extent."""

MYOCARDIUM, ENDO, EPI, BASE, AXIS = "#d9b8b0", "#d55e00", "#0072b2", "#009e73", "#26303b"
RIGHT = "#cc79a7"
"""Colours (lines: palette of Okabe and Ito, 2008, safe for the colour-blind)."""

SURFACES = {"lv_endo": ENDO, "rv_endo": RIGHT, "epi": EPI}
"""Colours of the surfaces of the shape analysis."""

LINE = 1.8
"""Width of contours, points."""

DASHES = (0, (6, 4))
"""Dashes and gaps of the long axis, points."""

AXES = ("x", "y", "z")
"""Of the heart's frame: x along the wider axis of the pool, z from apex to base."""


@dataclass(frozen=True)
class Slice:
    """A plane along two axes of the heart's frame.

    Attributes
    ----------
    title : str
    across, up : int
        Axes of the heart's frame that are shown to the right and upwards.
    """

    title: str
    across: int
    up: int


SLICES = (
    Slice("long axis, across the wider side", 0, 2),
    Slice("long axis, across the narrower side", 1, 2),
    Slice("short axis, at the thin line", 0, 1),
)


def draw_slices(mask: Mask, anatomy: Anatomy) -> Figure:
    """Draw three orthogonal slices through the centre of the blood pool.

    Parameters
    ----------
    mask : Mask
    anatomy : Anatomy
        Of that mask.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window; ``figure.savefig(path)`` writes it.
    """
    low, high = _box(mask, anatomy)
    centre = _pool_centre(anatomy)
    figure = Figure(figsize=SIZE, layout="constrained", facecolor="white")
    widths = [high[s.across] - low[s.across] for s in SLICES]
    panels = figure.subplots(1, len(SLICES), width_ratios=widths)
    for axes, slice_ in zip(panels, SLICES, strict=True):
        _draw(axes, slice_, mask, anatomy, centre, low, high)
    figure.suptitle(f"{mask.name}   ({_sizes(anatomy)})", fontsize="medium")
    figure.legend(handles=_key(anatomy), loc="outside lower center", ncols=6, frameon=False)
    return figure


def _draw(
    axes: Axes,
    slice_: Slice,
    mask: Mask,
    anatomy: Anatomy,
    centre: Array,
    low: Array,
    high: Array,
) -> None:
    """One slice: the voxels, the surfaces, the basal plane and the long axis."""
    i, j = slice_.across, slice_.up
    across, up = (np.linspace(low[a], high[a], PIXELS) for a in (i, j))
    points = np.tile(centre, (PIXELS, PIXELS, 1))
    points[..., i], points[..., j] = np.meshgrid(across, up)
    world = anatomy.to_world(points.reshape(-1, 3))
    index = mask.to_index(world)
    voxels = ndi.map_coordinates(mask.voxels.astype(np.uint8), index.T, order=0)
    extent = (low[i], high[i], low[j], high[j])
    axes.imshow(
        voxels.reshape(PIXELS, PIXELS),
        cmap=ListedColormap(["white", MYOCARDIUM]),
        extent=extent,
        origin="lower",
        vmin=0,
        vmax=1,
    )
    for name, colour in SURFACES.items():
        if name not in anatomy.surfaces:
            continue
        level = anatomy.surfaces[name].sample(world)[0].reshape(PIXELS, PIXELS)
        level[points[..., 2] > 0] = np.nan  # beyond the base a surface means nothing
        axes.contour(across, up, level, levels=[0.0], colors=colour, linewidths=LINE)
    if j == 2:
        axes.axhline(0.0, color=BASE, linewidth=LINE)
        axes.plot([0, 0], [-anatomy.length, 0], color=AXIS, linestyle=DASHES)
        axes.axhline(centre[2], color=AXIS, linewidth=LINE / 2, alpha=0.35)
    else:
        axes.plot(0, 0, "+", color=AXIS, markersize=10)
    axes.set(title=slice_.title, xlabel=f"{AXES[i]} (mm)", ylabel=f"{AXES[j]} (mm)")
    axes.set(xlim=extent[:2], ylim=extent[2:])
    axes.title.set_fontsize("medium")
    axes.spines[["top", "right"]].set_visible(False)


def _box(mask: Mask, anatomy: Anatomy) -> tuple[Array, Array]:
    """Corners of the mask in the heart's frame, with a margin, mm."""
    points = anatomy.to_heart(mask.to_world(np.argwhere(mask.voxels).astype(float)))
    low, high = points.min(0), points.max(0)
    room = MARGIN * float((high - low).max())
    return low - room, high + room


def _pool_centre(anatomy: Anatomy) -> Array:
    """Centre of the blood pool below the base, (3,) mm, heart's frame."""
    level = anatomy.surfaces["lv_endo"]
    index = np.argwhere(level.values < 0).astype(float)
    points = anatomy.to_heart(index @ level.affine[:3, :3].T + level.affine[:3, 3])
    return np.asarray(points[points[:, 2] < 0].mean(0))


def _sizes(anatomy: Anatomy) -> str:
    """The measures in one line."""
    parts = [
        f"cavity {number(anatomy.length)} mm long, radius {number(anatomy.radius)} mm",
        f"wall {number(anatomy.wall_thickness)} mm",
    ]
    if anatomy.rv is not None:
        parts.append(f"right free wall {number(anatomy.rv.wall_thickness)} mm")
    if anatomy.base.truncation is not None:
        parts.append(f"truncated by {number(anatomy.base.truncation)} mm")
    return ", ".join(parts)


def _key(anatomy: Anatomy) -> list[Patch | Line2D]:
    """What the colours mean."""
    named = {
        SURFACE_NAMES[name]: colour for name, colour in SURFACES.items() if name in anatomy.surfaces
    }
    named["end of the mesh at the base"] = BASE
    lines = [Line2D([], [], color=c, linewidth=LINE, label=name) for name, c in named.items()]
    axis = Line2D([], [], color=AXIS, linestyle=DASHES, label="long axis")
    return [Patch(color=MYOCARDIUM, label="mask"), *lines, axis]
