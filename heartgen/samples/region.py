"""Regions of the plane over which surfaces are described, each the image of the unit square."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

CURVE_KNOTS = 512
"""Intervals of the cubic spline of a boundary curve: within 1e-6 mm of the curve."""

RIM_KNOTS = 2048
"""Angles at which a rim is solved for; its periodic spline is then exact to 1e-10 mm."""

BISECTIONS = 60
"""Halvings of a bracket: enough to reach the last bit of a float64."""


class Region(Protocol):
    """What a patch needs to know of its region."""

    @property
    def closed(self) -> bool:
        """Whether v = 1 joins v = 0 smoothly."""

    def place(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Plane coordinates (n, 2), and area per unit of (q, v), (n,), at shares of 0 to 1.

        Parameters
        ----------
        q : (n,) float64
            Share of the way across the region.
        v : (n,) float64
            Share of the way along it.
        """

    def holds(self, plane: Array) -> Flags:
        """Which plane coordinates (n, 2) lie in the region, (n,).

        Parameters
        ----------
        plane : (n, 2) float64
            Plane coordinates.
        """

    def borders(self) -> list[tuple[Array, Array]]:
        """Rising parameters (n,) and plane coordinates (n, 2) of each smooth bounding curve."""


@dataclass(frozen=True, eq=False)
class Polar:
    """``inner(angle) <= radius <= outer(angle)``.

    Attributes
    ----------
    outer : callable
        Any angle (n,), rad, to the radius (n,) of the outer boundary.
    inner : callable or None
        Same for the boundary of a hole around the origin; None if there is no hole.
    """

    outer: Callable[[Array], Array]
    inner: Callable[[Array], Array] | None = None

    @property
    def closed(self) -> bool:
        """The region goes all around."""
        return True

    def place(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Share q of each ray at share v of a turn.

        Parameters
        ----------
        q : (n,) float64
            Share of the way from the inner to the outer boundary.
        v : (n,) float64
            Share of a turn.
        """
        angle = 2 * np.pi * v
        inner = np.zeros_like(angle) if self.inner is None else self.inner(angle)
        width = self.outer(angle) - inner
        radius = inner + q * width
        return _polar(radius, angle), 2 * np.pi * radius * width

    def holds(self, plane: Array) -> Flags:
        """Compare the radius with both boundaries.

        Parameters
        ----------
        plane : (n, 2) float64
            Plane coordinates.
        """
        angle = np.arctan2(plane[:, 1], plane[:, 0])
        radius = np.linalg.norm(plane, axis=1)
        above = True if self.inner is None else radius >= self.inner(angle)
        return np.asarray(above & (radius <= self.outer(angle)))

    def borders(self) -> list[tuple[Array, Array]]:
        """Inner boundary, if any, and outer one."""
        angle = np.linspace(0, 2 * np.pi, CURVE_KNOTS + 1)
        edges = [edge for edge in (self.inner, self.outer) if edge is not None]
        return [(angle, _polar(edge(angle), angle)) for edge in edges]


@dataclass(frozen=True, eq=False)
class Ruled:
    """Straight lines from each point of one curve to that of another, with common ends.

    Attributes
    ----------
    edge, rim : CubicSpline
        Share of 0 to 1 to plane coordinates (n, 2).
    gap : callable
        Plane coordinates (n, 2) to a number (n,) that is positive in the region only.
    """

    edge: CubicSpline[np.float64]
    rim: CubicSpline[np.float64]
    gap: Callable[[Array], Array]

    @property
    def closed(self) -> bool:
        """The region ends where its two curves meet."""
        return False

    def place(self, q: Array, v: Array) -> tuple[Array, Array]:
        """Share q of the line at share v of both curves.

        Parameters
        ----------
        q : (n,) float64
            Share of the way from the edge to the rim.
        v : (n,) float64
            Share of the way along both curves.
        """
        part = q[:, None]
        lines = self.rim(v) - self.edge(v)
        across = (1 - part) * self.edge(v, 1) + part * self.rim(v, 1)
        stretch = lines[:, 0] * across[:, 1] - lines[:, 1] * across[:, 0]
        return self.edge(v) + part * lines, np.abs(stretch)

    def holds(self, plane: Array) -> Flags:
        """Ask the gap.

        Parameters
        ----------
        plane : (n, 2) float64
            Plane coordinates.
        """
        return np.asarray(self.gap(plane) > 0)

    def borders(self) -> list[tuple[Array, Array]]:
        """Edge and rim."""
        share = np.linspace(0, 1, CURVE_KNOTS + 1)
        return [(share, self.edge(share)), (share, self.rim(share))]


def last_inside(inside: Callable[[Array, Array], Flags], limit: float) -> CubicSpline[np.float64]:
    """Periodic spline over the angle of the radius, between 0 and limit, where inside ends.

    Parameters
    ----------
    inside : callable
        Whether places are inside, (n,) bool, by their radius (n,) and angle (n,), rad.
    limit : float
        Largest radius.
    """
    angle = np.linspace(0, 2 * np.pi, RIM_KNOTS + 1)
    low, high = np.zeros_like(angle), np.full_like(angle, limit)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        within = inside(middle, angle)
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    low[-1] = low[0]
    return CubicSpline(angle, low, bc_type="periodic")


def _polar(radius: Array, angle: Array) -> Array:
    """Plane coordinates (n, 2) of polar ones."""
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])
