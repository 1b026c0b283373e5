"""Lines of a local coordinate that run on through neighboring elements, and lengths along them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import ORDER, lattice, tabulate
from heartgen.mesh.hexmesh import HexMesh, Topology
from heartgen.mesh.quadrature import gauss

Array = NDArray[np.float64]

NONE = -1
"""In place of a neighbor where there is none."""

GAUSS = 4
"""Points on each third of a line: lengths of straight lines are exact, others to rounding."""


Mask = NDArray[np.bool_]


def length_share(mesh: HexMesh, axis: int, among: Mask | None = None) -> Array:
    """Share of the length of its line at which each point lies.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    axis : {0, 1, 2}
        Local direction along which lines run, on through the next elements as long as there are.
    among : (e,) bool, optional
        Elements to which lines keep; the others get 0.

    Returns
    -------
    (e, 64) float64
        At the Lagrange nodes of each element, xi1 fastest; 0 where the line starts and 1 where it
        ends.
    """
    within = np.moveaxis(lengths(mesh, axis).reshape(-1, ORDER, ORDER, ORDER), 3 - axis, -1)
    start = np.zeros(within.shape[:-1])
    total = np.full_like(start, np.inf)
    for line in lines(mesh.topology, axis, among):
        each = within[line, ..., -1]
        start[line] = np.cumsum(each, axis=0) - each
        total[line] = each.sum(0)
    share = (start[..., None] + within) / total[..., None]
    return np.asarray(np.moveaxis(share, -1, 3 - axis).reshape(-1, ORDER**3))


def lines(topology: Topology, axis: int, among: Mask | None = None) -> list[NDArray[np.intp]]:
    """Runs of elements along a local direction, each from where it starts to where it ends.

    Parameters
    ----------
    topology : Topology
        Of the mesh.
    axis : {0, 1, 2}
        The local direction.
    among : (e,) bool, optional
        Elements to which lines keep.

    Returns
    -------
    list of (n,) int
        Runs that close on themselves, such as rings, are left out.
    """
    onward = _next(topology, axis)
    elements = np.arange(topology.n_elements)
    if among is not None:
        elements = elements[among]
        onward = np.where(among & among[onward], onward, NONE)
    starts = np.setdiff1d(elements, onward)
    out = []
    for element in starts:
        run = [int(element)]
        while onward[run[-1]] != NONE:
            run.append(int(onward[run[-1]]))
        out.append(np.array(run))
    return out


def _next(topology: Topology, axis: int) -> NDArray[np.intp]:
    """Element (e,) that continues each one along a local direction, or `NONE`."""
    ends = _corners(topology, 2 * axis), _corners(topology, 2 * axis + 1)
    outside = {tuple(face) for face in topology.external.tolist()}
    first = {
        tuple(nodes): e for e, nodes in enumerate(ends[0].tolist()) if (e, 2 * axis) not in outside
    }
    return np.array(
        [
            NONE if (e, 2 * axis + 1) in outside else first.get(tuple(nodes), NONE)
            for e, nodes in enumerate(ends[1].tolist())
        ]
    )


def _corners(topology: Topology, face: int) -> NDArray[np.intp]:
    """Corner nodes (e, 4) of one face of each element, ascending."""
    axis, end = divmod(face, 2)
    cube = topology.nodes.reshape(-1, 2, 2, 2)
    return np.sort(np.take(cube, end, axis=3 - axis).reshape(-1, 4), axis=1)


def lengths(mesh: HexMesh, axis: int) -> Array:
    """Length (e, 64), mm, along a local direction from the element's end to each lattice point.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    axis : {0, 1, 2}
        The local direction.
    """
    t, weights = gauss(GAUSS)
    third = 1 / (ORDER - 1)
    cross = lattice().reshape(ORDER, ORDER, ORDER, 3).take(0, axis=2 - axis).reshape(-1, 3)
    derivative = tuple(int(a == axis) for a in range(3))
    pieces = []
    for piece in range(ORDER - 1):
        xi = np.repeat(cross[:, None], GAUSS, axis=1)
        xi[..., axis] = third * (piece + t)
        slope = np.matmul(tabulate(xi.reshape(-1, 3), derivative), mesh.control)  # type: ignore[arg-type]
        speed = np.linalg.norm(slope, axis=-1).reshape(mesh.n_elements, -1, GAUSS)
        pieces.append(third * speed @ weights)
    length = np.cumsum(np.stack([np.zeros_like(pieces[0]), *pieces], -1), axis=-1)
    cube = length.reshape(mesh.n_elements, ORDER, ORDER, ORDER)  # two crossing directions, axis
    return np.asarray(np.moveaxis(cube, -1, 3 - axis).reshape(mesh.n_elements, -1))
