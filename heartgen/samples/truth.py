"""What is exactly true of a phantom: its surfaces, distances to them, volumes and landmarks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from heartgen.errors import InputError
from heartgen.samples import patch
from heartgen.samples.placement import Pose
from heartgen.samples.shape import Shape

Array = NDArray[np.float64]

SURFACES = ("endo", "epi", "base")
"""The pieces of the external surface of the wall; ``"all"`` means the three together."""


@dataclass(frozen=True)
class Truth:
    """The smooth wall of a phantom, free of papillary muscles, trabeculae and voxel noise.

    Attributes
    ----------
    shape : Shape
        The wall in the heart frame.
    pose : Pose
        Where it stands in the world.
    """

    shape: Shape
    pose: Pose

    @property
    def cavity_volume(self) -> float:
        """Volume of the blood pool between endocardium and base, mm^3."""
        return self.pose.scale**3 * self.shape.cavity_volume

    @property
    def wall_volume(self) -> float:
        """Volume of the myocardium, mm^3."""
        return self.pose.scale**3 * self.shape.wall_volume

    @property
    def apex(self) -> Array:
        """Pole of the endocardium, (3,) float64, mm, world (LPS)."""
        pole = self.shape.patches["endo"].point(np.zeros((1, 2)))
        return np.asarray(self.pose.to_world(pole)[0])

    @property
    def basal_plane(self) -> tuple[Array, Array]:
        """Plane about which the rims rise and fall.

        Returns
        -------
        centre : (3,) float64, mm, world (LPS)
            Where the long axis meets it.
        normal : (3,) float64
            Unit vector, away from the apex.
        """
        slope_x, slope_y = self.shape.base_slope
        upward = np.array([-slope_x, -slope_y, 1.0])
        centre = self.pose.to_world(np.array([[0.0, 0.0, self.shape.base_height]]))[0]
        return centre, self.pose.rotation @ (upward / np.linalg.norm(upward))

    @property
    def rims(self) -> tuple[Array, Array]:
        """Rims of the endocardium and epicardium, each (512, 3) float64, mm, world (LPS)."""
        inner, outer = self.shape.patches["base"].boundary
        return self.pose.to_world(inner.tree.data), self.pose.to_world(outer.tree.data)

    def area(self, surface: str = "all") -> float:
        """Area of the external surface or a piece of it, mm^2."""
        patches = self.shape.patches
        return self.pose.scale**2 * sum(patches[name].area for name in _pieces(surface))

    def surface(self, n: int, surface: str = "all") -> tuple[Array, Array]:
        """Even samples of the external surface, with the area that each stands for.

        Parameters
        ----------
        n : int
            Number of samples, shared among the pieces by area; at least 3.
        surface : {"all", "endo", "epi", "base"}
            Which piece. Samples of ``"all"`` come in the order endo, epi, base.

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
        names = _pieces(surface)
        if n < len(SURFACES):
            raise InputError(f"{n} samples are too few for a surface; ask for {len(SURFACES)}.")
        patches = [self.shape.patches[name] for name in names]
        ends = np.round(n * np.cumsum([p.area for p in patches]) / sum(p.area for p in patches))
        counts = np.maximum(np.diff(ends, prepend=0).astype(int), 1)
        counts[0] += n - counts.sum()
        parts = [patch.quadrature(p, int(c)) for p, c in zip(patches, counts, strict=True)]
        points, weights = (np.concatenate(part) for part in zip(*parts, strict=True))
        return self.pose.to_world(points), self.pose.scale**2 * weights

    def distance(self, points: ArrayLike, surface: str = "all") -> Array:
        """Distance to the external surface or a piece of it, exact to 1e-3 mm at human size.

        Parameters
        ----------
        points : (n, 3) array, mm, world (LPS)
        surface : {"all", "endo", "epi", "base"}
            Which piece; each ends at its rims.

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
        patches = self.shape.patches
        each = [patch.distance(patches[name], heart) for name in _pieces(surface)]
        return np.asarray(self.pose.scale * np.min(each, axis=0))


def _pieces(surface: str) -> tuple[str, ...]:
    """Names of the pieces that a surface name stands for."""
    if surface == "all":
        return SURFACES
    if surface not in SURFACES:
        raise InputError(f"There is no surface {surface!r}; choose all, {', '.join(SURFACES)}.")
    return (surface,)
