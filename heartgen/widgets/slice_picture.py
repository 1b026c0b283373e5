"""A slice that is pointed at: a click moves the others, the element under the pointer is told."""

from __future__ import annotations

import anywidget
import numpy as np
from numpy.typing import NDArray
from traitlets import Bytes, List, Unicode

from heartgen.widgets.transfer import WEB


class SlicePicture(anywidget.AnyWidget):
    """A slice through a heart.

    Attributes
    ----------
    picture : bytes
        PNG, square.
    about : str
        What it shows, for those who do not see it.
    extent : list of float
        Its ends to the right and upwards, mm: low, high, low, high.
    cross : list of float
        Where the other slices cross it, mm; empty if it is not known.
    triangles, element : bytes
        Corners (t, 3, 2) float32 that fill the wall of a mesh, mm, and the element of each, uint32.
    outline, error : bytes
        Ends (m, 2, 2) float32 of the pieces of its surface, mm, and the distance of each to the
        mask, float32, mm.
    pointed : list of float
        Where it was clicked, mm.
    """

    _esm = WEB / "slice.js"
    picture = Bytes().tag(sync=True)
    about = Unicode("").tag(sync=True)
    extent: List[float] = List([0.0, 1.0, 0.0, 1.0]).tag(sync=True)
    cross: List[float] = List().tag(sync=True)
    triangles = Bytes().tag(sync=True)
    element = Bytes().tag(sync=True)
    outline = Bytes().tag(sync=True)
    error = Bytes().tag(sync=True)
    pointed: List[float] = List().tag(sync=True)


def packed(values: NDArray[np.generic], kind: type[np.generic] = np.float32) -> bytes:
    """Values as the browser takes them.

    Parameters
    ----------
    values : array
        Of any shape.
    kind : type
        Of the numbers that are sent.
    """
    return values.astype(kind).tobytes()
