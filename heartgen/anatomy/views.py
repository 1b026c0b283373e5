"""Further views of a heart whose short-axis stack is known, such as long-axis slices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy.analysis import Anatomy
from heartgen.anatomy.heart_shape import Slices
from heartgen.errors import AnatomyError
from heartgen.images.contours import contour
from heartgen.images.isosurface import Isosurface
from heartgen.images.mask import Mask
from heartgen.images.stack import slices_of

INNER = ("lv_endo", "rv_endo", "epi")
"""Surfaces that contours may show."""

REACH = 1.5
"""Distance of a contour from the surface it is taken for, at most, over the wall's thickness."""

LEAST_SHARE = 0.7
"""Share of the contours of a view, below the base, that must lie that near."""


def with_views(anatomy: Anatomy, views: Sequence[Mask]) -> Anatomy:
    """Add the contours in the slices of further views to those of a short-axis stack.

    A contour is one of the surface that the stack, interpolated, has nearest to it. What lies
    beyond the base is left out.

    Parameters
    ----------
    anatomy : Anatomy
        Of a short-axis stack.
    views : sequence of Mask
        In the same world; each with a slice or more, of whatever direction.

    Returns
    -------
    Anatomy
        With more contours in its `slices`; all else is that of the stack.

    Raises
    ------
    AnatomyError
        If the heart is no stack, or a view shows it elsewhere.
    """
    for view in views:
        if anatomy.slices is None:
            raise AnatomyError(
                f"{view.name} is a further view of a heart that is no stack of slices far apart: "
                "give the short-axis stack first, or the dense image alone"
            )
        anatomy = replace(anatomy, slices=_with_view(anatomy, anatomy.slices, view))
    return anatomy


def _with_view(anatomy: Anatomy, slices: Slices, view: Mask) -> Slices:
    """Contours of the stack, and of one view."""
    points, lengths = _contours(view)
    below = anatomy.base.surface.height(points) < 0
    points, lengths = points[below], lengths[below]
    names = [name for name in INNER if name in anatomy.surfaces]
    sampled = [anatomy.surfaces[name].sample(points) for name in names]
    away = np.abs([value for value, _ in sampled])
    nearest = away.argmin(axis=0)
    near = away.min(axis=0) < REACH * anatomy.wall_thickness
    if not len(points) or lengths[near].sum() < LEAST_SHARE * lengths.sum():
        raise AnatomyError(
            f"{view.name} shows another heart, or elsewhere: most of its contours do not lie near "
            "those of the first image; check that both are of one patient and in one frame"
        )
    contours = dict(slices.contours)
    weights = lengths * slices.distance
    slopes = [slope / np.maximum(_length(slope), np.finfo(float).tiny) for _, slope in sampled]
    for n, name in enumerate(names):
        mine = near & (nearest == n)
        part = Isosurface(points[mine], _none(), weights[mine], slopes[n][mine])
        contours[name] = _joined(contours[name], part)
    normals = np.choose(nearest[:, None], slopes)
    found = Isosurface(points[near], _none(), weights[near], normals[near])
    return replace(
        slices,
        contours=contours,
        outline=_joined(slices.outline, found),
        given=_joined(slices.given, found),
    )


def _contours(view: Mask) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points (n, 3) on the contours in the slices of a view, mm, world (LPS), and lengths (n,)."""
    stack = slices_of(view)
    points, lengths = [np.zeros((0, 3))], [np.zeros(0)]
    for pixels, height in zip(stack.pixels, stack.heights, strict=True):
        found = contour(pixels, stack.spacing)
        points.append(stack.to_world(np.c_[found.points, np.full(len(found.points), height)]))
        lengths.append(found.lengths)
    return np.concatenate(points), np.concatenate(lengths)


def _joined(one: Isosurface, other: Isosurface) -> Isosurface:
    """The points of both."""
    return Isosurface(
        np.concatenate([one.points, other.points]),
        one.triangles,
        np.concatenate([one.weights, other.weights]),
        np.concatenate([one.normals, other.normals]),
    )


def _none() -> NDArray[np.intp]:
    """No triangles."""
    return np.zeros((0, 3), dtype=np.intp)


def _length(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Length (n, 1) of vectors (n, 3)."""
    return np.asarray(np.linalg.norm(vectors, axis=1, keepdims=True))
