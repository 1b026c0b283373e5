"""A gray image in a slice, to be seen behind the contours of a mesh."""

from __future__ import annotations

import numpy as np
import scipy.ndimage as ndi
from matplotlib.axes import Axes
from numpy.typing import NDArray

from heartgen.images.volume import Volume

Array = NDArray[np.float64]

GRAYS = (1.0, 99.0)
"""Percentiles of an image that are black and white."""


def draw_gray(
    axes: Axes, image: Volume, world: Array, extent: tuple[float, float, float, float]
) -> None:
    """Draw an image where a slice cuts it, as far as it reaches.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Drawn into.
    image : Volume
        Of one frame.
    world : (n, m, 3) float64
        Points of the slice, rows from below, mm, world (LPS).
    extent : (float, float, float, float)
        Its ends to the right and upwards in the axes.
    """
    inverse = np.linalg.inv(image.affine)
    index = world.reshape(-1, 3) @ inverse[:3, :3].T + inverse[:3, 3]
    values = ndi.map_coordinates(image.values.astype(np.float32), index.T, order=1, cval=np.nan)
    low, high = np.percentile(image.values, GRAYS)
    axes.imshow(
        values.reshape(world.shape[:2]),
        cmap="gray",
        extent=extent,
        origin="lower",
        vmin=low,
        vmax=high if high > low else low + 1,
    )
