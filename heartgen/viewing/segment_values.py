"""What a fitted mesh is like in each of the 17 segments: wall thickness, error and wriggle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from heartgen.fairness import mesh_lines
from heartgen.fields import clinical_indices, heart_axes
from heartgen.fields.axes import HeartAxes
from heartgen.fields.segments import NO_SEGMENT, SEGMENTS, aha_segment, segments_of_elements
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.surface_faces import evaluate_faces
from heartgen.viewing.bullseye import Bullseye
from heartgen.viewing.polydata import to_mask

if TYPE_CHECKING:
    from heartgen.result import Personalization

POINTS = 4
"""Per face and direction, at which the error is taken."""


def result_bullseyes(result: Personalization) -> tuple[Bullseye, ...]:
    """Wall thickness, error and wriggle by segment of the left ventricle.

    Parameters
    ----------
    result : Personalization
        A fitted mesh and its report.

    Returns
    -------
    tuple of Bullseye
        The error is the mean distance from the surfaces of the mesh to the mask; the wriggle that
        of lines of the mesh, shared among their edges as these turn, a mean over the edges of a
        segment.
    """
    mesh, direction = result.mesh, result.options.septal_direction
    axes = heart_axes(mesh, direction)
    segment = segments_of_elements(mesh, axes)
    thickness = clinical_indices(mesh, septal_direction=direction).wall_thickness
    return (
        _scaled("thickness", "wall thickness (mm)", thickness, 1),
        _scaled("error", "error (mm)", _error(result, segment != NO_SEGMENT, axes), 2),
        _scaled("wriggle", "wriggle of an element edge (°)", _wriggle(result, segment), 1),
    )


def _error(result: Personalization, left: NDArray[np.bool_], axes: HeartAxes) -> dict[int, float]:
    """Mean distance of the surfaces of the left ventricle's wall to the mask, mm."""
    mesh = result.mesh
    surfaces = mesh.topology.surfaces
    faces = np.concatenate([part for name, part in surfaces.items() if name != "base"])
    faces = faces[left[faces[:, 0]]]
    uv, weights = gauss_square(POINTS)
    points, area = evaluate_faces(mesh, faces, uv)
    size = (np.linalg.norm(area, axis=-1) * weights).ravel()
    points = points.reshape(-1, 3)
    distance = to_mask(points, result.anatomy.myocardium)
    return _means(aha_segment(points, axes), distance * size, size)


def _wriggle(result: Personalization, segment: NDArray[np.intp]) -> dict[int, float]:
    """Turning that is taken back, degrees for each edge."""
    lines = mesh_lines(result.mesh)
    whole = np.bincount(lines.line, lines.turning, minlength=lines.n_lines)
    share = lines.turning / np.maximum(whole[lines.line], np.finfo(float).tiny)
    values = lines.wriggle[lines.line] * share
    return _means(segment[lines.edges[:, 0]], values, np.ones(len(values)))


def _means(
    segment: NDArray[np.intp], values: NDArray[np.float64], weights: NDArray[np.float64]
) -> dict[int, float]:
    """Sum of values over that of weights, by segment."""
    most = max(SEGMENTS) + 1
    above, below = (np.bincount(segment, each, minlength=most) for each in (values, weights))
    return {s: float(above[s] / below[s]) for s in SEGMENTS if below[s] > 0}


def _scaled(key: str, title: str, values: dict[int, float], digits: int) -> Bullseye:
    """Values on a scale of whole steps that holds them."""
    step = 10.0 ** (1 - digits)
    low, high = min(values.values()), max(values.values())
    ends = step * np.floor(low / step), step * np.ceil(high / step)
    return Bullseye(key, title, values, (float(ends[0]), float(ends[1])), digits=digits)
