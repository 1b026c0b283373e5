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
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import RegistrationError
from heartgen.images.levelset import LevelSet
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.surfaces import sample_faces
from heartgen.registration.deformation import Deformation, GridMap, NodeGrid, fold_bound
from heartgen.registration.smoothing import Smoothing, conjugate_gradients

NODE_SPACINGS = (10.0, 8.0, 6.0, 4.0, 2.0)
"""Node spacing of each pass, voxels; level of detail k runs the first k (paper, section 2.2)."""

SMOOTHNESS = (2.0, 3.0, 4.0, 8.0, 32.0)
"""Weight of the Laplacian against the data in each pass, both normalised by their traces. The
smallest detail it lets through is about spacing * weight^(1/4): 12, 10.5, 8.5, 6.7 and 4.8 voxels.
With one weight for all passes the fine ones would follow the voxels' stairs."""

MARGIN = (1.5, 5.0)
"""Room around the template: node spacings, plus voxels."""

SAMPLES_PER_NODE = 2.0
"""Surface samples per node spacing."""

MAX_SAMPLES = 16
MIN_SAMPLES = 6
"""Surface samples per face and direction."""

MAX_STEPS = 10
SETTLED = 0.03
"""Mean update of the surfaces, in voxels, below which a pass ends."""

SAFE = 0.2
"""Least local volume change of one map that is accepted."""

SHORT_STEP = 0.3
"""A fold that shortens a step below this share ends a map; the next one continues from there."""

MAX_LINKS = 6
"""Maps chained in one pass."""

HALVINGS = 6
"""Attempts to shorten a step that folds the map or raises the misfit."""

SOLVER_TOLERANCE = 0.05
SOLVER_STEPS = 25
SOLVER_SHIFT = 0.2
"""Share of the data term that stands for it in the preconditioner: most nodes carry no data."""


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

    def moved(self, deformation: Deformation) -> Samples:
        """The samples where a deformation takes them."""
        return replace(self, points=deformation(self.points))

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
    frozen, active = Deformation(), None
    for number, nodes in enumerate(NODE_SPACINGS[:lod]):
        grid = _grid(template, frame, nodes * voxel, voxel)
        samples = _samples(template, images, nodes * voxel, voxel)
        if active is not None and (refined := active.on(grid)).least_determinant() < SAFE:
            frozen, active = frozen.then(active), None
        start = GridMap(grid, np.zeros((grid.size, 3))) if active is None else refined
        for again in range(MAX_LINKS):
            progress((number + again / MAX_LINKS) / lod)
            active, stuck = _pass(samples.moved(frozen), start, voxel, SMOOTHNESS[number])
            if not stuck:
                break
            frozen, start = frozen.then(active), GridMap(grid, np.zeros((grid.size, 3)))
            active = start
        out.append(frozen.then(active))
        if out[-1].least_determinant() <= 0:
            raise RegistrationError(
                f"registration pass {number + 1} folded the deformation; try a lower level of detail"
            )
    return tuple(out)


def _grid(template: HexMesh, frame: NDArray[np.float64], spacing: float, voxel: float) -> NodeGrid:
    """Node grid along the heart's axes around the template, centred on it."""
    axes = frame[:3, :3]
    places = template.control.reshape(-1, 3) @ axes
    margin = MARGIN[0] * spacing + MARGIN[1] * voxel
    low, high = places.min(0) - margin, places.max(0) + margin
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
    samples: Samples, start: GridMap, voxel: float, smoothness: float
) -> tuple[GridMap, bool]:
    """Gauss-Newton steps for one map; also whether a fold, not convergence, ended it."""
    grid, total = start.grid, start.displacement
    smoothing = Smoothing(grid.shape)
    basis = grid.interpolation(samples.points)
    basis_t = sp.csr_array(basis.T)
    supported = int(np.sum(np.diff(basis_t.indptr) > 0))
    weights = samples.weights
    value, slope = samples.patient(samples.points + basis @ total)
    for _ in range(MAX_STEPS):
        diagonal = basis_t.power(2) @ (weights[:, None] * slope**2)
        per_node = float(diagonal.sum()) / (3 * supported)
        smooth = smoothness * per_node / (smoothing.trace / grid.size)

        def normal_matrix(a: NDArray[np.float64], g=slope, s=smooth) -> NDArray[np.float64]:
            along = weights * np.einsum("nx,nx->n", basis @ a, g)
            return np.asarray(basis_t @ (along[:, None] * g)) + s * smoothing.apply(a)

        update = conjugate_gradients(
            normal_matrix,
            -(basis_t @ ((weights * value)[:, None] * slope)) - smooth * smoothing.apply(total),
            lambda r, s=smooth, d=per_node: smoothing.solve(r, s, SOLVER_SHIFT * d),
            SOLVER_TOLERANCE,
            SOLVER_STEPS,
        )
        before = float(weights @ value**2) + smooth * smoothing.energy(total)
        length = 1.0
        folded = False
        for _ in range(HALVINGS):
            trial = total + length * update
            value, slope = samples.patient(samples.points + basis @ trial)
            after = float(weights @ value**2) + smooth * smoothing.energy(trial)
            folds = float(fold_bound(grid, trial).min()) < SAFE
            folded |= folds
            if not folds and after <= before:
                break
            length /= 2
        else:
            return GridMap(grid, total), folded
        total = trial
        moved = length * float(np.mean(np.linalg.norm(basis @ update, axis=1)))
        if folded and length < SHORT_STEP:
            return GridMap(grid, total), True
        if moved < SETTLED * voxel:
            break
    return GridMap(grid, total), False
