"""What is exactly true of a phantom: its surfaces, distances to them, volumes and landmarks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.errors import InputError
from heartgen.samples.biv_shape import BivShape
from heartgen.samples.placement import Pose
from heartgen.samples.plate import Plate
from heartgen.samples.rv_truth import RightVentricle, right_ventricle
from heartgen.samples.surface_patch import Patch

Array = NDArray[np.float64]

LEAST_SAMPLES = 6
"""Fewest samples of a surface: one for each of its pieces."""


class Heart(Protocol):
    """What a truth needs to know of a shape; everything in the heart frame, mm."""

    @property
    def surfaces(self) -> Mapping[str, tuple[Patch | Plate, ...]]:
        """Pieces of the named surfaces that together bound the wall."""

    @property
    def rims(self) -> tuple[Array, ...]:
        """Where each of these surfaces but the last meets the base, (n, 3)."""

    @property
    def apex(self) -> Array:
        """Pole of the left endocardium, (3,)."""

    @property
    def basal_plane(self) -> tuple[Array, Array]:
        """Point on the long axis and normal, each (3,)."""

    @property
    def cavity_volume(self) -> float:
        """Volume of the left pool, mm^3."""

    @property
    def wall_volume(self) -> float:
        """Volume of the myocardium, mm^3."""


@dataclass(frozen=True)
class Truth:
    """The smooth wall of a phantom, free of papillary muscles, trabeculae and voxel noise.

    Its surfaces are ``endo``, ``epi`` and ``base`` with one ventricle (``lv_endo`` is understood
    as well), and ``lv_endo``, ``rv_endo``, ``epi`` and ``base`` with two.

    Attributes
    ----------
    shape : LvShape or BivShape
        The wall in the heart frame.
    pose : Pose
        Where it stands in the world.

    Examples
    --------
    >>> from heartgen import samples
    >>> truth = samples.ideal_cup(4.0).truth
    >>> truth.apex.round(3).tolist(), truth.long_axis.tolist()
    ([0.0, 0.0, -60.0], [0.0, 0.0, 1.0])
    >>> truth.distance([[0.0, 0.0, -65.0]]).round(2).tolist()  # in the middle of the wall
    [5.0]
    """

    shape: Heart
    pose: Pose

    @property
    def cavity_volume(self) -> float:
        """Volume of the left blood pool below the base, mm^3."""
        return self.pose.scale**3 * self.shape.cavity_volume

    @property
    def wall_volume(self) -> float:
        """Volume of the myocardium, mm^3."""
        return self.pose.scale**3 * self.shape.wall_volume

    @cached_property
    def rv(self) -> RightVentricle | None:
        """Sizes and landmarks of the right ventricle; None if there is none."""
        if isinstance(self.shape, BivShape):
            return right_ventricle(self.shape, self.pose)
        return None

    @property
    def apex(self) -> Array:
        """Pole of the left endocardium, (3,) float64, mm, world (LPS)."""
        return np.asarray(self.pose.to_world(self.shape.apex[None])[0])

    @property
    def long_axis(self) -> Array:
        """Unit vector along the long axis of the left ventricle, apex to base, (3,), world."""
        return np.asarray(self.pose.rotation[:, 2])

    @property
    def basal_plane(self) -> tuple[Array, Array]:
        """Plane about which the rims rise and fall.

        Returns
        -------
        center : (3,) float64, mm, world (LPS)
            Where the long axis meets it.
        normal : (3,) float64
            Unit vector, away from the apex.
        """
        center, normal = self.shape.basal_plane
        return self.pose.to_world(center[None])[0], self.pose.rotation @ normal

    @property
    def rims(self) -> tuple[Array, ...]:
        """Rims of the surfaces, in their order, each (n, 3) float64, mm, world (LPS)."""
        return tuple(self.pose.to_world(rim) for rim in self.shape.rims)

    def area(self, surface: str = "all") -> float:
        """Area of the external surface or a part of it, mm^2.

        Parameters
        ----------
        surface : str
            Which part, or ``"all"``.
        """
        return self.pose.scale**2 * sum(piece.area for piece in self._pieces(surface))

    def surface(self, n: int, surface: str = "all") -> tuple[Array, Array]:
        """Even samples of the external surface, with the area that each stands for.

        Parameters
        ----------
        n : int
            Number of samples, shared among the pieces by area; at least 6.
        surface : str
            Which part, or ``"all"``, which comes in the order of the surfaces.

        Returns
        -------
        points : (n, 3) float64, mm, world (LPS)
        weights : (n,) float64, mm^2
            Quadrature weights; their sum is the area.

        Raises
        ------
        InputError
            If there is no such surface or n is too small.
        """
        pieces = self._pieces(surface)
        if n < LEAST_SAMPLES:
            raise InputError(f"{n} samples are too few for a surface; ask for {LEAST_SAMPLES}.")
        areas = np.array([piece.area for piece in pieces])
        ends = np.round(n * np.cumsum(areas) / areas.sum())
        counts = np.maximum(np.diff(ends, prepend=0).astype(int), 1)
        counts[np.argmax(counts)] += n - counts.sum()
        parts = [piece.samples(int(c)) for piece, c in zip(pieces, counts, strict=True)]
        points, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
        return self.pose.to_world(points), self.pose.scale**2 * weights

    def distance(self, points: ArrayLike, surface: str = "all") -> Array:
        """Distance to the external surface or a part of it, exact to 1e-3 mm at human size.

        Parameters
        ----------
        points : (n, 3) array, mm, world (LPS)
            Where to measure from.
        surface : str
            Which part, or ``"all"``; each ends at its rims.

        Returns
        -------
        (n,) float64, mm
            Not negative.

        Raises
        ------
        InputError
            If there is no such surface or the points are not finite (n, 3).
        """
        world = np.asarray(points, dtype=np.float64)
        if world.shape[1:] != (3,) or world.ndim != 2 or not np.isfinite(world).all():
            raise InputError("Points must be finite, in an array of shape (n, 3), in mm (LPS).")
        heart = self.pose.to_heart(world)
        each = [piece.distance(heart) for piece in self._pieces(surface)]
        return np.asarray(self.pose.scale * np.min(each, axis=0))

    def _pieces(self, surface: str) -> tuple[Patch | Plate, ...]:
        """Pieces that a surface name stands for."""
        surfaces = self.shape.surfaces
        if surface == "all":
            return tuple(piece for pieces in surfaces.values() for piece in pieces)
        name = "endo" if surface == "lv_endo" and "endo" in surfaces else surface
        if name not in surfaces:
            raise InputError(f"There is no surface {surface!r}; choose all, {', '.join(surfaces)}.")
        return surfaces[name]
