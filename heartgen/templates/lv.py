"""The tailored template of the left ventricle (paper, section 2.1, figure 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.mesh.hermite import cup_topology
from heartgen.mesh.hexmesh import HexMesh
from heartgen.templates.ellipsoid import TruncatedEllipsoid, fit_ellipsoid
from heartgen.templates.spacing import Spacing, best_spacing


def lv_template(anatomy: Anatomy, elements: tuple[int, int, int], graded: bool = True) -> HexMesh:
    """Truncated ellipsoid fitted to an anatomy, as a cubic Hermite mesh.

    Parameters
    ----------
    anatomy : Anatomy
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the elements' depth across the wall is graded for quality; otherwise linear.

    Returns
    -------
    HexMesh
        In the world (LPS), mm; straight across the wall.
    """
    shape = fit_ellipsoid(anatomy)
    return ellipsoid_mesh(shape, elements, graded).transformed(anatomy.frame)


def ellipsoid_mesh(
    shape: TruncatedEllipsoid, elements: tuple[int, int, int], graded: bool = True
) -> HexMesh:
    """Cubic Hermite mesh of a truncated ellipsoid, in the heart's frame, mm.

    Parameters
    ----------
    shape : TruncatedEllipsoid
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the elements' depth across the wall is graded for quality; otherwise linear.

    Returns
    -------
    HexMesh
    """
    radial, around, along = elements
    spacing = best_spacing(shape, radial, along, graded)
    topology = cup_topology(elements, spacing.grading)
    endo, epi = (_surface(shape, spacing, depth, around) for depth in (0, 1))
    dofs = np.zeros((radial + 1, 2, *endo.shape))
    dofs[0, 0], dofs[-1, 0] = endo, epi
    return HexMesh(topology.straightening @ dofs.reshape(-1, 3), topology)


def _surface(
    shape: TruncatedEllipsoid, spacing: Spacing, depth: int, around: int
) -> NDArray[np.float64]:
    """Surface degrees of freedom (see `heartgen.mesh.hermite`) of one surface."""
    section, axis, _ = shape.semi_axes(depth)
    step = 2 * np.pi / around
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1) @ section.T
    turn = step * np.stack([-np.sin(angle), np.cos(angle)], -1) @ section.T
    zero = np.zeros(around)
    polar, speed = spacing.value[depth], spacing.slope[depth]
    pole = shape.points(zero[:1], zero[:1], depth)
    _, opening = shape.profile(polar[:1], depth)
    tangents = np.concatenate([section.T * opening * speed[0], np.zeros((2, 1))], axis=1)
    rows = [pole, tangents]
    for p, v in zip(polar[1:], speed[1:], strict=True):
        dz = np.full(around, axis * np.sin(p) * v)
        (width,), (widening,) = shape.profile(np.array([p]), depth)
        value = shape.points(angle, zero + float(p), depth)
        sideways = shape.lean + 2 * value[0, 2] * shape.bend
        d_around = np.c_[turn * width, zero]
        d_along = np.c_[ring * widening * v + np.outer(dz, sideways), dz]
        d_both = np.c_[turn * widening * v, zero]
        rows.append(np.stack([value, d_around, d_along, d_both], 1).reshape(-1, 3))
    return np.concatenate(rows)
