"""How fair is the mesh: how its lines run on the surfaces, and how the surfaces face.

A line of the mesh bends with its surface. What it does besides, within the surface, is its geodesic
curvature ``k_g``: positive to one side, negative to the other (do Carmo 1976, Differential Geometry
of Curves and Surfaces, section 4-4). A line may turn, as a circle of latitude does; a fair one does
not turn to one side and back again. The *wriggle* of a line, ``int |k_g| ds - |int k_g ds|``, is
the turning that it takes back. Meridians and circles of latitude have none.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components

from heartgen.anatomy import Anatomy
from heartgen.images.levelset import LevelSet
from heartgen.mesh.bernstein import DEGREE, ORDER, bernstein, bernstein_derivative
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.quadrature import gauss, gauss_square
from heartgen.mesh.surface_faces import face_control, tabulate_face

CIRCUMFERENTIAL, LONGITUDINAL = 0, 1
"""Direction of a line: along xi1, along xi2."""

INNERMOST = 4
"""First of the two faces, xi3=0 and xi3=1, that are surfaces and not cuts of the wall."""

LINE_GAUSS = 24
"""Points per edge for the turning: its absolute value has kinks, which take many."""

NODES_OF_EDGES = np.array([[[0, 1], [2, 3]], [[0, 2], [1, 3]]])
"""Corners (direction, end, 2) of a face, of its four, from which and to which each edge runs."""

COLLAPSED = 1e-9
"""Length, relative to the extent of the mesh, below which an edge is a point."""

NORMAL_GAUSS = 3
"""Points per face and direction for the normals."""

SMOOTHING = 2.0
"""Gaussian width, in voxels, over which the patient's normals are averaged: stairs of voxels tilt a
surface by 10 degrees over a few voxels, which no smooth mesh should follow. On a phantom the mean
is off the true normal by about 1 degree; half the width leaves 3, and half as much again blunts
the apex."""

REACH, STEP = 2.0, 0.5
"""Radius of the disc of the average and distance of its points, in Gaussian widths: a voxel, since
stairs hide between points farther apart."""

CLEAR = 0.6
"""Least length of a mean of unit normals that tells a direction: two of them more than 106 degrees
apart do not, as on the two sides of a crease."""

FROM_CUT = 1.0
"""Voxels from a cut at which normals begin to count: what lies closer is its rim."""


@dataclass(frozen=True)
class Fairness:
    """How the lines of a mesh run on its surfaces, and how the surfaces face, degrees.

    Attributes
    ----------
    circumferential_median, circumferential_max : float
        Wriggle of the lines along xi1.
    longitudinal_median, longitudinal_max : float
        Wriggle of the lines along xi2.
    normal_mean, normal_p95 : float or None
        Angle between the normals of mesh and patient, area-weighted; None without a patient, and
        for a stack, whose surfaces are interpolated between the slices.
    """

    circumferential_median: float
    circumferential_max: float
    longitudinal_median: float
    longitudinal_max: float
    normal_mean: float | None = None
    normal_p95: float | None = None


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines of the mesh on its endo- and epicardium, each joined of edges of elements.

    Attributes
    ----------
    edges : (s, 4) int
        Element, face, direction (`CIRCUMFERENTIAL` or `LONGITUDINAL`), and end (0 or 1) of the
        face's other direction; line by line, in the order in which they follow each other.
    line : (s,) int
        Which line each edge is part of.
    turning : (s,) float64
        ``int |k_g| ds`` of each edge, degrees.
    net : (s,) float64
        ``int k_g ds`` of each edge, degrees, positive from xi1 towards xi2.
    """

    edges: NDArray[np.intp]
    line: NDArray[np.intp]
    turning: NDArray[np.float64]
    net: NDArray[np.float64]

    @property
    def direction(self) -> NDArray[np.intp]:
        """`CIRCUMFERENTIAL` or `LONGITUDINAL` for each line, (l,)."""
        return np.asarray(self.edges[np.searchsorted(self.line, np.arange(self.n_lines)), 2])

    @property
    def n_lines(self) -> int:
        """Number of lines."""
        return int(self.line.max(initial=-1)) + 1

    @property
    def wriggle(self) -> NDArray[np.float64]:
        """Turning of each line that it takes back, (l,) float64, degrees."""
        turning, net = (
            np.bincount(self.line, one, minlength=self.n_lines) for one in (self.turning, self.net)
        )
        return np.asarray(turning - np.abs(net))


def assess_fairness(mesh: HexMesh, anatomy: Anatomy | None = None) -> Fairness:
    """Measure how fair a mesh is.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    anatomy : Anatomy, optional
        Of the patient that the mesh was fitted to, for the normals.

    Returns
    -------
    Fairness
        The patient's normal at a point of the mesh is the gradient of the level set of that
        surface, averaged around the point in the mesh's tangent plane with a Gaussian of
        `SMOOTHING` voxels. Each surface has its own level set, so that thin walls do not mix.
    """
    lines = mesh_lines(mesh)
    around, along = (lines.wriggle[lines.direction == d] for d in (CIRCUMFERENTIAL, LONGITUDINAL))
    mean, p95 = _normals(mesh, anatomy)
    return Fairness(
        circumferential_median=_median(around),
        circumferential_max=float(around.max(initial=0)),
        longitudinal_median=_median(along),
        longitudinal_max=float(along.max(initial=0)),
        normal_mean=mean,
        normal_p95=p95,
    )


def mesh_lines(mesh: HexMesh) -> Lines:
    """Join the edges of elements on the surfaces to lines, and measure how these turn.

    Parameters
    ----------
    mesh : HexMesh
        mm.

    Returns
    -------
    Lines
        Edges are joined where they share a node; where lines branch, those that go straightest on.
        Where two surfaces meet at an angle, at the right ventricle's insertion, the line is one of
        the surface with xi3 = 0, the free wall. The border of a square patch is a circle around it.
    """
    faces = mesh.topology.external
    faces = faces[faces[:, 1] >= INNERMOST]
    row = mesh.topology.index[faces[:, 0], 2]
    faces = faces[np.lexsort((faces[:, 0], -row, faces[:, 1]))]
    control = face_control(mesh, faces).reshape(-1, ORDER, ORDER, 3)
    edges = np.stack(
        np.broadcast_arrays(
            faces[:, 0, None, None], faces[:, 1, None, None], [[[0], [1]]], [[[0, 1]]]
        ),
        -1,
    ).reshape(-1, 4)
    corners = mesh.topology.nodes[faces[:, 0]].reshape(-1, 2, 4)
    corners = corners[np.arange(len(faces)), faces[:, 1] - INNERMOST]
    nodes = corners[:, NODES_OF_EDGES].reshape(-1, 2)
    curve, across = (part.reshape(-1, ORDER, 3) for part in _edges(control))
    extent = float(np.ptp(control.reshape(-1, 3), axis=0).max(initial=0))
    real = np.flatnonzero(np.ptp(curve, axis=1).max(-1) > COLLAPSED * extent)
    # Two faces have an edge in common. At the border of a square patch it may run one way in the
    # patch and the other way in the ring around it, which comes first.
    shared = np.column_stack([edges[real, 2], np.sort(nodes[real], axis=1)])
    _, first = np.unique(shared, axis=0, return_index=True)
    own = real[np.sort(first)]
    follower = _followers(edges[own, 2], nodes[own], curve[own])
    order, line = _in_order(follower)
    own = own[order]
    turning, net = _turning(curve[own], across[own], edges[own, 2])
    return Lines(edges[own], line, turning, net)


def _edges(control: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Edges of faces: coefficients along them, and of the derivative across, (f, 2, 2, 4, 3) each.

    Axes are face, direction, end.
    """
    curves, across = [], []
    for across_first in (control, control.swapaxes(1, 2)):
        curves.append(across_first[:, [0, DEGREE]])
        across.append(DEGREE * (across_first[:, [1, DEGREE]] - across_first[:, [0, DEGREE - 1]]))
    return np.stack(curves, 1), np.stack(across, 1)


def _turning(
    curve: NDArray[np.float64], across: NDArray[np.float64], direction: NDArray[np.intp]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Turning of edges (m, 4, 3) to any side, and net to the left, (m,) each, degrees."""
    t, weights = gauss(LINE_GAUSS)
    velocity, acceleration = (np.matmul(bernstein_derivative(t, order), curve) for order in (1, 2))
    side = np.where(direction == CIRCUMFERENTIAL, 1.0, -1.0)[:, None, None]
    normal = side * np.cross(velocity, np.matmul(bernstein(t), across))
    size = np.linalg.norm(normal, axis=-1) * np.einsum("mqx,mqx->mq", velocity, velocity)
    bent = np.einsum("mqx,mqx->mq", normal, np.cross(velocity, acceleration))
    # k_g ds: the part of the acceleration to the side, over the speed, for each step of xi.
    rate = np.degrees(bent / np.maximum(size, np.finfo(float).tiny))
    return np.abs(rate) @ weights, rate @ weights


def _followers(
    direction: NDArray[np.intp], nodes: NDArray[np.intp], curve: NDArray[np.float64]
) -> NDArray[np.intp]:
    """Edge (m,) that goes on where each one ends, -1 for none; the straightest pairs come first."""
    start, end = (direction * (nodes.max(initial=0) + 1) + nodes[:, side] for side in (0, 1))
    beginning = np.argsort(start, kind="stable")
    low, high = (np.searchsorted(start[beginning], end, side) for side in ("left", "right"))
    before = np.repeat(np.arange(len(end)), high - low)
    within = np.arange(len(before)) - np.repeat(np.cumsum(high - low) - (high - low), high - low)
    after = beginning[np.repeat(low, high - low) + within]
    leaving, arriving = (
        step / np.maximum(np.linalg.norm(step, axis=1, keepdims=True), np.finfo(float).tiny)
        for step in (curve[:, 1] - curve[:, 0], curve[:, DEGREE] - curve[:, DEGREE - 1])
    )
    straightness = np.einsum("px,px->p", arriving[before], leaving[after])
    follower = np.full(len(end), -1, dtype=np.intp)
    taken = np.zeros(len(end), dtype=bool)
    for pair in np.argsort(-straightness, kind="stable"):
        a, b = before[pair], after[pair]
        if follower[a] < 0 and not taken[b]:
            follower[a], taken[b] = b, True
    return follower


def _in_order(follower: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Edges (m,) line by line as they follow each other, and the line (m,) of each."""
    m = len(follower)
    leads = np.flatnonzero(follower >= 0)
    links = sp.coo_array((np.ones(len(leads)), (leads, follower[leads])), shape=(m, m))
    _, line = connected_components(links, directed=False)
    # A closed line has no head: it begins with its first edge.
    at = np.unique(line, return_index=True)[1]
    heads = np.setdiff1d(np.arange(m), follower)
    at[line[heads]] = heads
    rank = np.full(m, -1)
    for place in range(m):
        rank[at] = place
        onward = follower[at]
        onward = onward[onward >= 0]
        at = onward[rank[onward] < 0]
        if not len(at):
            break
    order = np.lexsort((rank, line))
    return order, line[order].astype(np.intp)


def _normals(mesh: HexMesh, anatomy: Anatomy | None) -> tuple[float | None, float | None]:
    """Mean and 95 % of the angle between the normals of mesh and patient, degrees."""
    if anatomy is None or anatomy.slices is not None:
        return None, None
    found = [
        _angles(mesh, faces, anatomy.surfaces[name], anatomy)
        for name, faces in mesh.topology.surfaces.items()
        if name in anatomy.surfaces and np.all(faces[:, 1] >= INNERMOST)
    ]
    if not sum(len(angle) for angle, _ in found):
        return None, None
    angle, area = (np.concatenate(parts) for parts in zip(*found, strict=True))
    p95 = np.percentile(angle, 95, weights=area, method="inverted_cdf")
    return float(np.average(angle, weights=area)), float(p95)


def _angles(
    mesh: HexMesh, faces: NDArray[np.intp], level: LevelSet, anatomy: Anatomy
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles (n,) between the normals on some faces and a patient's, degrees, and areas, mm^2."""
    uv, weights = gauss_square(NORMAL_GAUSS)
    control = face_control(mesh, faces)
    points = np.matmul(tabulate_face(uv), control).reshape(-1, 3)
    first, second = (
        np.matmul(tabulate_face(uv, d), control).reshape(-1, 3) for d in ((1, 0), (0, 1))
    )
    normal = np.cross(first, second)
    size = np.linalg.norm(normal, axis=1)
    area = size * np.tile(weights, len(faces))
    beyond = anatomy.base.surface.height(points)
    if "apical_rim" in anatomy.surfaces:
        beyond = np.maximum(beyond, anatomy.surfaces["apical_rim"].sample(points)[0])
    kept = (beyond < -FROM_CUT * anatomy.voxel) & (size > 0)
    points, normal = points[kept], normal[kept] / size[kept, None]
    along = first[kept] / np.linalg.norm(first[kept], axis=1, keepdims=True)
    plane = SMOOTHING * anatomy.voxel * np.stack([along, np.cross(normal, along)], 1)
    places, bell = _disc()
    around = points[:, None] + np.einsum("sd,ndx->nsx", places, plane)
    _, slope = level.sample(around.reshape(-1, 3))
    slope /= np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), np.finfo(float).tiny)
    mean = np.einsum("s,nsx->nx", bell, slope.reshape(len(points), -1, 3))
    length = np.linalg.norm(mean, axis=1)
    clear = length > CLEAR
    cosine = np.abs(np.einsum("nx,nx->n", normal, mean))[clear] / length[clear]
    return np.degrees(np.arccos(np.minimum(cosine, 1))), area[kept][clear]


def _disc() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (s, 2) of a Gaussian average, in its widths, and their weights (s,)."""
    line = np.arange(-REACH, REACH + STEP / 2, STEP)
    places = np.stack(np.meshgrid(line, line, indexing="ij"), -1).reshape(-1, 2)
    squared = np.einsum("sd,sd->s", places, places)
    near = squared <= REACH**2 + STEP**2 / 2
    bell = np.exp(-squared[near] / 2)
    return places[near], bell / bell.sum()


def _median(values: NDArray[np.float64]) -> float:
    """Median; zero of nothing."""
    return float(np.median(values)) if len(values) else 0.0
