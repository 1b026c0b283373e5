"""Cubic Hermite topology of a cup: a smooth wall with one of three kinds of apex.

The degrees of freedom are a tensor product: a radial cubic Hermite line (value and slope at each of
``radial + 1`` layers) times the space of a surface, which knows the apex
(`heartgen.mesh.surface_chart`).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.apical_patch import patch_chart
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN
from heartgen.mesh.grading import LINEAR, Grading, blending_weights
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.surface_chart import Angles, Apex, SurfaceChart, collapsed_chart, open_chart

MIN_CIRCUMFERENTIAL = 3
"""Fewer elements around cannot carry the tangent plane of the pole."""

RIM = "apical_rim"
"""Name of the surface through the wall around an apical hole."""


def cup_topology(
    shape: tuple[int, int, int],
    grading: Grading = LINEAR,
    apex: Apex = "collapsed",
) -> Topology:
    """Topology of a cup.

    Parameters
    ----------
    shape : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    grading : Grading
        Of the depth once the wall is straightened.
    apex : {"collapsed", "hole", "patch"}
        How the cup closes: in a pole, not at all, or in a square patch.

    Returns
    -------
    Topology
        Surfaces ``lv_endo``, ``epi``, ``base``, and ``apex`` around a hole; degrees of freedom
        ordered (layer, radial derivative, surface degree of freedom).

    Raises
    ------
    MeshError
        If a direction has too few elements, or the wrong number for the apex.
    """
    radial, around, along = shape
    if radial < 1 or along < 1 or around < MIN_CIRCUMFERENTIAL:
        raise MeshError(
            f"elements {radial}x{around}x{along} cannot make a ventricle: use at least 1 radial, "
            f"{MIN_CIRCUMFERENTIAL} circumferential and 1 longitudinal element"
        )
    chart = chart_of(apex, around, along)
    ones = np.zeros(chart.n)
    ones[chart.values] = 1
    element = np.arange(radial * chart.n_faces).reshape(radial, -1)
    layer_nodes = int(chart.nodes.max()) + 1
    nodes = [chart.nodes + layer_nodes * layer for layer in range(radial + 1)]
    return Topology(
        extraction=tensor_extraction(line_extraction(radial), chart.extraction),
        shape=shape,
        index=structure(radial, chart),
        surfaces={
            "lv_endo": faces_of(element[0], 4),
            "epi": faces_of(element[-1], 5),
            **ends(element, chart, along),
        },
        collapsed=faces_of(element[:, chart.collapsed], 2),
        nodes=np.concatenate([np.hstack(pair) for pair in pairwise(nodes)]),
        constant=np.tile(np.concatenate([ones, 0 * ones]), radial + 1),
        straightening=_straightening(radial, chart, grading),
    )


def chart_of(
    apex: Apex, around: int, along: int, angles: Angles | None = None, corner: int = 0
) -> SurfaceChart:
    """Space of a surface with an apex of some kind.

    Parameters
    ----------
    apex : {"collapsed", "hole", "patch"}
        In a pole, a hole or a square patch.
    around, along : int
        Faces.
    angles : Angles, optional
        At which the columns leave a pole.
    corner : int
        Column of a corner of a square patch.

    Returns
    -------
    SurfaceChart
    """
    if apex == "patch":
        return patch_chart(around, along, corner)
    return open_chart(around, along) if apex == "hole" else collapsed_chart(around, along, angles)


def structure(layers: int, chart: SurfaceChart) -> NDArray[np.intp]:
    """Place (e, 3) of elements: (radial, circumferential, longitudinal).

    Parameters
    ----------
    layers : int
        Elements across the wall.
    chart : SurfaceChart
        Of the surface.
    """
    layer = np.arange(layers).repeat(chart.n_faces)
    return np.column_stack([layer, np.tile(chart.index, (layers, 1))])


def faces_of(elements: NDArray[np.intp], face: int) -> NDArray[np.intp]:
    """One face of each element, (f, 2): (element, face).

    Parameters
    ----------
    elements : array of int
        Which elements.
    face : int
        Number of the face, 0 to 5.
    """
    return np.stack([elements.ravel(), np.full(elements.size, face)], -1)


def ends(element: NDArray[np.intp], chart: SurfaceChart, along: int) -> dict[str, NDArray[np.intp]]:
    """Surfaces across the wall, of the elements (layers, faces of the chart).

    Parameters
    ----------
    element : (layers, f) int
        Numbers of the elements, by layer and face of the chart.
    chart : SurfaceChart
        Of the surface.
    along : int
        Rows of elements.
    """
    out = {"base": faces_of(element[:, chart.index[:, 1] == along - 1], 3)}
    if len(chart.rim):
        out[RIM] = faces_of(element[:, chart.rim], 2)
    return out


def line_extraction(radial: int) -> NDArray[np.float64]:
    """(radial, 4, 2 (radial + 1)): Bernstein coefficients across each layer of elements.

    Parameters
    ----------
    radial : int
        Elements across the wall.
    """
    out = np.zeros((radial, 4, 2 * (radial + 1)))
    for r in range(radial):
        out[r, :, 2 * r : 2 * r + 4] = HERMITE_TO_BERNSTEIN
    return out


def tensor_extraction(line: NDArray[np.float64], surface: sp.csr_array) -> sp.csr_array:
    """Extraction matrix of a wall from those of a line across it and of its surfaces.

    Parameters
    ----------
    line : (layers, 4, 2 (layers + 1)) float64
        Bernstein coefficients across each layer of elements.
    surface : (16 faces, dofs) sparse
        Bernstein coefficients of the faces from a surface's degrees of freedom.

    Returns
    -------
    (64 layers faces, 2 (layers + 1) dofs) sparse
        Element (layer, face), coefficient 16 k + surface coefficient.
    """
    layers, n_faces = len(line), surface.shape[0] // 16
    flat = sp.csr_array(sp.kron(sp.csr_array(line.reshape(4 * layers, -1)), surface))
    r, face, k, a = np.meshgrid(
        np.arange(layers), np.arange(n_faces), np.arange(4), np.arange(16), indexing="ij"
    )
    order = ((4 * r + k) * n_faces + face) * 16 + a
    return sp.csr_array(flat[order.ravel()])


def _straightening(radial: int, chart: SurfaceChart, grading: Grading) -> sp.csr_array:
    """Straight across the whole wall: each layer follows from endo- and epicardium."""
    n, xi = chart.n, np.linspace(0, 1, radial + 1)
    dofs = np.arange(n)
    rows, columns, weights = (
        [dofs, 2 * radial * n + dofs],
        [dofs, 2 * radial * n + dofs],
        2 * [np.ones(n)],
    )
    for target, source, value, slope, whole in blending_weights(chart, dofs, xi, grading):
        for layer in range(radial + 1):
            parts = [
                (whole - value[layer], value[layer]),
                (-slope[layer] / radial, slope[layer] / radial),
            ]
            for derivative, part in enumerate(parts):
                if derivative == 0 and layer in (0, radial):
                    continue  # the surfaces themselves stay as they are, bit for bit
                for end, weight in zip((0, radial), part, strict=True):
                    rows.append((2 * layer + derivative) * n + target)
                    columns.append(2 * end * n + source)
                    weights.append(weight)
    size = 2 * (radial + 1) * n
    entries = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    return sp.csr_array(sp.coo_array(entries, shape=(size, size)))
