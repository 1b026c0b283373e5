"""Cubic Hermite topology of both ventricles: a cup whose wall opens into the right ventricle.

The wall has an inner and an outer block of element layers. Over a rectangle of columns and rows,
open at the base, the interface between the blocks is doubled: the inner block becomes the septum,
the outer block the free wall of the right ventricle, and the cavity between them its cavity (Lamata
et al. 2014, figure 2). On the border of the rectangle, the insertion line, position and the
derivative along the line are shared; only the derivative across it has a version of its own in the
free wall, and at the corners only the cross derivative. Everywhere else the mesh is C1.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.connectivity import corner_nodes
from heartgen.mesh.grading import LINEAR, Grading, blending_weights
from heartgen.mesh.hermite import (
    chart_of,
    ends,
    faces_of,
    line_extraction,
    structure,
    tensor_extraction,
)
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.surface_chart import NODE_DOFS, Angles, Apex, SurfaceChart

MIN_LAYERS = 2
"""Septum and free wall."""

MIN_COLUMNS = 3
"""Columns of the right ventricle, and of what remains of the left one: fewer cannot bend."""

VALUE, ALONG_1, ALONG_2, CROSS = range(NODE_DOFS)
"""Degrees of freedom of a surface at a node: value, d/dxi1, d/dxi2, d2/dxi1dxi2."""


@dataclass(frozen=True)
class RvAttachment:
    """The rectangle over which the wall opens into the right ventricle.

    Attributes
    ----------
    columns : int
        Columns 0 to `columns` - 1 of elements open.
    row : int
        First open row; all rows from there to the base are.
    septal_layers : int
        Layers of elements in the inner block.
    """

    columns: int
    row: int
    septal_layers: int


def biventricular_topology(
    shape: tuple[int, int, int],
    opening: RvAttachment,
    grading: Grading = LINEAR,
    angles: Angles | None = None,
    apex: Apex = "collapsed",
) -> Topology:
    """Topology of both ventricles.

    Parameters
    ----------
    shape : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    opening : RvAttachment
        Where the right ventricle is attached.
    grading : Grading
        Of the depth in the straightened wall of the left ventricle.
    angles : Angles, optional
        At which the columns leave a pole.
    apex : {"collapsed", "hole", "patch"}
        A square patch lies with a side below the middle of the opening.

    Returns
    -------
    Topology
        Surfaces ``lv_endo``, ``rv_endo``, ``epi``, ``base``, and ``apex`` around a hole; its
        degrees of freedom that stay free when the wall is straightened are those of the surfaces.

    Raises
    ------
    MeshError
        If a direction has too few elements, or the opening does not fit.
    """
    radial, around, along = shape
    chart = chart_of(apex, around, along, angles, patch_corner(opening, around))
    _check(shape, opening, chart.first_row)
    blocks = _Blocks(shape, opening, chart)
    inner = tensor_extraction(line_extraction(opening.septal_layers), chart.extraction)
    outer = tensor_extraction(line_extraction(radial - opening.septal_layers), chart.extraction)
    index = structure(radial, chart)
    is_open = (index[:, 1] < opening.columns) & (index[:, 2] >= opening.row)
    is_outer = index[:, 0] >= opening.septal_layers
    rows = np.repeat(~is_outer, 64), np.repeat((is_outer & ~is_open)[is_outer], 64)
    beside = sp.diags_array(rows[1].astype(float))
    within = sp.diags_array((~rows[1]).astype(float))
    extraction = sp.csr_array(
        sp.block_array([[inner, None, None], [None, beside @ outer, within @ outer]])
        @ blocks.shared
    )
    element = np.arange(len(index)).reshape(radial, -1)
    rectangle = element[:, is_open[: chart.n_faces]]
    septal = faces_of(rectangle[opening.septal_layers - 1], 5)
    free = faces_of(rectangle[opening.septal_layers], 4)
    return Topology(
        extraction=extraction,
        shape=shape,
        index=index,
        surfaces={
            "lv_endo": faces_of(element[0], 4),
            "rv_endo": np.concatenate([septal, free]),
            "epi": faces_of(element[-1], 5),
            **ends(element, chart, along),
        },
        collapsed=faces_of(element[:, chart.collapsed], 2),
        nodes=corner_nodes(extraction),
        constant=blocks.constant(),
        straightening=blocks.straightening(grading),
        parts={
            "left ventricle": np.flatnonzero(~is_open),
            "septum": np.flatnonzero(is_open & ~is_outer),
            "right ventricle": np.flatnonzero(is_open & is_outer),
        },
        patches={"rv_septum": septal, "rv_free_wall": free},
    )


def patch_corner(opening: RvAttachment, around: int) -> int:
    """Column of a corner of a square patch, one of whose sides lies below the opening.

    Parameters
    ----------
    opening : RvAttachment
        Where the right ventricle is attached.
    around : int
        Elements around.
    """
    return (2 * opening.columns - around // 2) // 4 % around


def right_apex(topology: Topology) -> NDArray[np.intp]:
    """Elements that hold the apex of the right ventricle: those around its lowest row.

    Parameters
    ----------
    topology : Topology
        Of one ventricle or both.

    Returns
    -------
    (k,) int
        Sorted; none where there is no right ventricle.
    """
    if "rv_endo" not in topology.surfaces:
        return np.empty(0, dtype=np.intp)
    around = topology.surfaces["rv_endo"][:, 0]
    row = topology.index[around, 2]
    return np.unique(around[row == row.min()])


def _check(shape: tuple[int, int, int], opening: RvAttachment, first_row: int) -> None:
    """Refuse a mesh too coarse for its right ventricle."""
    radial, around, along = shape
    if (
        radial < MIN_LAYERS
        or not 1 <= opening.septal_layers < radial
        or not MIN_COLUMNS <= opening.columns <= around - MIN_COLUMNS
        or not max(first_row, 1) <= opening.row < along
    ):
        raise MeshError(
            f"elements {radial}x{around}x{along} cannot make two ventricles: use at least "
            f"{MIN_LAYERS} radial, {2 * MIN_COLUMNS} circumferential and "
            f"{max(first_row, 1) + 1} longitudinal elements"
        )


class _Blocks:
    """Degrees of freedom before nodes are shared: surfaces stacked in blocks.

    The blocks are the inner one, the outer one beside the rectangle and the outer one within it.
    Each is ordered (layer, radial derivative, surface degree of freedom).
    """

    def __init__(
        self, shape: tuple[int, int, int], opening: RvAttachment, chart: SurfaceChart
    ) -> None:
        self.radial, self.around, self.along = shape
        self.opening = opening
        self.septal = opening.septal_layers
        self.chart, self.n = chart, chart.n
        sizes = [self.septal + 1, self.radial - self.septal + 1, self.radial - self.septal + 1]
        numbers = np.split(np.arange(2 * self.n * sum(sizes)), 2 * self.n * np.cumsum(sizes)[:-1])
        self.inner, self.beside, self.within = (
            part.reshape(size, 2, self.n) for part, size in zip(numbers, sizes, strict=True)
        )
        nodes = self._open_nodes()
        on_border = np.array([c in (0, opening.columns) or s == opening.row for c, s, _ in nodes])
        dofs = np.array([d for _, _, d in nodes])
        self.border_nodes = [node for node, on in zip(nodes, on_border, strict=True) if on]
        self.border, self.inside = dofs[on_border], dofs[~on_border]
        owner = self._owners()
        self.owner, self.number = np.unique(owner, return_inverse=True)
        used = np.zeros(len(owner), dtype=bool)
        used[self.inner.ravel()] = used[self.beside.ravel()] = True
        used[self.beside[:-1, :, self.inside.ravel()].ravel()] = False
        used[self.beside[-1, 1][self.inside.ravel()]] = False
        used[self.within[:, :, np.r_[self.inside.ravel(), self.border.ravel()]].ravel()] = True
        kept = np.unique(self.number[used])
        rank = np.full(len(self.owner), -1)
        rank[kept] = np.arange(len(kept))
        self.owner, self.number = self.owner[kept], rank[self.number]
        taken = np.flatnonzero(self.number >= 0)
        entries = (np.ones(len(taken)), (taken, self.number[taken]))
        self.shared = sp.csr_array(sp.coo_array(entries, shape=(len(owner), len(kept))))

    def _open_nodes(self) -> list[tuple[int, int, NDArray[np.intp]]]:
        """Column, row and surface degrees of freedom of the nodes of the rectangle."""
        return [
            (c, s, self.chart.node(c, s) + np.arange(NODE_DOFS))
            for s in range(self.opening.row, self.along + 1)
            for c in range(self.opening.columns + 1)
        ]

    def _owners(self) -> NDArray[np.intp]:
        """For each degree of freedom the one that it is the same as."""
        inner, beside, within = self.inner, self.beside, self.within
        owner = np.arange(inner.size + beside.size + within.size)
        apart = np.concatenate([self.border.ravel(), self.inside.ravel()])
        common = np.setdiff1d(np.arange(self.n), apart)
        owner[beside[0][:, common]] = inner[-1][:, common]
        owner[beside[0, 0][self.border]] = inner[-1, 0][self.border]
        last = self.opening.columns
        for c, s, dofs in self.border_nodes:
            corner = c in (0, last) and s == self.opening.row
            line = ALONG_1 if s == self.opening.row else ALONG_2
            kinds = [VALUE, ALONG_1, ALONG_2] if corner else [VALUE, line]
            for layer in range(len(within)):
                owner[within[layer][:, dofs[kinds]]] = owner[beside[layer][:, dofs[kinds]]]
        owner[within[-1, 0]] = owner[beside[-1, 0]]
        return owner

    def constant(self) -> NDArray[np.float64]:
        """Degrees of freedom of the function 1."""
        ones = np.zeros(len(self.number))
        for block in (self.inner, self.beside, self.within):
            ones[block[:, 0][:, self.chart.values]] = 1
        return np.asarray(ones[self.owner])

    def straightening(self, grading: Grading) -> sp.csr_array:
        """Straight across each block, and across the whole wall beside the rectangle."""
        rows: list[NDArray[np.intp]] = []
        columns: list[NDArray[np.intp]] = []
        weights: list[NDArray[np.float64]] = []

        def between(
            block: NDArray[np.intp],
            dofs: NDArray[np.intp],
            ends: tuple[NDArray[np.intp], NDArray[np.intp]],
            xi: NDArray[np.float64],
            grading: Grading,
        ) -> None:
            step = xi[1] - xi[0]
            for target, source, value, slope, whole in blending_weights(
                self.chart, dofs, xi, grading
            ):
                for layer in range(len(block)):
                    for derivative, (a, b) in enumerate(
                        (
                            (whole - value[layer], value[layer]),
                            (-slope[layer] * step, slope[layer] * step),
                        )
                    ):
                        for end, weight in zip(ends, (a, b), strict=True):
                            rows.append(block[layer, derivative][target])
                            columns.append(end[source])
                            weights.append(weight)

        endo, epi = self.inner[0, 0], self.beside[-1, 0]
        septum, free = self.inner[-1, 0], self.within[0, 0]
        apart = np.concatenate([self.border.ravel(), self.inside.ravel()])
        common = np.setdiff1d(np.arange(self.n), apart)
        wall = np.linspace(0, 1, self.radial + 1)
        inner = np.linspace(0, 1, self.septal + 1)
        outer = np.linspace(0, 1, self.radial - self.septal + 1)
        between(self.inner, common, (endo, epi), wall[: self.septal + 1], grading)
        between(self.beside, common, (endo, epi), wall[self.septal :], grading)
        between(self.inner, apart, (endo, septum), inner, LINEAR)
        between(self.beside, self.border.ravel(), (septum, epi), outer, LINEAR)
        between(self.within, apart, (free, epi), outer, LINEAR)
        inside = self.inside.ravel()
        rows.append(epi[inside])
        columns.append(epi[inside])
        weights.append(np.ones(len(inside)))
        entries = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
        size = len(self.number)
        straight = sp.csr_array(sp.coo_array(entries, shape=(size, size)))
        straight.eliminate_zeros()
        return sp.csr_array(straight[self.owner] @ self.shared)
