"""Image registration after ShIRT (paper, section 2.2; Barber et al. 2007), from coarse to fine.

Template and patient are matched as soft images: their signed distances, one channel for each
surface (blood pool, filled heart). With f the patient's image and m the template's warped by the
current map, an update ``a`` of the displacement obeys ``f - m = 1/2 grad(f + m) . a``. The
displacement is trilinear on a grid of nodes; the update minimises the misfit plus the squared
Laplacian of the total displacement. The images matter only near the surfaces, so the misfit is
integrated over the template's surfaces rather than over voxels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import RegistrationError
from heartgen.images.levelset import LevelSet
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surfaces import sample_faces
from heartgen.registration.deformation import Deformation, NodeGrid, fold_bound
from heartgen.registration.smoothing import Smoothing, conjugate_gradients

NODE_SPACINGS = (10.0, 8.0, 6.0, 4.0, 2.0)
"""Node spacing of each pass, voxels; level of detail k runs the first k (paper, section 2.2)."""

SMOOTHNESS = 0.5
"""Weight of the Laplacian against the data, both normalised by their traces."""

MARGIN = 1.5
"""Room around the template, in node spacings of the first pass."""

SAMPLES_PER_NODE = 2.0
"""Surface samples per node spacing."""

MAX_SAMPLES = 16
MIN_SAMPLES = 6
"""Surface samples per face and direction."""

MAX_STEPS = 12
SETTLED = 0.02
"""Mean update of the surfaces, in voxels, below which a pass ends."""

LEAST_DETERMINANT = 0.1
"""Least local volume change of a map that is accepted."""

HALVINGS = 6
"""Attempts to shorten a step that folds the map or raises the misfit."""

SOLVER_TOLERANCE = 1e-2
SOLVER_STEPS = 60


@dataclass(frozen=True)
class Samples:
    """Points of the template's surfaces at which the images are compared.

    Attributes
    ----------
    points, normals : (n, 3) float64
        mm, world (LPS); outward normals, the gradient of the template's image.
    weights : (n,) float64
        Area in units of a voxel's face.
    channels : tuple of (LevelSet, slice)
        The patient's image with which each range of samples is compared.
    """

    points: NDArray[np.float64]
    normals: NDArray[np.float64]
    weights: NDArray[np.float64]
    channels: tuple[tuple[LevelSet, slice], ...]

    def patient(
        self, points: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """The patient's image (n,) and its gradient (n, 3) at the samples' moved points."""
        parts = [level.sample(points[rows]) for level, rows in self.channels]
        return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])


def register(
    template: HexMesh,
    images: Mapping[str, LevelSet],
    frame: NDArray[np.float64],
    voxel: float,
    lod: int,
    progress: Callable[[float], None] = lambda done: None,
) -> tuple[Deformation, ...]:
    """Find the deformation from template to patient.

    Parameters
    ----------
    template : HexMesh
        Placed on the patient; mm, world (LPS).
    images : mapping of str to LevelSet
        The patient's signed distance for each named surface of the template.
    frame : (4, 4) float64
        Axes of the node grid (those of the heart) and any origin, mm, LPS.
    voxel : float
        Voxel size, mm.
    lod : int
        Level of detail, 1 to 5: the number of passes.
    progress : callable
        Called with the share of the work done; may raise to cancel.

    Returns
    -------
    tuple of Deformation
        The map after each pass; the last one is the result.

    Raises
    ------
    RegistrationError
        If a pass finds no map free of folds.
    """
    if not 1 <= lod <= len(NODE_SPACINGS):
        raise RegistrationError(f"level of detail {lod} does not exist: choose 1 to 5")
    out: list[Deformation] = []
    for number, nodes in enumerate(NODE_SPACINGS[:lod]):
        grid = _grid(template, frame, nodes * voxel, NODE_SPACINGS[0] * voxel)
        samples = _samples(template, images, nodes * voxel, voxel)
        start = out[-1].on(grid) if out else Deformation(grid, np.zeros((grid.size, 3)))
        share = (number / lod, 1 / lod)
        out.append(_pass(samples, start, voxel, lambda done, s=share: progress(s[0] + s[1] * done)))
        if out[-1].least_determinant() <= 0:
            raise RegistrationError(
                f"registration pass {number + 1} folded the deformation; try a lower level of detail"
            )
    return tuple(out)


def _grid(template: HexMesh, frame: NDArray[np.float64], spacing: float, margin: float) -> NodeGrid:
    """Node grid along the heart's axes around the template, centred on it."""
    axes = frame[:3, :3]
    places = template.control.reshape(-1, 3) @ axes
    low, high = places.min(0) - MARGIN * margin, places.max(0) + MARGIN * margin
    cells = np.ceil((high - low) / spacing).astype(int)
    low = (low + high - cells * spacing) / 2
    matrix = np.eye(4)
    matrix[:3, :3] = axes * spacing
    matrix[:3, 3] = axes @ low
    return NodeGrid(matrix, (int(cells[0]) + 1, int(cells[1]) + 1, int(cells[2]) + 1))


def _samples(
    template: HexMesh, images: Mapping[str, LevelSet], spacing: float, voxel: float
) -> Samples:
    """Samples of the template's surfaces; the base is compared with the filled heart."""
    image_of = {name: images.get(name, images["epi"]) for name in template.topology.surfaces}
    points, normals, weights, channels = [], [], [], []
    start = 0
    for name, faces in template.topology.surfaces.items():
        edge = float(np.sqrt(sample_faces(template, faces, 2)[2].sum() / len(faces)))
        n = int(np.clip(np.ceil(SAMPLES_PER_NODE * edge / spacing), MIN_SAMPLES, MAX_SAMPLES))
        p, normal, w = sample_faces(template, faces, n)
        outward = -normal if name.endswith("endo") else normal
        points.append(p)
        normals.append(outward)
        weights.append(w / voxel**2)
        channels.append((image_of[name], slice(start, start + len(p))))
        start += len(p)
    return Samples(
        np.concatenate(points), np.concatenate(normals), np.concatenate(weights), tuple(channels)
    )


def _pass(
    samples: Samples, start: Deformation, voxel: float, progress: Callable[[float], None]
) -> Deformation:
    """Gauss-Newton steps at one node spacing."""
    grid = start.grid
    smoothing = Smoothing(grid.shape)
    basis = grid.interpolation(samples.points)
    basis_t = sp.csr_array(basis.T)
    supported = np.diff(basis_t.indptr) > 0
    total = start.displacement
    weights = samples.weights

    def misfit(value: NDArray[np.float64], u: NDArray[np.float64], smooth: float) -> float:
        return float(weights @ value**2) + smooth * smoothing.energy(u)

    value, slope = samples.patient(samples.points + basis @ total)
    for step in range(MAX_STEPS):
        progress(step / MAX_STEPS)
        gradient = 0.5 * (slope + samples.normals)
        diagonal = basis_t.power(2) @ (weights[:, None] * gradient**2)
        per_node = float(diagonal.sum()) / (3 * int(supported.sum()))
        smooth = SMOOTHNESS * per_node / (smoothing.trace / grid.size)

        def normal_matrix(a: NDArray[np.float64], g=gradient, s=smooth) -> NDArray[np.float64]:
            along = weights * np.einsum("nx,nx->n", basis @ a, g)
            return np.asarray(basis_t @ (along[:, None] * g)) + s * smoothing.apply(a)

        right = -(basis_t @ ((weights * value)[:, None] * gradient)) - smooth * smoothing.apply(total)
        update = conjugate_gradients(
            normal_matrix,
            np.asarray(right),
            lambda r, s=smooth, d=per_node: smoothing.solve(r, s, d),
            SOLVER_TOLERANCE,
            SOLVER_STEPS,
        )
        before = misfit(value, total, smooth)
        length = 1.0
        for _ in range(HALVINGS):
            trial = total + length * update
            new_value, new_slope = samples.patient(samples.points + basis @ trial)
            folds = float(fold_bound(grid, trial).min()) < LEAST_DETERMINANT
            if not folds and misfit(new_value, trial, smooth) <= before:
                break
            length /= 2
        else:
            break
        total, value, slope = trial, new_value, new_slope
        if float(np.mean(np.linalg.norm(basis @ update, axis=1))) * length < SETTLED * voxel:
            break
    return Deformation(grid, total)
