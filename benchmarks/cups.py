"""The wall of a phantom's left ventricle in closed form: places, directions, coordinates."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from heartgen import samples
from heartgen.fields import HeartAxes
from heartgen.fields.axes import RIGHT_FRONT
from heartgen.samples.biv_shape import BivShape, below_base
from heartgen.samples.lv_shape import LvShape
from heartgen.samples.outline import cut_along_base
from heartgen.samples.solid import shell_point
from heartgen.samples.surface_patch import Patch

Array = NDArray[np.float64]

STEP = 1e-5
"""Of the differences that replace derivatives, in coordinates of the size of 1."""

NEWTON_STEPS = 12
"""More than a search in a smooth wall takes to rounding."""

FIRST = (41, 64, 5)
"""Places along, around and across at which that search may start."""

PROFILE = 401
"""Places along a meridian at which its length is tabulated."""


def cup_of(truth: samples.Truth) -> Cup:
    """The wall of the left ventricle of a phantom."""
    shape = truth.shape
    if isinstance(shape, LvShape):
        toward = np.asarray(RIGHT_FRONT) @ truth.pose.rotation
        return Cup(shape.patches["endo"], shape.patches["epi"], toward, shape.basal_plane[1])
    assert isinstance(shape, BivShape)
    assert shape.septum == shape.lv_wall, "one wall all around"
    below = partial(below_base, shape)
    inner, outer = (
        cut_along_base(partial(shell_point, shape.lv, offset), below).patch
        for offset in (0.0, shape.lv_wall)
    )
    middle, weights = shape.walls["septum"].patch.samples(2000)
    beside = middle * [1, 1, 0] / np.linalg.norm(middle[:, :2], axis=1, keepdims=True)
    return Cup(inner, outer, weights @ beside, shape.basal_plane[1])


@dataclass(frozen=True)
class Cup:
    """A wall between two surfaces in closed form, which straight lines join.

    Places are (q cos t, q sin t, s): the share q of the way from the pole to the rim, the angle t
    around and the depth s. Everything is in the phantom's own frame, mm.

    Attributes
    ----------
    inner, outer : Patch
    toward : (3,) float64
        Direction in which the septum lies.
    upward : (3,) float64
        Normal of the base: what runs around is parallel to it.
    """

    inner: Patch
    outer: Patch
    toward: Array
    upward: Array

    def points(self, place: Array) -> Array:
        """Points (n, 3) at places (n, 3)."""
        q, turn = np.hypot(place[:, 0], place[:, 1]), np.arctan2(place[:, 1], place[:, 0])
        share = np.mod(turn / (2 * np.pi), 1)
        inner, outer = (
            surface.point(surface.region.place(q, share)[0]) for surface in (self.inner, self.outer)
        )
        return np.asarray(inner + place[:, 2:] * (outer - inner))

    def slopes(self, place: Array) -> Array:
        """Derivatives (n, 3, 3) of the points by the coordinates of their places, last."""
        steps = STEP * np.eye(3)
        return np.stack(
            [(self.points(place + h) - self.points(place - h)) / (2 * STEP) for h in steps], -1
        )

    @cached_property
    def starts(self) -> tuple[Array, Array]:
        """Places (n, 3) all over the wall, and their points (n, 3)."""
        along, around, across = FIRST
        q, turn, s = (
            x.ravel()
            for x in np.meshgrid(
                np.linspace(0, 1, along),
                2 * np.pi * np.arange(around) / around,
                np.linspace(0, 1, across),
            )
        )
        place = np.column_stack([q * np.cos(turn), q * np.sin(turn), s])
        return place, self.points(place)

    def find(self, points: Array) -> Array:
        """Places (n, 3) of points (n, 3), which may lie a little outside of the wall."""
        places, starts = self.starts
        place = places[cKDTree(starts).query(points)[1]]
        for _ in range(NEWTON_STEPS):
            gap = points - self.points(place)
            place = place + np.linalg.solve(self.slopes(place), gap[..., None])[..., 0]
        assert np.abs(self.points(place) - points).max() < 1e-6  # the search has ended
        return place

    def directions(self, place: Array) -> tuple[Array, Array, Array]:
        """Circumferential, longitudinal and transmural unit vectors (n, 3) at places (n, 3)."""
        slopes = self.slopes(place)
        across = unit(np.cross(slopes[..., 0], slopes[..., 1]))
        across *= np.sign(np.sum(across * slopes[..., 2], axis=1, keepdims=True))
        around = unit(np.cross(self.upward, across))
        return around, np.cross(across, around), across

    @cached_property
    def profile(self) -> Array:
        """Mean share (n,) of the length from the pole to the rim at even shares q."""
        q = np.linspace(0, 1, PROFILE)
        _, around, across = FIRST
        shares = []
        for turn in 2 * np.pi * np.arange(around) / around:
            for s in np.linspace(0, 1, across):
                line = self.points(np.column_stack([q * np.cos(turn), q * np.sin(turn), 0 * q + s]))
                length = np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))
                shares.append(np.append(0, length / length[-1]))
        return np.asarray(np.mean(shares, axis=0))

    def longitudinal(self, place: Array) -> Array:
        """Longitudinal coordinate (n,) at places (n, 3): 0 at the apex to 1 at the base."""
        q = np.hypot(place[:, 0], place[:, 1])
        return np.interp(q, np.linspace(0, 1, PROFILE), self.profile)

    @cached_property
    def axes(self) -> HeartAxes:
        """Long axis and septum, by the definition of `heartgen.fields.heart_axes`."""
        turn = np.linspace(0, 2 * np.pi, PROFILE)
        rim = self.points(np.column_stack([np.cos(turn), np.sin(turn), 0 * turn]))
        spokes = rim - rim[:-1].mean(0)
        parts = np.cross(spokes[:-1], spokes[1:]) / 2
        area = parts.sum(0)
        share = parts @ area
        center = rim[:-1].mean(0) + share @ (spokes[:-1] + spokes[1:]) / (3 * share.sum())
        endo = self.inner.samples(40_000)[0]
        apex = endo[np.argmax(np.abs((endo - center) @ area))]
        axis = unit((center - apex)[None])[0]
        septal = self.toward - (self.toward @ axis) * axis
        return HeartAxes(center, apex, unit(septal[None])[0], "measured")


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) of length 1; zero stays zero."""
    size = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.maximum(size, np.finfo(float).tiny))
