"""Small parts of which scenes are made: places in the frame of the heart, and colors."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy

Array = NDArray[np.float64]
Data = TypeVar("Data", bound=pv.DataSet)


def placed(data: Data, anatomy: Anatomy) -> Data:
    """Points and normals of world coordinates in the frame of the heart.

    Parameters
    ----------
    data : DataSet
        mm, world (LPS); changed, and returned.
    anatomy : Anatomy
        Tells the frame.
    """
    data.points = anatomy.to_heart(np.asarray(data.points, dtype=float)).astype(np.float32)
    if "Normals" in data.point_data:
        turned = np.asarray(data.point_data["Normals"]) @ anatomy.frame[:3, :3]
        data.point_data["Normals"] = turned.astype(np.float32)
    return data


def opaque(rgb: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Colors (n, 4) with full opacity.

    Parameters
    ----------
    rgb : (n, 3) uint8
        Without.
    """
    return np.concatenate([rgb, np.full((len(rgb), 1), 255, np.uint8)], axis=1)


def rgba(color: str, opacity: Array) -> NDArray[np.uint8]:
    """One color with an opacity of every point.

    Parameters
    ----------
    color : str
        As PyVista takes it.
    opacity : (n,) float64
        From 0 to 1.
    """
    rgba = np.empty((len(opacity), 4), dtype=np.uint8)
    rgba[:, :3] = pv.Color(color).int_rgb
    rgba[:, 3] = np.round(255 * opacity)
    return rgba
