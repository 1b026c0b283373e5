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
from heartgen.images.mask import BESIDE
from heartgen.images.volume import Volume
from heartgen.viewing.card import SURFACE_NAMES, number
from heartgen.viewing.fit_lines import FitSection, draw_fit
from heartgen.viewing.gray_image import draw_gray

Array = NDArray[np.float64]

SIZE = (12.0, 5.5)
"""Of the figure, inches."""

PIXELS = 420
"""Samples along each side of a slice: finer than the print."""

SMALL, SMALL_PIXELS = 3.6, 220
"""Side of a slice that stands alone, inches, and its samples along each side."""

MARGIN = 0.12
"""Empty room around the heart, over its largest extent."""

MYOCARDIUM, ENDO, EPI, BASE, AXIS = "#d9b8b0", "#d55e00", "#0072b2", "#009e73", "#26303b"
RIGHT = "#cc79a7"
BLOOD = ("#fbe3dd", "#dde8f5")
"""Colors (lines: palette of Okabe and Ito, 2008, safe for the color-blind)."""

SURFACES = {"lv_endo": ENDO, "rv_endo": RIGHT, "epi": EPI}
"""Colors of the surfaces of the shape analysis."""

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
        What the slice is called.
    across, up : int
        Axes of the heart's frame that are shown to the right and upwards.
    """

    title: str
    across: int
    up: int


SLICES = (
    Slice("long axis, wider side", 0, 2),
    Slice("long axis, narrower side", 1, 2),
    Slice("short axis, at the thin line", 0, 1),
)


@dataclass(frozen=True, eq=False)
class SliceView:
    """A mask to be cut along the axes of its heart, or of its image where no heart is known.

    Attributes
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    anatomy : Anatomy or None
        Of the mask; None where no heart is known.
    frame : (4, 4) float64
        From the view to the world (LPS), mm.
    low, high : (3,) float64
        Corners of what is shown, mm, frame of the view.
    center : (3,) float64
        Where the slices meet at first, mm, frame of the view.
    """

    mask: Mask
    anatomy: Anatomy | None
    frame: Array
    low: Array
    high: Array
    center: Array


def slice_view(mask: Mask, anatomy: Anatomy | None = None) -> SliceView:
    """Prepare a mask to be cut: along the heart's axes, or the image's if there is no anatomy.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    anatomy : Anatomy, optional
        Of the mask, if it is known.
    """
    if anatomy is None:
        frame = mask.affine.copy()
        frame[:3, :3] /= mask.spacing
    else:
        frame = anatomy.frame
    index = np.argwhere(mask.voxels).astype(float)
    points = (mask.to_world(index) - frame[:3, 3]) @ frame[:3, :3]
    low, high = points.min(0), points.max(0)
    room = MARGIN * float((high - low).max())
    center = (low + high) / 2 if anatomy is None else _pool_center(anatomy)
    return SliceView(mask, anatomy, frame, low - room, high + room, center)


def draw_slices(mask: Mask, anatomy: Anatomy) -> Figure:
    """Draw three orthogonal slices through the center of the blood pool.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    anatomy : Anatomy
        Of that mask.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window; ``figure.savefig(path)`` writes it.
    """
    view = slice_view(mask, anatomy)
    figure = Figure(figsize=SIZE, layout="constrained", facecolor="white")
    widths = [view.high[s.across] - view.low[s.across] for s in SLICES]
    panels = figure.subplots(1, len(SLICES), width_ratios=widths)
    for axes, slice_ in zip(panels, SLICES, strict=True):
        _draw(axes, slice_, view, view.center, PIXELS)
        if slice_.up == 2:
            axes.axhline(view.center[2], color=AXIS, linewidth=LINE / 2, alpha=0.35)
        axes.set(title=slice_.title)
        axes.set(xlabel=f"{AXES[slice_.across]} (mm)", ylabel=f"{AXES[slice_.up]} (mm)")
        axes.title.set_fontsize("medium")
    figure.suptitle(f"{mask.name}   ({_sizes(anatomy)})", fontsize="medium")
    figure.legend(handles=_key(anatomy), loc="outside lower center", ncols=6, frameon=False)
    return figure


def draw_slice(
    view: SliceView,
    slice_: Slice,
    position: float,
    fit: FitSection | None = None,
    behind: Volume | None = None,
) -> Figure:
    """Draw one slice, without words around it.

    Parameters
    ----------
    view : SliceView
        The mask to be cut.
    slice_ : Slice
        Along which axes.
    position : float
        Along the axis across the slice, mm, frame of the view.
    fit : FitSection, optional
        A mesh in this slice, drawn in place of the surfaces of the shape analysis.
    behind : Volume, optional
        An image that is drawn in place of the mask.

    Returns
    -------
    matplotlib.figure.Figure
        Not bound to any window. What it shows is as of `extent_of`.
    """
    across = 3 - slice_.across - slice_.up
    center = view.center.copy()
    center[across] = position
    figure = Figure(figsize=(SMALL, SMALL), facecolor="white")
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    if behind is not None:
        extent = extent_of(view, slice_)
        ends = np.array(extent).reshape(2, 2)
        points = _points(slice_, center, ends, SMALL_PIXELS)
        world = points @ view.frame[:3, :3].T + view.frame[:3, 3]
        draw_gray(axes, behind, world, extent)
    if fit is None:
        _draw(axes, slice_, view, center, SMALL_PIXELS, voxels=behind is None)
    else:
        if behind is None:
            draw_section(axes, slice_, view, center, SMALL_PIXELS)
        draw_fit(axes, fit, behind is not None)
    low_x, high_x, low_y, high_y = extent_of(view, slice_)
    axes.set(xlim=(low_x, high_x), ylim=(low_y, high_y))
    axes.set_axis_off()
    return figure


def extent_of(view: SliceView, slice_: Slice) -> tuple[float, float, float, float]:
    """Ends of what `draw_slice` shows, to the right and upwards, mm, frame of the view.

    Parameters
    ----------
    view : SliceView
        The mask to be cut.
    slice_ : Slice
        Along which axes.
    """
    middle = (view.low + view.high) / 2
    half = float((view.high - view.low).max()) / 2
    x, y = middle[slice_.across], middle[slice_.up]
    return x - half, x + half, y - half, y + half


def draw_section(
    axes: Axes, slice_: Slice, view: SliceView, center: Array | None = None, pixels: int = PIXELS
) -> None:
    """Draw the voxels where a slice through a point cuts them.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Drawn into.
    slice_ : Slice
        Along which axes.
    view : SliceView
        The mask to be cut.
    center : (3,) float64, optional
        On the slice, mm, frame of the view; where the slices meet at first if omitted.
    pixels : int
        Samples along each side.
    """
    mask, low, high = view.mask, view.low, view.high
    i, j = slice_.across, slice_.up
    points = _grid(slice_, view, view.center if center is None else center, pixels)
    index = mask.to_index(points.reshape(-1, 3) @ view.frame[:3, :3].T + view.frame[:3, 3])
    shown = mask.voxels.astype(np.uint8)
    if mask.blood is not None:
        shown = np.where(mask.voxels, 1, mask.blood * (mask.blood != BESIDE)).astype(np.uint8)
    voxels = ndi.map_coordinates(shown, index.T, order=0)
    extent = (low[i], high[i], low[j], high[j])
    axes.imshow(
        voxels.reshape(pixels, pixels),
        cmap=ListedColormap(["white", MYOCARDIUM, *BLOOD]),
        extent=extent,
        origin="lower",
        vmin=0,
        vmax=3,
    )
    axes.set(xlim=extent[:2], ylim=extent[2:])
    axes.spines[["top", "right"]].set_visible(False)


def _draw(
    axes: Axes, slice_: Slice, view: SliceView, center: Array, pixels: int, voxels: bool = True
) -> None:
    """One slice: the voxels, the surfaces, the basal plane and the long axis."""
    if voxels:
        draw_section(axes, slice_, view, center, pixels)
    anatomy, j = view.anatomy, slice_.up
    if anatomy is None:
        return
    points = _grid(slice_, view, center, pixels)
    across, up = points[0, :, slice_.across], points[:, 0, j]
    world = points.reshape(-1, 3) @ view.frame[:3, :3].T + view.frame[:3, 3]
    height = anatomy.base.surface.height(world).reshape(pixels, pixels)
    for name, color in SURFACES.items():
        if name not in anatomy.surfaces:
            continue
        level = anatomy.surfaces[name].sample(world)[0].reshape(pixels, pixels)
        level[height > 0] = np.nan  # beyond the base a surface means nothing
        if np.nanmin(level, initial=1.0) < 0 < np.nanmax(level, initial=-1.0):
            axes.contour(across, up, level, levels=[0.0], colors=color, linewidths=LINE)
    if j == 2:
        axes.contour(across, up, height, levels=[0.0], colors=BASE, linewidths=LINE)
        axes.plot([0, 0], [-anatomy.length, 0], color=AXIS, linestyle=DASHES)
    else:
        axes.plot(0, 0, "+", color=AXIS, markersize=10)


def _grid(slice_: Slice, view: SliceView, center: Array, pixels: int) -> Array:
    """Points (pixels, pixels, 3) of a slice, mm, frame of the view."""
    ends = np.stack([view.low, view.high], axis=1)[[slice_.across, slice_.up]]
    return _points(slice_, center, ends, pixels)


def _points(slice_: Slice, center: Array, ends: Array, pixels: int) -> Array:
    """Points (pixels, pixels, 3) of a slice through a center, between ends (2, 2), mm."""
    i, j = slice_.across, slice_.up
    points = np.tile(center, (pixels, pixels, 1))
    across, up = (np.linspace(low, high, pixels) for low, high in ends)
    points[..., i], points[..., j] = np.meshgrid(across, up)
    return points


def _pool_center(anatomy: Anatomy) -> Array:
    """Center of the blood pool below the base, (3,) mm, heart's frame."""
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


def line_colors(anatomy: Anatomy) -> dict[str, str]:
    """Name what the lines of a slice are, and their colors.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    """
    named = {
        SURFACE_NAMES[name]: color for name, color in SURFACES.items() if name in anatomy.surfaces
    }
    return {**named, "end of the mesh at the base": BASE}


def _key(anatomy: Anatomy) -> list[Patch | Line2D]:
    """What the colors mean."""
    named = line_colors(anatomy)
    lines = [Line2D([], [], color=c, linewidth=LINE, label=name) for name, c in named.items()]
    axis = Line2D([], [], color=AXIS, linestyle=DASHES, label="long axis")
    return [Patch(color=MYOCARDIUM, label="mask"), *lines, axis]
