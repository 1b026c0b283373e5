"""A mesh where slices cut it: its walls, the elements in them, and how far it is from the mask."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pyvista as pv
from numpy.typing import NDArray

from heartgen.viewing.fit_lines import NOTHING, FitSection
from heartgen.viewing.inside import inner_grid
from heartgen.viewing.polydata import element_faces, mesh_surface, to_mask
from heartgen.viewing.slice_views import Slice, SliceView
from heartgen.viewing.stages import STAGES, registered

if TYPE_CHECKING:
    from heartgen.result import Personalization

Array = NDArray[np.float64]


class SliceFit:
    """A mesh to be cut by slices.

    Parameters
    ----------
    result : Personalization
        Whose mesh it is.
    stage : str
        Key of `heartgen.viewing.stages.STAGES`.
    """

    def __init__(self, result: Personalization, stage: str = "optimized") -> None:
        known = next(each for each in STAGES if each.key == stage)
        mesh = known.mesh(result)
        self._faces = element_faces(mesh)
        self._surface = mesh_surface(mesh)
        self._inside = inner_grid(mesh)
        if known.registered:
            for data in (self._faces, self._surface, self._inside):
                data.points = registered(np.asarray(data.points), result).astype(np.float32)
        error = to_mask(self._surface.points, result.anatomy.myocardium)
        self._surface.point_data["error"] = error

    def section(self, view: SliceView, slice_: Slice, position: float) -> FitSection:
        """Cut it.

        Parameters
        ----------
        view : SliceView
            Tells the frame of the slices.
        slice_ : Slice
            Along which axes.
        position : float
            Along the axis across the slice, mm, frame of the view.
        """
        across = 3 - slice_.across - slice_.up
        turn, shift = view.frame[:3, :3], view.frame[:3, 3]
        normal = turn[:, across]
        origin = normal * position + shift

        def flat(cut: pv.PolyData) -> Array:
            points = (np.asarray(cut.points, dtype=float).reshape(-1, 3) - shift) @ turn
            return points[:, [slice_.across, slice_.up]]

        surface = self._surface.slice(normal=normal, origin=origin)
        if surface.n_cells == 0:  # it passes the mesh by
            return NOTHING
        faces = self._faces.slice(normal=normal, origin=origin)
        wall = self._inside.slice(normal=normal, origin=origin).triangulate()
        pairs = _pairs(surface)
        return FitSection(
            edges=flat(faces)[_pairs(faces)],
            outline=flat(surface)[pairs],
            error=np.asarray(surface.point_data["error"])[pairs].mean(1),
            triangles=flat(wall)[wall.regular_faces],
            element=np.asarray(wall.cell_data["element"]),
        )


def _pairs(cut: pv.PolyData) -> NDArray[np.intp]:
    """Ends (n, 2) of the lines of a surface that was cut."""
    return np.asarray(cut.lines).reshape(-1, 3)[:, 1:]
