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
    return framed(data, anatomy.frame)


def framed(data: Data, frame: Array) -> Data:
    """Points and normals of world coordinates in a frame.

    Parameters
    ----------
    data : DataSet
        mm, world (LPS); changed, and returned, its normals as ``"Normals"``.
    frame : (4, 4) float64
        To the world, mm.
    """
    if data.n_points == 0:
        return data
    data.points = ((np.asarray(data.points, float) - frame[:3, 3]) @ frame[:3, :3]).astype("f4")
    normals = data.point_data.active_normals
    if normals is not None:
        data.point_data["Normals"] = (np.asarray(normals) @ frame[:3, :3]).astype(np.float32)
        data.point_data.active_normals_name = "Normals"
    return data


def joined(one: pv.PolyData, other: pv.PolyData) -> pv.PolyData:
    """Two pieces in one, with the arrays of the first; nan where the second has none.

    Parameters
    ----------
    one, other : PolyData
        mm, heart frame.
    """
    if other.n_points == 0:
        return one
    for name in one.point_data:
        if name not in other.point_data:
            other.point_data[name] = np.full(other.n_points, np.nan, np.float32)
    both: pv.PolyData = one.append_polydata(other)
    return both


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
