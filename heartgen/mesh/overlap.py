"""Test that the walls of a mesh do not cross: that its external surface does not meet itself.

det J > 0 everywhere keeps elements from folding, not one wall from passing through another. Here
the external surface is sampled so finely that flat triangles lie within a quarter of `DEPTH` of it,
and no two of these may cross: the sampled surface has no self-crossing deeper than `DEPTH`.

Only where boxes around two pieces meet are these split into quarters, down to the triangles, and
only if they are not so flat that they cannot meet but where they belong together
(`heartgen.mesh.flatness`): nearly all are.
"""

from __future__ import annotations

from typing import TypeAlias

import numba as nb
import numpy as np
from numpy.typing import NDArray

from heartgen.mesh.bernstein import DEGREE, ORDER
from heartgen.mesh.flatness import meet_properly, one_to_one
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.subdivisions import apart, split, whole_faces
from heartgen.mesh.surface_faces import face_control
from heartgen.mesh.triangles import quads_cross

Array: TypeAlias = NDArray[np.float64]

DEPTH = 0.01
"""Depth of a crossing that is found for certain, mm: far below a voxel, and the errors of a fit."""

CHORD = 0.25
"""Distance between surface and triangles, as a share of the depth. Two surfaces lie so far from
theirs: below 0.5, what is deeper crosses, and what is farther apart does not."""

TOUCH = 1e-6
"""Distance, as a share of the depth, below which points are the same and nothing is crossed: what
belongs to two faces is computed from both, and differs by rounding."""

MOST_LEVELS = 9
"""Times that a face is halved at most, for 512 pieces a side."""

MOST_LOOKED_AT = 1_000_000
"""Pairs of pieces that are looked at, at most, of two faces: twenty times what any of 5 hearts'
valid meshes needed. Of faces that nearly meet along a whole fold it cannot be told in reasonable
time."""

STACK = 256
"""Room for pairs that wait: 9 more for each level of a piece against itself, 6 for one of two."""


def overlapping(
    mesh: HexMesh, depth: float = DEPTH, folded: NDArray[np.bool_] | None = None
) -> NDArray[np.bool_]:
    """Find elements whose external faces cross others.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    depth : float
        Depth of crossing that is found for certain, mm. The surface is sampled within a quarter of
        it, so that shallower crossings may be found, and gaps of up to half of it be taken for one.
    folded : (e,) bool, optional
        Elements that are known to fold. Whether two of them cross is not asked: it would take long,
        for folds nearly touch themselves, and neither is valid.

    Returns
    -------
    (e,) bool
        True where a face of the element crosses another one or itself. Also where that cannot be
        told: of a face that bends too much to be sampled so finely, that nearly meets another one
        along a fold, or is not made of numbers.
    """
    faces = mesh.topology.external
    patches = np.ascontiguousarray(face_control(mesh, faces))
    with np.errstate(invalid="ignore"):
        bend = _bend(patches)
    told = bend <= 4.0**MOST_LEVELS * CHORD * depth  # not so of what is not a number
    levels = np.log2(max(bend.max(initial=0.0, where=told) / (CHORD * depth), 1.0)) / 2
    crossed = ~told
    known = np.zeros(len(faces), dtype=np.bool_) if folded is None else folded[faces[:, 0]]
    crossed[told] = _crossed(patches[told], known[told], int(np.ceil(levels)), TOUCH * depth)
    out = np.zeros(mesh.n_elements, dtype=np.bool_)
    out[faces[crossed, 0]] = True
    return out


def _bend(patches: Array) -> Array:
    """Bound (f,) of the distance of bicubic patches (f, 16, 3) from two flat triangles each, mm.

    It is (|S_uu| + 2 |S_uv| + |S_vv|) / 8, and a quarter of it for every halving of the edges
    (Filip, Magedson & Markot 1986, doi:10.1016/0167-8396(86)90005-1).
    """
    p = patches.reshape(-1, ORDER, ORDER, 3)
    second = DEGREE * (DEGREE - 1)
    along, across = second * np.diff(p, 2, axis=2), second * np.diff(p, 2, axis=1)
    mixed = DEGREE**2 * np.diff(np.diff(p, axis=1), axis=2)
    along, mixed, across = (np.linalg.norm(d, axis=-1).max((1, 2)) for d in (along, mixed, across))
    return np.asarray((along + 2 * mixed + across) / 8)


@nb.njit(cache=True)
def _crossed(patches, known, levels, touch):  # type: ignore[no-untyped-def]
    """Which faces (f,) cross another one, or themselves; not asked of two that are known (f,)."""
    n_faces = len(patches)
    crossed = np.zeros(n_faces, dtype=np.bool_)
    tree = whole_faces(patches)
    boxes = tree[1][:n_faces].copy()
    stack = np.empty((STACK, 2), dtype=np.int64)
    order = np.argsort(boxes[:, 0], kind="mergesort")
    for rank in range(n_faces):
        a = order[rank]
        for other in range(rank, n_faces):
            b = order[other]
            if boxes[b, 0] > boxes[a, 3]:
                break
            asked = not (crossed[a] or known[a]) or not (crossed[b] or known[b])
            if not asked or apart(boxes, a, b):
                continue
            tree, cross = _cross(tree, a, b, stack, levels, touch)
            if cross:
                crossed[a] = crossed[b] = True
    return crossed


@nb.njit(cache=True)
def _cross(tree, a, b, stack, levels, touch):  # type: ignore[no-untyped-def]
    """Whether two faces cross, or one itself; and the tree, grown where they were looked at."""
    stack[0, 0], stack[0, 1] = a, b
    waiting, looked_at = 1, 0
    while waiting:
        looked_at += 1
        if looked_at > MOST_LOOKED_AT:
            return tree, True
        waiting -= 1
        a, b = stack[waiting]
        level_a, level_b = tree[4][a], tree[4][b]
        if a == b:
            if level_a == levels or one_to_one(tree, a, touch):
                continue
            tree = split(tree, a)
            for c in range(4):
                for d in range(c, 4):
                    stack[waiting, 0], stack[waiting, 1] = tree[3][a] + c, tree[3][a] + d
                    waiting += 1
            continue
        if apart(tree[1], a, b):
            continue
        if meet_properly(tree, a, b, touch):
            continue
        if level_a == level_b == levels:
            if quads_cross(tree[0][a], tree[0][b], touch):
                return tree, True
            continue
        if level_b < level_a:
            a, b = b, a
        tree = split(tree, a)
        for c in range(4):
            stack[waiting, 0], stack[waiting, 1] = tree[3][a] + c, b
            waiting += 1
    return tree, False
