"""Two results of one heart against each other: distance of their surfaces, and their figures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh import HexMesh
from heartgen.mesh.closest import closest_points
from heartgen.viewing.polydata import mesh_surface
from heartgen.viewing.scene import NICE_LIMITS, Scale

if TYPE_CHECKING:
    from heartgen.report import Report

COVERED = 98.0
"""Percentile of the distances that the scale holds."""

Row = tuple[str, str, str, str]
"""What, of one result, of the other, and the difference."""


def signed_distances(mesh: HexMesh, other: HexMesh) -> NDArray[np.float64]:
    """Distance of the surface of a mesh from that of another, (n,) mm.

    Parameters
    ----------
    mesh, other : HexMesh
        mm, world (LPS).

    Returns
    -------
    (n,) float64, mm
        At the points of `heartgen.viewing.polydata.mesh_surface`: positive where the mesh reaches
        beyond the wall of the other, negative where it stays within.
    """
    surface = mesh_surface(mesh)
    points = np.asarray(surface.points, dtype=float)
    found = closest_points(other, other.topology.external, points)
    normals = np.asarray(surface.point_data["Normals"], dtype=float)
    outside = np.einsum("nx,nx->n", points - found.points, normals)
    return np.asarray(np.where(outside < 0, -found.distance, found.distance))


def difference_scale(distances: NDArray[np.float64]) -> Scale:
    """A scale around no difference.

    Parameters
    ----------
    distances : (n,) float64
        As of `signed_distances`, mm.
    """
    most = float(np.percentile(np.abs(distances), COVERED))
    end = next((limit for limit in NICE_LIMITS if limit >= most), NICE_LIMITS[-1])
    return Scale("beyond (+) or within (−) the other mesh (mm)", "RdBu_r", (-end, end))


def difference_rows(one: Report, other: Report) -> tuple[Row, ...]:
    """The figures of two results, and what one has more than the other.

    Parameters
    ----------
    one, other : Report
        Of two results.
    """
    both = (one, other)
    rows = [
        _row("error, mean (mm)", [r.accuracy.mean for r in both], 3),
        _row("error, 95 % below (mm)", [r.accuracy.p95 for r in both], 3),
        _row("overlap (Dice)", [r.accuracy.dice for r in both], 3),
        _row("quality Q, mean", [r.quality.mean for r in both], 3),
        _row("quality Q, least", [r.quality.min for r in both], 3),
        _row("wriggle around, median (°)", [r.fairness.circumferential_median for r in both], 1),
        _row("wriggle along, median (°)", [r.fairness.longitudinal_median for r in both], 1),
        _row("left cavity (ml)", [r.indices.lv_cavity_volume for r in both], 1),
        _row("myocardium (ml)", [r.indices.myocardial_volume for r in both], 1),
        _row("time (s)", [sum(r.seconds.values()) for r in both], 1),
    ]
    return tuple(rows)


def _row(name: str, values: list[float], digits: int) -> Row:
    """Both values, and the first less the second."""
    one, other = values
    return name, f"{one:.{digits}f}", f"{other:.{digits}f}", f"{one - other:+.{digits}f}"
