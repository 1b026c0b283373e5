"""Chart of a cup whose apex is a square patch of faces: tangent planes everywhere, no pole.

``around = 4 n`` columns end in a patch of n x n faces, three faces meeting at each of its four
corners. No C1 chart of regular faces can have such a corner: its three tangents would have to
vanish. But it can have one tangent plane there, and everywhere else, if faces are allowed to meet
with a prescribed kink of their parameters: across an edge, the derivatives that leave it on either
side add up to ``k(t)`` times the derivative along it, instead of to zero. With

- ``k`` linear from -1 to 1 along each side of the patch, which is then a C2 cubic spline,
- ``k = -(1 - t)^2`` along the first edge of the column that leaves a corner, which is then
  quadratic,
- the three tangents of a corner adding up to zero,

the conditions are linear in the degrees of freedom and can be solved for some of them, so that the
charts form a linear space. Everywhere else it is C1. Because ``k`` is the same for all members,
functions of the space are C1 functions on each of its surfaces (Groisser & Peters 2015, Matched
G^k-constructions always yield C^k-continuous isogeometric elements; Collin, Sangalli & Takacs 2016,
Analysis-suitable G1 multi-patch parametrizations for C1 isogeometric spaces).
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.surface_chart import (
    NODE_DOFS,
    NONE,
    SurfaceChart,
    extraction_of,
    grid_index,
    node_corners,
    ring_corners,
    rising,
)

Array = NDArray[np.float64]

SIDES = 4

CORNER_DOFS = 2
"""Degrees of freedom of a corner: position, and mean of the two derivatives around."""

SIDE_DOFS = 3
"""Of a node on a side: position, and of the ring the derivative along and the cross derivative."""


def patch_chart(around: int, along: int, corner: int = 0) -> SurfaceChart:
    """Chart that closes in a square patch.

    Parameters
    ----------
    around : int
        Columns, four times the number of faces of the patch in a row.
    along : int
        Rows, of which the patch counts as one.
    corner : int
        Column of a corner of the patch.

    Returns
    -------
    SurfaceChart
        Its degrees of freedom: corners, sides, inside of the patch, then the regular rows.

    Raises
    ------
    MeshError
        If there is no such patch.
    """
    if around % SIDES or along < 2:
        raise MeshError(
            f"{around} elements around and {along} along cannot end in a square patch: use a "
            "multiple of 4 around, of which a quarter lie along each side of the patch, and at "
            "least 2 along"
        )
    side = around // SIDES
    rim = _Rim(side, corner)
    rows = sp.eye_array(NODE_DOFS * around * (along - 1), format="csr")
    # Parameters: ring seen from the right and from the left of each node, patch, regular rows.
    local = np.concatenate([rim.right, rim.left, rim.patch]).reshape(-1, rim.size)
    apex_dofs = rim.size - NODE_DOFS * around
    n = apex_dofs + rows.shape[1]
    parameters = sp.vstack(
        [
            sp.csr_array(np.pad(local, ((0, 0), (0, n - rim.size)))),
            sp.hstack([sp.csr_array((rows.shape[0], apex_dofs)), rows]),
        ]
    )
    ring = grid_index(around, range(1, along))
    above_patch = np.stack([ring[:, 0], ring[:, 1] - 1], -1)
    # Rows of nodes as they stand among the parameters: row 1 twice, the patch, row 2 and above.
    above = 2 * around + (side + 1) ** 2
    corners = ring_corners(above_patch, around)
    first = ring[:, 1] == 1
    corners[:, 1] += NODE_DOFS * (above - around)
    corners[~first, 0] += NODE_DOFS * (above - around)
    corners[first, 0, 1] += NODE_DOFS * around
    place = 2 * around + np.arange((side + 1) ** 2).reshape(side + 1, side + 1)
    j, i = (g.ravel() for g in np.meshgrid(np.arange(side), np.arange(side), indexing="ij"))
    ends = np.arange(2)
    inner = place[j[:, None, None] + ends[:, None], i[:, None, None] + ends]
    inner = NODE_DOFS * inner[..., None] + np.arange(NODE_DOFS)
    node = _patch_nodes(side, corner)
    numbers = np.arange(around * along).reshape(along, around)
    numbers[1:] += (side - 1) ** 2
    on_patch = np.stack([node[j, i], node[j, i + 1], node[j + 1, i], node[j + 1, i + 1]], -1)
    on_rim = CORNER_DOFS * SIDES + SIDE_DOFS * (around - SIDES)
    inside = np.arange(on_rim, n, NODE_DOFS)
    return SurfaceChart(
        extraction=extraction_of(parameters, np.concatenate([inner, corners])),
        index=np.concatenate([np.stack([j * side + i, 0 * i], -1), ring]),
        nodes=np.concatenate([on_patch, node_corners(above_patch, numbers)]),
        values=np.concatenate([rim.values, inside]),
        rows=np.concatenate(
            [
                np.ones(on_rim, dtype=np.intp),
                np.zeros(apex_dofs - on_rim, dtype=np.intp),
                np.repeat(np.arange(2, along + 1), NODE_DOFS * around),
            ]
        ),
        rising=np.concatenate([rim.rising, rising(np.arange(apex_dofs, n))]),
        around=around,
        first_row=2,
        apex_dofs=apex_dofs,
        collapsed=NONE,
        rim=NONE,
    )


class _Rim:
    """Parameters around the border of the patch, from the degrees of freedom up to row 2.

    Attributes
    ----------
    size : int
        Those degrees of freedom.
    values : (around,) int
        Which of them are positions of corners and sides.
    rising : (m, 2) int
        Which are derivatives by xi2, and of what.
    right, left : (around, 4, size) float64
        Parameters of row 1 in the elements of the ring to the right and left of each column.
    patch : ((side + 1)^2, 4, size) float64
        Parameters of the patch's nodes, by its own xi1, fastest, and xi2.
    """

    def __init__(self, side: int, corner: int) -> None:
        around = SIDES * side
        inside = CORNER_DOFS * SIDES + SIDE_DOFS * (around - SIDES)
        row_2 = inside + NODE_DOFS * (side - 1) ** 2
        self.size = row_2 + NODE_DOFS * around
        unit = np.eye(self.size)
        starts = side * np.arange(SIDES)
        sides = np.setdiff1d(np.arange(around), starts)
        # Columns are counted from the corner here, and turned to their places at the end.
        first = np.zeros(around, dtype=np.intp)
        first[starts] = CORNER_DOFS * np.arange(SIDES)
        first[sides] = CORNER_DOFS * SIDES + SIDE_DOFS * np.arange(len(sides))
        self.values = first
        self.rising = np.stack([first[sides] + 1, first[sides]], -1)
        place = unit[first]
        above = unit[row_2 + NODE_DOFS * ((starts + corner) % around)]
        rising = unit[row_2 + NODE_DOFS * ((starts + corner) % around) + 2]
        up = 2 * (above - place[starts]) - rising  # the first edge is quadratic
        mean = unit[first[starts] + 1]
        ahead, back = mean - up / 2, -mean - up / 2  # leave the corner along the two sides
        right = np.zeros((around, NODE_DOFS, self.size))
        inward = np.zeros((around, 2, self.size))
        right[sides, 2], right[sides, 3] = unit[first[sides] + 1], unit[first[sides] + 2]
        kink = np.zeros((SIDES, side + 1, 2, self.size))
        for k in range(SIDES):
            nodes = (starts[k] + np.arange(side + 1)) % around
            slope, kink[k] = _side(place[nodes], ahead[k], -back[(k + 1) % SIDES])
            right[nodes[:-1], 1] = slope[:-1]
            inward[nodes[1:-1]] = kink[k, 1:-1] - right[nodes[1:-1], 2:]
        right[:, 0] = place
        left = right.copy()
        # Cross derivatives at a corner: each pair of neighbors has a known sum.
        to_ahead, to_back = kink[:, 0, 1], -np.roll(kink[:, -1, 1], 1, axis=0)
        to_up = 4 * up - 2 * (above - place[starts])
        inward[starts] = np.stack([back, (to_ahead + to_back - to_up) / 2], 1)
        right[starts, 2] = left[starts, 2] = up
        left[starts, 1] = -back
        right[starts, 3] = (to_ahead + to_up - to_back) / 2
        left[starts, 3] = -(to_back + to_up - to_ahead) / 2
        self.right, self.left = np.roll(right, corner, axis=0), np.roll(left, corner, axis=0)
        self.patch = _on_patch(side, right[:, :2], inward, unit[inside:row_2])


def _side(place: Array, start: Array, end: Array) -> tuple[Array, Array]:
    """Slopes (s + 1, n) of the C2 spline through nodes (s + 1, n), and what follows from them.

    Also (s + 1, 2, n): the sum of the derivatives that leave it on either side, ``k`` times the
    slope, and the derivative of that along the side.
    """
    count = len(place) - 1
    slope = np.zeros_like(place)
    slope[0], slope[-1] = start, end
    if count > 1:
        right = 3 * (place[2:] - place[:-2])
        right[0] -= start
        right[-1] -= end
        inner = count - 1
        matrix = 4 * np.eye(inner) + np.eye(inner, k=1) + np.eye(inner, k=-1)
        slope[1:-1] = np.linalg.solve(matrix, right)
    step = np.diff(place, axis=0)
    bend = 6 * step - 4 * slope[:-1] - 2 * slope[1:]
    last = -6 * step[-1] + 2 * slope[-2] + 4 * slope[-1]
    bend = np.concatenate([bend, last[None]])
    k = (2 * np.arange(count + 1) / count - 1)[:, None]
    return slope, np.stack([k * slope, 2 / count * slope + k * bend], 1)


def _on_patch(side: int, along: Array, inward: Array, inside: Array) -> Array:
    """Parameters ((side + 1)^2, 4, n) of the patch's nodes in its own directions.

    From position and slope (around, 2, n) along the sides, derivative inward and its derivative
    along the sides (around, 2, n), and the degrees of freedom of the inner nodes (4 m, n).
    """
    out = np.zeros((side + 1, side + 1, NODE_DOFS, along.shape[-1]))
    out[1:-1, 1:-1] = inside.reshape(side - 1, side - 1, NODE_DOFS, along.shape[-1])
    for column, (j, i) in enumerate(_border(side)):
        (value, slope), (derivative, cross) = along[column], inward[column]
        which = column // side
        # The sides run along xi1, against xi2, against xi1 and along xi2.
        one, two = (
            (slope, -derivative),
            (-derivative, -slope),
            (-slope, derivative),
            (derivative, slope),
        )[which]
        out[j, i] = np.stack([value, one, two, (-cross, cross)[which % 2]])
    return out.reshape(-1, NODE_DOFS, along.shape[-1])


def _border(side: int) -> list[tuple[int, int]]:
    """Place (xi2, xi1) in the patch of the columns, counted from the corner."""
    run = range(side)
    return [
        *((side, t) for t in run),
        *((side - t, side) for t in run),
        *((0, side - t) for t in run),
        *((t, 0) for t in run),
    ]


def _patch_nodes(side: int, corner: int) -> NDArray[np.intp]:
    """Number (side + 1, side + 1) of the patch's nodes: the columns of row 1, then the inside."""
    around = SIDES * side
    out = np.zeros((side + 1, side + 1), dtype=np.intp)
    out[1:-1, 1:-1] = around + np.arange((side - 1) ** 2).reshape(side - 1, side - 1)
    for column, (j, i) in enumerate(_border(side)):
        out[j, i] = (column + corner) % around
    return out
