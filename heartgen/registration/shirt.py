"""Registration of surfaces on ShIRT's node grids (paper, section 2.2; Barber et al. 2007).

ShIRT compares the intensities of two images; here the signed distances of the labeled surfaces are
compared, each surface of the template with its own of the patient. With f the patient's image,
pulled back to the template by the current map, and m the template's, an update ``a`` of the
displacement obeys ``m - f = grad f . a``. The displacement is trilinear on a grid of nodes; the
update minimizes the misfit plus the squared Laplacian of the displacement, by Gauss-Newton steps,
shortened until they fold nothing. Where a fold stands in the way, the map is frozen and the next
one continues from there: the result is a chain of fold-free maps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from heartgen.errors import RegistrationError
from heartgen.images.levelset import LevelSet
from heartgen.mesh.hexmesh import HexMesh
from heartgen.registration.deformation import Deformation, GridMap, NodeGrid, fold_bound
from heartgen.registration.matching import Samples, sample_surfaces
from heartgen.registration.smoothing import Smoothing, conjugate_gradients

NODE_SPACINGS = (10.0, 8.0, 6.0, 4.0, 2.0)
"""Node spacing of each pass, voxels; level of detail k runs the first k (paper, section 2.2)."""

VOXELS_PER_LENGTH = 75.0
"""A level means voxels of an image at least this fine, over the length of the ventricle: small
hearts and coarse images would otherwise lose their shape at the first levels."""

SMOOTHNESS = (1.0, 2.0, 4.0, 8.0, 32.0)
"""Weight of the Laplacian against the data in each pass, both normalized by their traces. The
smallest detail it lets through is about spacing * weight^(1/4): 10, 9.5, 8.5, 6.7 and 4.8 voxels.
With one weight for all passes the fine ones would follow the voxels' stairs."""

MARGIN = (1.5, 5.0)
"""Room around the template: node spacings, plus voxels."""

STEPS = 10
FULL_STEPS = 3
RELAXED = 0.5
"""Length of the steps after the first ones: full steps overshoot on noisy surfaces, and then
amplify rounding errors."""

SOLVER_STEPS = 20
"""Gauss-Newton steps of a pass, and conjugate gradient steps in each. The numbers are fixed, and
steps are shortened by folds alone: stopping rules would turn rounding errors into different meshes.
"""

SAFE = 0.2
"""Least local volume change of one map that is accepted."""

SHORT_STEP = 0.6
"""A fold that shortens a step below this share ends a map; the next one continues from there."""

MAX_LINKS = 6
"""Maps chained in one pass."""

SHORTEST_STEP = 0.01

SOLVER_SHIFT = 0.2
"""Share of the data term that stands for it in the preconditioner: most nodes carry no data."""


@dataclass(frozen=True)
class Steering:
    """How a registration is steered and watched.

    Attributes
    ----------
    progress : callable
        Called with the share of the work done; may raise to cancel.
    watch : callable
        Called after each Gauss-Newton step with the number of the pass, from 1, and the map so far.
    smoothness : float
        Factor of the weight of the Laplacian in every pass, `SMOOTHNESS`.
    """

    progress: Callable[[float], None] = lambda done: None
    watch: Callable[[int, Deformation], None] = lambda number, so_far: None
    smoothness: float = 1.0


UNSTEERED = Steering()


def register(
    template: HexMesh,
    images: Mapping[str, LevelSet],
    frame: NDArray[np.float64],
    voxel: float,
    length: float,
    lod: int,
    steering: Steering = UNSTEERED,
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
    voxel, length : float
        Voxel size and length of the ventricle, mm.
    lod : int
        Level of detail, 1 to 5: the number of passes.
    steering : Steering
        How smooth, and who is told of the steps.

    Returns
    -------
    tuple of Deformation
        The map after each pass; the last one is the result.

    Raises
    ------
    RegistrationError
        If a pass finds no map free of folds, or there is no such level or smoothness.
    """
    smoothness = steering.smoothness
    if not smoothness > 0:
        raise RegistrationError(f"a smoothness of {smoothness} is none: choose a positive factor")
    if not 1 <= lod <= len(NODE_SPACINGS):
        raise RegistrationError(f"level of detail {lod} does not exist: choose 1 to 5")
    voxel = min(voxel, length / VOXELS_PER_LENGTH)
    out: list[Deformation] = []
    frozen = Deformation()
    active: GridMap | None = None
    for number, nodes in enumerate(NODE_SPACINGS[:lod]):
        grid = _grid(template, frame, nodes * voxel, voxel)
        samples = sample_surfaces(template, images, nodes * voxel, voxel)
        if active is not None:
            refined = active.on(grid)
            if refined.least_determinant() < SAFE:
                frozen, refined = frozen.then(active), GridMap.identity(grid)
            active = refined
        else:
            active = GridMap.identity(grid)
        for link in range(MAX_LINKS):
            steering.progress((number + link / MAX_LINKS) / lod)
            active, stuck = _fit_map(
                samples.moved(frozen),
                active,
                smoothness * SMOOTHNESS[number],
                partial(_tell, steering.watch, number + 1, frozen),
            )
            if not stuck:
                break
            frozen, active = frozen.then(active), GridMap.identity(grid)
        out.append(frozen.then(active))
        if out[-1].least_determinant() <= 0:
            raise RegistrationError(
                f"registration pass {number + 1} folded the deformation; "
                "try a lower level of detail"
            )
    return tuple(out)


def _tell(
    watch: Callable[[int, Deformation], None], number: int, frozen: Deformation, active: GridMap
) -> None:
    """Tell who watches of a step."""
    watch(number, frozen.then(active))


def _grid(template: HexMesh, frame: NDArray[np.float64], spacing: float, voxel: float) -> NodeGrid:
    """Node grid along the heart's axes around the template, centered on it."""
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


@dataclass(frozen=True, eq=False)
class _System:
    """Regularized normal equations ``(T'WT + s L'L) a = -T'W f - s L'L u`` of one step."""

    basis: sp.csr_array
    basis_t: sp.csr_array
    slope: NDArray[np.float64]
    weights: NDArray[np.float64]
    smoothing: Smoothing
    per_node: float
    smooth: float

    def matrix(self, a: NDArray[np.float64]) -> NDArray[np.float64]:
        """Left-hand side for node values a (n, 3)."""
        along = self.weights * np.einsum("nx,nx->n", self.basis @ a, self.slope)
        data = self.basis_t @ (along[:, None] * self.slope)
        return np.asarray(data + self.smooth * self.smoothing.apply(a))

    def right(self, value: NDArray[np.float64], total: NDArray[np.float64]) -> NDArray[np.float64]:
        """Right-hand side for the misfit (m,) and the displacement so far (n, 3)."""
        data = self.basis_t @ ((self.weights * value)[:, None] * self.slope)
        return np.asarray(-data - self.smooth * self.smoothing.apply(total))

    def precondition(self, residual: NDArray[np.float64]) -> NDArray[np.float64]:
        """Approximate solution for a residual (n, 3)."""
        return self.smoothing.solve(residual, self.smooth, SOLVER_SHIFT * self.per_node)


def _fit_map(
    samples: Samples, start: GridMap, smoothness: float, told: Callable[[GridMap], None]
) -> tuple[GridMap, bool]:
    """Gauss-Newton steps for one map; also whether a fold, not convergence, ended it."""
    grid, total = start.grid, start.displacement
    smoothing = Smoothing(grid.shape)
    basis = grid.interpolation(samples.points)
    basis_t = sp.csr_array(basis.T)
    supported = int(np.sum(np.diff(basis_t.indptr) > 0))
    value, slope = samples.patient(samples.points + basis @ total)
    folded = False
    for step in range(STEPS):
        diagonal = basis_t.power(2) @ (samples.weights[:, None] * slope**2)
        per_node = float(diagonal.sum()) / (3 * supported)
        smooth = smoothness * per_node / (smoothing.trace / grid.size)
        system = _System(basis, basis_t, slope, samples.weights, smoothing, per_node, smooth)
        update = conjugate_gradients(
            system.matrix,
            system.right(value, total),
            system.precondition,
            SOLVER_STEPS,
        )
        length, folded = 1.0 if step < FULL_STEPS else RELAXED, False
        while float(fold_bound(grid, total + length * update).min()) < SAFE:
            length, folded = length / 2, True
            if length < SHORTEST_STEP:
                return GridMap(grid, total), True
        total = total + length * update
        told(GridMap(grid, total))
        if folded and length < SHORT_STEP:
            return GridMap(grid, total), True
        value, slope = samples.patient(samples.points + basis @ total)
    return GridMap(grid, total), folded
