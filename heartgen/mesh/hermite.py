"""Cubic Hermite topology of a cup: a smooth wall with one of three kinds of apex.

The degrees of freedom are a tensor product: a radial cubic Hermite line (value and slope at each of
``radial + 1`` layers) times the space of a surface, which knows the apex (`heartgen.mesh.sheet`).
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import MeshError
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein, bernstein_derivative
from heartgen.mesh.hexmesh import Topology
from heartgen.mesh.patch import patch_sheet
from heartgen.mesh.sheet import Angles, Sheet, collapsed_sheet, open_sheet
from heartgen.options import Apex

LINEAR = (1.0, 1.0)
"""Grading of a wall whose depth is proportional to xi."""

MIN_CIRCUMFERENTIAL = 3
"""Fewer elements around cannot carry the tangent plane of the pole."""

RIM = "apex"
"""Name of the surface through the wall around an apical hole."""


def cup_topology(
    shape: tuple[int, int, int],
    grading: tuple[float, float] = LINEAR,
    apex: Apex = "collapsed",
) -> Topology:
    """Topology of a cup.

    Parameters
    ----------
    shape : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    grading : (float, float)
        Slope of the depth at endo- and epicardium once the wall is straightened, see `depth`.
    apex : {"collapsed", "hole", "patch"}

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
    sheet = sheet_of(apex, around, along)
    ones = np.zeros(sheet.n)
    ones[sheet.values] = 1
    element = np.arange(radial * sheet.n_faces).reshape(radial, -1)
    layer_nodes = int(sheet.nodes.max()) + 1
    nodes = [sheet.nodes + layer_nodes * layer for layer in range(radial + 1)]
    return Topology(
        extraction=tensor_extraction(line_extraction(radial), sheet.extraction),
        shape=shape,
        index=structure(radial, sheet),
        surfaces={
            "lv_endo": faces_of(element[0], 4),
            "epi": faces_of(element[-1], 5),
            **ends(element, sheet, along),
        },
        collapsed=faces_of(element[:, sheet.collapsed], 2),
        nodes=np.concatenate([np.hstack(pair) for pair in pairwise(nodes)]),
        constant=np.tile(np.concatenate([ones, 0 * ones]), radial + 1),
        straightening=_straightening(radial, sheet.n, grading),
    )


def sheet_of(
    apex: Apex, around: int, along: int, angles: Angles | None = None, corner: int = 0
) -> Sheet:
    """Space of a surface with an apex of some kind.

    Parameters
    ----------
    apex : {"collapsed", "hole", "patch"}
    around, along : int
        Faces.
    angles : Angles, optional
        At which the columns leave a pole.
    corner : int
        Column of a corner of a square patch.

    Returns
    -------
    Sheet
    """
    if apex == "patch":
        return patch_sheet(around, along, corner)
    return open_sheet(around, along) if apex == "hole" else collapsed_sheet(around, along, angles)


def structure(layers: int, sheet: Sheet) -> NDArray[np.intp]:
    """Place (e, 3) of elements: (radial, circumferential, longitudinal)."""
    layer = np.arange(layers).repeat(sheet.n_faces)
    return np.column_stack([layer, np.tile(sheet.index, (layers, 1))])


def faces_of(elements: NDArray[np.intp], face: int) -> NDArray[np.intp]:
    """One face of each element, (f, 2): (element, face)."""
    return np.stack([elements.ravel(), np.full(elements.size, face)], -1)


def ends(element: NDArray[np.intp], sheet: Sheet, along: int) -> dict[str, NDArray[np.intp]]:
    """Surfaces across the wall, of the elements (layers, faces of the sheet)."""
    out = {"base": faces_of(element[:, sheet.index[:, 1] == along - 1], 3)}
    if len(sheet.rim):
        out[RIM] = faces_of(element[:, sheet.rim], 2)
    return out


def line_extraction(radial: int) -> NDArray[np.float64]:
    """(radial, 4, 2 (radial + 1)): Bernstein coefficients across each layer of elements."""
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


def depth(
    xi: NDArray[np.float64], grading: tuple[float, float]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Relative depth in a graded wall: the cubic from 0 to 1 with given slopes at its ends.

    Parameters
    ----------
    xi : (n,) float64
        Transmural coordinate, 0 endocardium to 1 epicardium.
    grading : (float, float)
        Slopes at endo- and epicardium; (1, 1) is linear.

    Returns
    -------
    value, slope : (n,) float64
    """
    coefficients = HERMITE_TO_BERNSTEIN @ np.array([0.0, grading[0], 1.0, grading[1]])
    return bernstein(xi) @ coefficients, bernstein_derivative(xi) @ coefficients


def _straightening(radial: int, n_surface: int, grading: tuple[float, float]) -> sp.csr_array:
    """Straight across the whole wall: each layer follows from endo- and epicardium."""
    line = np.zeros((2 * (radial + 1), 2 * (radial + 1)))
    value, slope = depth(np.linspace(0, 1, radial + 1), grading)
    line[0::2, 0], line[0::2, 2 * radial] = 1 - value, value
    line[1::2, 0], line[1::2, 2 * radial] = -slope / radial, slope / radial
    line[0, 0] = line[-2, 2 * radial] = 1.0
    line[0, 2 * radial] = line[-2, 0] = 0.0
    return sp.csr_array(sp.kron(sp.csr_array(line), sp.eye_array(n_surface)))
