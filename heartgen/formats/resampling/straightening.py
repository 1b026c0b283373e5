"""Quadratic cells that fold made straighter, until they do not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from heartgen.formats.resampling.jacobians import least_determinants
from heartgen.formats.resampling.kinds import HEX8, TET4, WEDGE6, CellKind

STEPS = 8
"""Times that nodes inside go half of the way, and then again those on surfaces."""

LINEAR = {8: HEX8, 6: WEDGE6, 4: TET4}
"""Linear cells by their number of vertices."""


def straightened(
    points: NDArray[np.float64],
    cells: Sequence[tuple[CellKind, NDArray[np.intp]]],
    on_surface: NDArray[np.bool_],
) -> NDArray[np.float64]:
    """Move nodes between vertices towards the straight cell, where cells fold.

    Parameters
    ----------
    points : (p, 3) float64
        mm.
    cells : sequence of (CellKind, (m, n) int)
        Quadratic cells and their nodes.
    on_surface : (p,) bool
        Points that leave their place only if that of the others does not help.

    Returns
    -------
    (p, 3) float64
        Vertices are where they were. Cells may still fold if their straight ones do.
    """
    straight = points.copy()
    for kind, nodes in cells:
        weights = LINEAR[kind.vertices].shape(kind.reference)
        straight[nodes] = np.einsum("nv,mvx->mnx", weights, points[nodes[:, : kind.vertices]])
    bent, out = np.ones(len(points)), points
    suspects, moved = list(cells), np.zeros(0, dtype=np.intp)
    for step in range(2 * STEPS):
        folded = [
            nodes[least_determinants(kind, out[nodes]) <= 0, kind.vertices :]
            for kind, nodes in suspects
        ]
        moving = np.unique(np.concatenate([nodes.ravel() for nodes in folded]))
        if not len(moving):
            break
        if step < STEPS:
            moving = moving[~on_surface[moving]]
        bent[moving] = 0 if step % STEPS == STEPS - 1 else bent[moving] / 2
        out = straight + bent[:, None] * (points - straight)
        moved = np.unique(np.concatenate([moved, *(nodes.ravel() for nodes in folded)]))
        suspects = [(kind, nodes[np.isin(nodes, moved).any(1)]) for kind, nodes in cells]
    return out
