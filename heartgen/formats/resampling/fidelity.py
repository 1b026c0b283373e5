"""What resampling costs: the distance from the exact surface, and how good the cells are."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.formats.resampling.jacobians import (
    least_determinants,
    scaled_jacobian,
    volumes,
)
from heartgen.formats.resampling.kinds import CellKind
from heartgen.formats.resampling.resample import Cells, Resampled
from heartgen.mesh.closest import closest_points
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.jacobian import volume

SAMPLES = 5
"""Samples of a face in each direction, its edges included."""


@dataclass(frozen=True)
class Fidelity:
    """How close a resampled mesh is to the exact one, and how good its cells are.

    Attributes
    ----------
    mean, max : float
        Distance from its named surfaces to those of the mesh, mm; the mean is over the area.
    volume : float
        Volume over that of the mesh.
    quality_mean, quality_min : float
        Scaled Jacobian of the cells, 1 for a regular one: the least at the vertices of each.
    counts : tuple of (str, int)
        Kinds of cells and how many there are.
    """

    mean: float
    max: float
    volume: float
    quality_mean: float
    quality_min: float
    counts: tuple[tuple[str, int], ...]

    def __str__(self) -> str:
        counts = " and ".join(f"{n} {kind}" for kind, n in self.counts)
        return (
            f"resampled to {counts}: {self.mean:.3f} mm from the exact surface on average and "
            f"{self.max:.3f} mm at most, volume {100 * (self.volume - 1):+.2f} %, scaled Jacobian "
            f"{self.quality_mean:.2f} on average and {self.quality_min:.2f} at least"
        )


def fidelity(mesh: HexMesh, cells: Resampled) -> Fidelity:
    """Compare a resampled mesh with the one it is made from.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    cells : Resampled
        Of that mesh.

    Returns
    -------
    Fidelity

    Raises
    ------
    MeshError
        If cells fold: if their Jacobian determinant is not positive at all nodes and Gauss points.
    """
    blocks = [(block.kind, cells.points[block.nodes]) for block in cells.cells]
    folded = sum(np.count_nonzero(least_determinants(*block) <= 0) for block in blocks)
    if folded:
        kinds = " and ".join(block.kind.name for block in cells.cells)
        raise MeshError(
            f"{folded} of {cells.n_cells} cells ({kinds}) would fold: choose more pieces of an "
            "element, other cells, or an exact format"
        )
    quality = np.concatenate([scaled_jacobian(*block) for block in blocks])
    mean, largest = surface_distance(mesh, cells)
    return Fidelity(
        mean=mean,
        max=largest,
        volume=float(sum(volumes(*block).sum() for block in blocks)) / volume(mesh),
        quality_mean=float(quality.mean()),
        quality_min=float(quality.min()),
        counts=tuple((block.kind.name, len(block.nodes)) for block in cells.cells),
    )


def surface_distance(mesh: HexMesh, cells: Resampled) -> tuple[float, float]:
    """Mean over the area and maximum, mm, of the distance from named surfaces to the exact ones.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    cells : Resampled
        Made from the mesh.
    """
    distance, area = (np.concatenate(part) for part in zip(*_distances(mesh, cells), strict=True))
    return float(np.average(distance, weights=area)), float(distance.max())


def _distances(
    mesh: HexMesh, cells: Resampled
) -> list[tuple[NDArray[np.float64], NDArray[np.float64]]]:
    """Distances of samples to the exact surface of the same name, and the area of each."""
    out, start = [], 0
    for block in cells.cells:
        for number, face in enumerate(block.kind.faces):
            xi, tangents, weights = _face_samples(block.kind, face)
            for name, members in cells.surfaces.items():
                on = members[members[:, 1] == number, 0] - start
                on = on[(on >= 0) & (on < len(block.nodes))]
                if len(on):
                    points, area = _evaluate(block, cells.points, on, xi, tangents)
                    exact = closest_points(mesh, mesh.topology.surfaces[name], points)
                    out.append((exact.distance, (area * weights).ravel()))
        start += len(block.nodes)
    return out


def _face_samples(
    kind: CellKind, face: tuple[int, ...]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Samples of a reference face (q, 3), its tangents there (q, 3, 2), and their weights (q,)."""
    corner = kind.reference[[n for n in face if n < kind.vertices]]
    t = np.linspace(0, 1, SAMPLES)
    w = np.full(SAMPLES, 1 / (SAMPLES - 1))
    w[[0, -1]] /= 2
    v, u = (a.ravel()[:, None] for a in np.meshgrid(t, t, indexing="ij"))
    if len(corner) == 3:  # one edge of the square collapses
        corner = corner[[0, 1, 2, 2]]
    a, b, c, d = corner
    xi = (1 - u) * (1 - v) * a + u * (1 - v) * b + u * v * c + (1 - u) * v * d
    tangents = np.stack([(1 - v) * (b - a) + v * (c - d), (1 - u) * (d - a) + u * (c - b)], -1)
    return xi, tangents, np.outer(w, w).ravel()


def _evaluate(
    block: Cells,
    points: NDArray[np.float64],
    of: NDArray[np.intp],
    xi: NDArray[np.float64],
    tangents: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Places (m q, 3) of samples of the cells `of`, and their area per parameter (m, q)."""
    nodes = points[block.nodes[of]]
    slopes = np.einsum("qnd,mnx,qdt->mqxt", block.kind.gradient(xi), nodes, tangents)
    places = np.einsum("qn,mnx->mqx", block.kind.shape(xi), nodes)
    area = np.linalg.norm(np.cross(slopes[..., 0], slopes[..., 1]), axis=-1)
    return places.reshape(-1, 3), area
