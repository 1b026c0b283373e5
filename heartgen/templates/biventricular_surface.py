"""Shape of a biventricular template: smooth functions of few parameters, fitted to rays.

The thickness of the heart, the thickness of the septum, the gap between septum and free wall, and
the insertion line on which it closes are functions of the angle around the left ventricle and of
the height. Robust least squares fits them to what the rays met.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from heartgen.errors import AnatomyError
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein, bernstein_derivative
from heartgen.mesh.biventricular_topology import MIN_COLUMNS, RvAttachment
from heartgen.templates.rays import RayGrid, RayIntersections

Array = NDArray[np.float64]

LEAST_WIDTH, MOST_WIDTH = np.radians(50), np.radians(230)
"""Angle over which the right ventricle may extend, so that its corners keep room for elements."""

NARROW = np.radians(8)
"""Rows in which the right pool is seen under a smaller angle do not count."""

TOP_ROWS, BOTTOM_ROWS = 1.5, 0.4
"""Rows of elements that the right ventricle must leave above and below its lowest point."""

HARMONICS, DEGREE = 6, 4
"""Of the thickness of the heart: Fourier series around, polynomial along."""

RIDGE = 1e-4
"""Weight of the size of the coefficients against the data: keeps the fits determined."""

ROUNDS = 8
"""Rounds of reweighting."""

OUTLIER = 2.0
"""Deviation over the median deviation at which a ray counts half."""

NARROWING = 0.6
"""Height in the right ventricle from which it does not become narrower."""

WINDOW = 6
"""Rows of rays below one from which its least width is taken."""

LEAST_RAYS = 20
"""Fewer rays through the right pool cannot tell its shape."""

LEAST_GAP, LEAST_SEPTUM, LEAST_FREE_WALL = 0.5, 0.3, 0.6
"""Bounds of gap, septum and free wall, over the measured thickness of the free wall."""

BOTTOM_WEIGHT = 0.05
"""Weight of the insertion at the bottom of the right ventricle, where it is hard to tell, plus the
height above it."""


@dataclass(frozen=True, eq=False)
class BiventricularSurface:
    """Surfaces of a biventricular template over (column, row) coordinates.

    Attributes
    ----------
    grid : RayGrid
        Rays from the left endocardium.
    opening : RvAttachment
        Where the right ventricle is attached.
    rows : PchipInterpolator
        Row coordinate of the rays from that of the mesh.
    bottom : float
        Row coordinate of the rays at the lowest point of the right ventricle.
    around, along : int
        Elements.
    insertion : (2, 3) float64
        Coefficients of the angles of the two sides of the insertion line, rad.
    heart, septum, gap : (k,) float64
        Coefficients of the thicknesses and of the gap, mm.
    free_wall : float
        Measured thickness of the free wall, mm.
    """

    grid: RayGrid
    opening: RvAttachment
    rows: PchipInterpolator
    bottom: float
    around: int
    along: int
    insertion: Array
    heart: Array
    septum: Array
    gap: Array
    free_wall: float

    def surfaces(self, column: Array, row: Array) -> tuple[Array, Array, Array, Array]:
        """Left endocardium, septum, free wall and epicardium at coordinates (n,): four (n, 3).

        Parameters
        ----------
        column, row : (n,) float64
            Coordinates, of the mesh.
        """
        row = np.asarray(self.rows(row))
        height = _height(row, self.bottom, self.along)
        low, high = _sides(self.insertion, height)
        angle = _angle(column, low, high, self.around, self.opening.columns)[0]
        start, direction = self.grid.rays(angle, row)
        u = np.clip(2 * (angle - low) / (high - low) - 1, -1, 1)
        heart = _periodic(angle, row / self.along) @ self.heart
        septum = np.maximum(_patch(u, height) @ self.septum, LEAST_SEPTUM * self.free_wall)
        gap = np.maximum(_patch(u, height) @ self.gap, LEAST_GAP * self.free_wall)
        gap = _closing(u, height) * gap
        room = np.minimum(1, (heart - LEAST_FREE_WALL * self.free_wall) / (septum + gap))
        depths = (0 * heart, room * septum, room * (septum + gap), heart)
        endo, inner, outer, epi = (start + d[:, None] * direction for d in depths)
        return endo, inner, outer, epi

    def pole_angles(self) -> tuple[Array, Array]:
        """Angles (around,) at which the columns leave the apex, and their derivative by column."""
        column = np.arange(self.around, dtype=float)
        low, high = _sides(self.insertion, 0 * column)
        return _angle(column, low, high, self.around, self.opening.columns)


def fit_biventricular_surface(
    grid: RayGrid,
    intersections: RayIntersections,
    elements: tuple[int, int, int],
    free_wall: float,
    first_row: int = 1,
) -> BiventricularSurface:
    """Fit the surfaces to what rays met.

    Parameters
    ----------
    grid : RayGrid
        The rays.
    intersections : RayIntersections
        What they met.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    free_wall : float
        Thickness of the right ventricle's free wall, mm.
    first_row : int
        Lowest row of nodes at which the right ventricle may begin.

    Returns
    -------
    BiventricularSurface

    Raises
    ------
    AnatomyError
        If the right ventricle does not lie beside the left one.
    """
    radial, around, along = elements
    edges = np.array([intersections.edges(r) for r in range(len(intersections.row))])
    used = _lowest_run(edges[:, 1] - edges[:, 0] > NARROW)
    if not used.any():
        raise AnatomyError(
            "the right ventricle does not lie beside the left one: no line across the left "
            "ventricle's wall meets it; check that the mask holds both ventricles of one heart"
        )
    lowest = float(np.clip(intersections.row[used][0], BOTTOM_ROWS, along - TOP_ROWS))
    row = int(np.clip(round(lowest), min(first_row, along - 1), along - 1))
    height = _height(intersections.row, lowest, along)
    insertion = _fit_insertion(height[used], _widening(height[used], edges[used]))
    low, high = _sides(insertion, np.full(1, height[used].mean()))
    columns = round(around * float(high[0] - low[0]) / (2 * np.pi))
    angle, rows = np.meshgrid(intersections.angle, intersections.row)
    heart = _robust(_periodic(angle.ravel(), rows.ravel() / along), intersections.heart.ravel())
    septum, gap = _fit_right(intersections, insertion, lowest, along, heart, free_wall)
    return BiventricularSurface(
        grid=grid,
        opening=RvAttachment(
            int(np.clip(columns, MIN_COLUMNS, around - MIN_COLUMNS)), row, radial - radial // 2
        ),
        rows=PchipInterpolator([0, row, along], [0, lowest, along]),
        bottom=lowest,
        around=around,
        along=along,
        insertion=insertion,
        heart=heart,
        septum=septum,
        gap=gap,
        free_wall=free_wall,
    )


def _lowest_run(use: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The longest run of rows in use."""
    change = np.diff(use.astype(int), prepend=0, append=0)
    starts, ends = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
    out = np.zeros(len(use), dtype=bool)
    if len(starts):
        longest = int(np.argmax(ends - starts))
        out[starts[longest] : ends[longest]] = True
    return out


def _height(row: Array, bottom: float, along: int) -> Array:
    """Height in the right ventricle: 0 at its bottom and below, 1 at the base."""
    return np.clip((row - bottom) / (along - bottom), 0, 1)


def _widening(height: Array, edges: Array) -> Array:
    """Edges (r, 2) that do not narrow again near the base, where tissue may cover the pool."""
    out = edges.copy()
    for row in np.flatnonzero(height > NARROWING):
        below = np.median(out[max(row - WINDOW, 0) : row + 1], axis=0)
        out[row] = min(below[0], edges[row, 0]), max(below[1], edges[row, 1])
    return out


def _fit_insertion(height: Array, edges: Array) -> Array:
    """Coefficients (2, 3) of the two sides of the insertion line."""
    basis = _side_functions(height)
    weighted = basis * (BOTTOM_WEIGHT + height)[:, None]
    normal = weighted.T @ basis
    normal += RIDGE * np.trace(normal) * np.diag([0.0, 1.0, 1.0])
    return np.asarray(np.linalg.solve(normal, weighted.T @ edges).T)


def _side_functions(height: Array) -> Array:
    """Functions of the sides, level at the bottom, (n, 3)."""
    return np.stack([np.ones_like(height), height**2, height**3], -1)


def _sides(insertion: Array, height: Array) -> tuple[Array, Array]:
    """Angles (n,) of the two sides of the insertion line at heights (n,), rad."""
    low, high = (_side_functions(height) @ c for c in insertion)
    middle, width = (low + high) / 2, np.clip(high - low, LEAST_WIDTH, MOST_WIDTH)
    return middle - width / 2, middle + width / 2


def _angle(
    column: Array, low: Array, high: Array, around: int, columns: int
) -> tuple[Array, Array]:
    """Angle (n,) at column coordinates, and its derivative: even inside and beside the opening."""
    width = high - low
    inside, beside = width / columns, (2 * np.pi - width) / (around - columns)

    def node(number: NDArray[np.intp]) -> tuple[Array, Array]:
        at_side = (number % around == 0) | (number == columns)
        value = np.where(
            number <= columns, low + inside * number, high + beside * (number - columns)
        )
        slope = np.where(number < columns, inside, beside)
        return value, np.where(at_side, (inside + beside) / 2, slope)

    cell = np.clip(np.floor(column).astype(int), 0, around - 1)
    hermite = np.stack([*node(cell), *node(cell + 1)], -1) @ HERMITE_TO_BERNSTEIN.T
    t = column - cell
    return (
        np.asarray(np.sum(bernstein(t) * hermite, axis=1)),
        np.asarray(np.sum(bernstein_derivative(t) * hermite, axis=1)),
    )


def _fit_right(
    intersections: RayIntersections,
    insertion: Array,
    bottom: float,
    along: int,
    heart: Array,
    free_wall: float,
) -> tuple[Array, Array]:
    """Coefficients of the septum's thickness and of the gap."""
    angle, row = np.meshgrid(intersections.angle, intersections.row)
    height = _height(row, bottom, along).ravel()
    around, rows = angle.ravel(), row.ravel()
    low, high = _sides(insertion, height)
    near = around + 2 * np.pi * np.round(((low + high) / 2 - around) / (2 * np.pi))
    u = 2 * (near - low) / (high - low) - 1
    entry = intersections.entry.ravel()
    use = np.isfinite(entry) & (np.abs(u) < 1) & (rows > bottom)
    if use.sum() < LEAST_RAYS:
        raise AnatomyError(
            "the right ventricle is too small beside the left one to be meshed: it is seen by "
            f"{use.sum()} of {len(entry)} lines across the left ventricle's wall; fit the left "
            "ventricle alone"
        )
    basis = _patch(u[use], height[use])
    septum = _robust(basis, entry[use])
    room = _periodic(around[use], rows[use] / along) @ heart - free_wall - entry[use]
    return septum, _robust(_closing(u[use], height[use])[:, None] * basis, room)


def _periodic(angle: Array, t: Array) -> Array:
    """Fourier series around times polynomials along, (n, k)."""
    order = np.arange(1, HARMONICS + 1)
    turns = np.outer(angle, order)
    around = np.concatenate([np.ones((len(angle), 1)), np.cos(turns), np.sin(turns)], axis=1)
    return np.asarray(np.einsum("ni,nj->nij", around, bernstein(t, DEGREE)).reshape(len(t), -1))


def _patch(u: Array, height: Array) -> Array:
    """Biquadratic polynomials over the opening, (n, 9)."""
    powers = (np.stack([np.ones_like(x), x, x**2], -1) for x in (u, height))
    return np.asarray(np.einsum("ni,nj->nij", *powers).reshape(len(u), -1))


def _closing(u: Array, height: Array) -> Array:
    """Bubble that is zero on the insertion line and level at the base, (n,)."""
    return np.asarray((1 - u**2) * (1 - (1 - height) ** 2))


def _robust(basis: Array, values: Array) -> Array:
    """Least squares with Cauchy weights."""
    weight = np.ones(len(values))
    for _ in range(ROUNDS):
        normal = basis.T @ (weight[:, None] * basis)
        normal += RIDGE * np.trace(normal) / len(normal) * np.eye(len(normal))
        out = np.linalg.solve(normal, basis.T @ (weight * values))
        deviation = np.abs(values - basis @ out)
        scale = OUTLIER * np.median(deviation) + np.finfo(float).tiny
        weight = 1 / (1 + (deviation / scale) ** 2)
    return np.asarray(out)
