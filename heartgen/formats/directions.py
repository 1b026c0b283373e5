"""Directions of fibers and sheets, orthonormal wherever they are sampled.

Between the lattice points of an element each component is cubic by itself, so that directions that
are orthonormal there are not so in between.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.field import MeshField

Array = NDArray[np.float64]

FIBER, SHEET, SHEET_NORMAL = "fiber", "sheet", "sheet normal"
"""Names of the fields of directions, 3 components each, the first of which counts most."""

ORTHONORMAL = 1e-6
"""How far lengths from 1, and cosines from 0, may be for directions to count as orthonormal."""

PARALLEL = 1e-6
"""Length, over that before, that is left of a direction which another one determines."""


def restored(fields: Sequence[MeshField], sampled: Mapping[str, Array]) -> dict[str, Array]:
    """Make sampled directions orthonormal if those of the fields are.

    Parameters
    ----------
    fields : sequence of MeshField
        Of the mesh, in any order.
    sampled : mapping of str to (..., k) float64
        Their values at the same places, by name.

    Returns
    -------
    dict of str to (..., k) float64
        The fiber's direction is kept, that of the sheet stays in their plane.
    """
    axes = [
        next((f for f in fields if f.name == name and f.components == 3), None)
        for name in (FIBER, SHEET, SHEET_NORMAL)
    ]
    found = [field for field in axes if field is not None]
    if not found or not _orthonormal([field.values for field in found]):
        return dict(sampled)
    straight = orthonormal([sampled[field.name] for field in found])
    return {**sampled, **{f.name: v for f, v in zip(found, straight, strict=True)}}


def orthonormal(directions: Sequence[Array]) -> list[Array]:
    """Up to three directions (..., 3) of unit length, each at right angles to those before.

    Where there is none, of length zero, there will be none. One that is parallel to those before is
    replaced by any across them.

    Parameters
    ----------
    directions : sequence of (..., 3) float64
        Three at most.
    """
    out: list[Array] = []
    for given in directions:
        length = np.linalg.norm(given, axis=-1, keepdims=True)
        rest = _across(given / np.where(length > 0, length, 1), out)
        lost = (length > 0) & (np.linalg.norm(rest, axis=-1, keepdims=True) < PARALLEL)
        rest = np.where(lost, _any_across(out, rest), rest)
        rest = _across(_unit(rest), out)  # twice is enough for full precision
        out.append(_unit(rest))
    return out


def _across(direction: Array, others: Sequence[Array]) -> Array:
    """What of a direction is at right angles to other ones."""
    for other in others:
        direction = direction - np.sum(direction * other, axis=-1, keepdims=True) * other
    return direction


def _any_across(others: Sequence[Array], like: Array) -> Array:
    """Any direction across at most two other ones."""
    if not others:
        return like
    second = others[1] if len(others) == 2 else np.eye(3)[np.abs(others[0]).argmin(-1)]
    return np.cross(others[0], second)


def _unit(direction: Array) -> Array:
    length = np.linalg.norm(direction, axis=-1, keepdims=True)
    return np.asarray(direction / np.where(length > 0, length, 1))


def _orthonormal(directions: Sequence[Array]) -> bool:
    """Whether directions, all given at the same places, are orthonormal everywhere."""
    if len({values.shape for values in directions}) > 1:
        return False
    axes = np.stack(directions, axis=-1)
    products = np.swapaxes(axes, -1, -2) @ axes
    return bool(np.abs(products - np.eye(len(directions))).max() <= ORTHONORMAL)
