"""Patches cut out of the parallel surfaces of an ellipsoid, by a base and by another wall."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from skimage.measure import find_contours

from heartgen.errors import InputError
from heartgen.samples.nearest import Curve, Surface
from heartgen.samples.region import Polar, Ruled, last_inside
from heartgen.samples.surface_patch import Patch

Array = NDArray[np.float64]
Gap = Callable[[Array], Array]
"""Points (n, 3), mm, to a smooth number (n,), positive on the side that is kept."""

REACH = 2.7
"""Largest angle from the lower pole at which surfaces are looked at, rad: above every base."""

CELLS = 160
"""Cells across the plane in which outlines are first traced, about 2 mm each."""

KNOTS = 512
"""Intervals of the cubic spline of an outline; exact to 1e-6 mm."""

STEP = 1e-5
"""Step of the finite differences in the plane, rad."""

NEWTON_STEPS = 5
"""Newton steps from a traced outline to the true one: down to round-off."""

CHECKS = 65
"""Places along and across a region at which its lines are checked not to cross."""


class Piece(NamedTuple):
    """A patch and what bounds it: its rim on the base and, if another wall meets it, its edge.

    Attributes
    ----------
    patch : Patch
        The surface.
    rim : Curve
        Where it ends on the base, mm.
    edge : Curve or None
        Where another wall meets it, mm; None if none does.
    """

    patch: Patch
    rim: Curve
    edge: Curve | None


@dataclass(frozen=True)
class _Both:
    """The lesser of two gaps of a surface's points, over the plane."""

    shell: Surface
    below: Gap
    apart: Gap

    def __call__(self, plane: Array) -> Array:
        points = self.shell(plane)
        return np.minimum(self.below(points), self.apart(points))


def cut_along_base(shell: Surface, below: Gap) -> Piece:
    """Cut a surface along the base alone.

    Parameters
    ----------
    shell : callable
        Plane coordinates (n, 2), rad from the lower pole, to points (n, 3), mm.
    below : callable
        Positive below the base.
    """

    def inside(radius: Array, angle: Array) -> NDArray[np.bool_]:
        way = np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(below(shell(radius[:, None] * way)) > 0)

    patch = Patch(shell, Polar(last_inside(inside, np.pi)))
    return Piece(patch, patch.boundary[0], None)


def cut_out(shell: Surface, below: Gap, apart: Gap) -> Piece:
    """Cut a surface along the base, and along another wall that meets it from base to base.

    Parameters
    ----------
    shell : callable
        Plane coordinates (n, 2), rad from the lower pole, to points (n, 3), mm.
    below : callable
        Positive below the base.
    apart : callable
        Positive outside the other wall.

    Returns
    -------
    Piece

    Raises
    ------
    InputError
        If the outline is not one line along the base and one along the other wall.
    """
    edge = _line(shell, apart, below)
    rim = _line(shell, below, apart)
    if np.linalg.norm(edge[0] - rim[0]) > np.linalg.norm(edge[0] - rim[-1]):
        rim = rim[::-1]
    share = np.linspace(0, 1, KNOTS + 1)
    region = Ruled(CubicSpline(share, edge), CubicSpline(share, rim), _Both(shell, below, apart))
    _require_simple(region)
    patch = Patch(shell, region)
    return Piece(patch, patch.boundary[1], patch.boundary[0])


def edge_of(shell: Surface, below: Gap, apart: Gap) -> Array:
    """Points (n, 3), mm, along the edge that `cut_out` would find, from base to base.

    Parameters
    ----------
    shell : callable
        Plane coordinates (n, 2) to points (n, 3), mm.
    below : callable
        Points (n, 3), mm, to a number (n,) that is positive below the base.
    apart : callable
        Likewise, positive apart from the other wall.
    """
    return shell(_line(shell, apart, below))


def _line(shell: Surface, gap: Gap, kept: Gap) -> Array:
    """Plane coordinates (KNOTS + 1, 2) of the line gap = 0 as far as it is kept."""
    side = np.linspace(-REACH, REACH, CELLS + 1)
    grid = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    runs = []
    field = gap(shell(grid)).reshape(CELLS + 1, -1)
    for contour in find_contours(field, 0.0):  # type: ignore[no-untyped-call]
        line = contour * (2 * REACH / CELLS) - REACH
        runs += _runs(line, kept(shell(line)) > 0)
    if len(runs) != 1:
        raise _impossible()
    ends = _corners(shell, gap, kept, runs[0][[0, -1]])
    line = np.concatenate([ends[:1], _on_line(shell, gap, runs[0][1:-1]), ends[1:]])
    for _ in range(2):
        length = np.cumsum(np.linalg.norm(np.diff(line, axis=0, prepend=line[:1]), axis=1))
        spline = CubicSpline(length, line)
        line = spline(np.linspace(0, length[-1], KNOTS + 1))
        line[1:-1] = _on_line(shell, gap, line[1:-1])
    return np.asarray(line)


def _runs(line: Array, kept: NDArray[np.bool_]) -> list[Array]:
    """Stretches of a contour that are kept, each with the one point more at both ends."""
    if kept.all() or not kept.any():
        if kept.any():
            raise _impossible()
        return []
    if np.array_equal(line[0], line[-1]):
        start = int(np.argmin(kept[:-1]))
        line, kept = np.roll(line[:-1], -start, axis=0), np.roll(kept[:-1], -start)
        line, kept = np.append(line, line[:1], axis=0), np.append(kept, kept[:1])
    change = np.flatnonzero(np.diff(np.concatenate([[False], kept, [False]]).astype(int)))
    return [line[max(a - 1, 0) : b + 1] for a, b in change.reshape(-1, 2)]


def _on_line(shell: Surface, gap: Gap, plane: Array) -> Array:
    """Nearby plane coordinates (n, 2) at which the gap is zero."""
    for _ in range(NEWTON_STEPS):
        value, slope = _slope(shell, gap, plane)
        plane = plane - (value / np.sum(slope**2, axis=1))[:, None] * slope
    return plane


def _corners(shell: Surface, first: Gap, second: Gap, plane: Array) -> Array:
    """Nearby plane coordinates (n, 2) at which both gaps are zero."""
    for _ in range(2 * NEWTON_STEPS):
        values, slopes = zip(*(_slope(shell, g, plane) for g in (first, second)), strict=True)
        matrix, value = np.stack(slopes, axis=1), np.stack(values, axis=1)
        plane = plane - np.linalg.solve(matrix, value[..., None])[..., 0]
    return plane


def _slope(shell: Surface, gap: Gap, plane: Array) -> tuple[Array, Array]:
    """Gap (n,) and its gradient (n, 2) in the plane."""
    slope = [
        (gap(shell(plane + step)) - gap(shell(plane - step))) / (2 * STEP)
        for step in np.eye(2) * STEP
    ]
    return gap(shell(plane)), np.column_stack(slope)


def _require_simple(region: Ruled) -> None:
    """Refuse a region whose lines leave it or cross."""
    inner = (np.arange(CHECKS) + 1 / 2) / CHECKS
    q, v = (a.ravel() for a in np.meshgrid(inner, inner, indexing="ij"))
    plane, _ = region.place(q, v)
    lines = region.rim(v) - region.edge(v)
    across = (1 - q[:, None]) * region.edge(v, 1) + q[:, None] * region.rim(v, 1)
    turn = np.sign(lines[:, 0] * across[:, 1] - lines[:, 1] * across[:, 0])
    if not (region.holds(plane).all() and np.all(turn == turn[0])):
        raise _impossible()


def _impossible() -> InputError:
    """What to say about ventricles that do not lie side by side."""
    return InputError(
        "These sizes do not make two ventricles side by side: the right one must reach out of the "
        "wall of the left one, from the base to above its apex; change rv_size, rv_apex or a wall."
    )
