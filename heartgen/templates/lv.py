"""The tailored template of the left ventricle (paper, section 2.1, figure 2)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.mesh.hermite import cup_topology, sheet_of
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.quadrature import gauss_square
from heartgen.mesh.sheet import Sheet
from heartgen.options import Apex
from heartgen.templates.disc import FACE_GAUSS, Fit, fit_disc, radius_of
from heartgen.templates.ellipsoid import TruncatedEllipsoid, fit_ellipsoid
from heartgen.templates.spacing import Spacing, best_spacing

MIDDLE = 0.5
"""Depth in the wall of the surface on which a square patch is laid out."""


def lv_template(
    anatomy: Anatomy,
    elements: tuple[int, int, int],
    graded: bool = True,
    apex: Apex = "collapsed",
    hole: float = 0.0,
) -> HexMesh:
    """Truncated ellipsoid fitted to an anatomy, as a cubic Hermite mesh.

    Parameters
    ----------
    anatomy : Anatomy
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the elements' depth across the wall is graded for quality; otherwise linear.
    apex : {"collapsed", "hole", "patch"}
    hole : float
        Radius of the apical hole on the endocardium, mm.

    Returns
    -------
    HexMesh
        In the world (LPS), mm; straight across the wall.
    """
    shape = fit_ellipsoid(anatomy)
    return ellipsoid_mesh(shape, elements, graded, apex, hole).transformed(anatomy.frame)


def ellipsoid_mesh(
    shape: TruncatedEllipsoid,
    elements: tuple[int, int, int],
    graded: bool = True,
    apex: Apex = "collapsed",
    hole: float = 0.0,
) -> HexMesh:
    """Cubic Hermite mesh of a truncated ellipsoid, in the heart's frame, mm.

    Parameters
    ----------
    shape : TruncatedEllipsoid
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the elements' depth across the wall is graded for quality; otherwise linear.
    apex : {"collapsed", "hole", "patch"}
    hole : float
        Radius of the apical hole on the endocardium, mm.

    Returns
    -------
    HexMesh
    """
    radial, around, along = elements
    sheet = sheet_of(apex, around, along)
    spacing = best_spacing(shape, elements, graded, apex, hole, by_row=apex != "collapsed")
    topology = cup_topology(elements, spacing.grading, apex)
    if apex == "patch":
        endo, epi = _laid_out(shape, spacing, sheet)
    else:
        endo, epi = (_surface(shape, spacing, depth, sheet) for depth in (0, 1))
    dofs = np.zeros((radial + 1, 2, *endo.shape))
    dofs[0, 0], dofs[-1, 0] = endo, epi
    return HexMesh(topology.straightening @ dofs.reshape(-1, 3), topology)


def _laid_out(
    shape: TruncatedEllipsoid, spacing: Spacing, sheet: Sheet
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Degrees of freedom of endo- and epicardium whose faces are laid out on a disc."""

    def polar(row: NDArray[np.float64]) -> NDArray[np.float64]:
        return (spacing.polar(0, row) + spacing.polar(1, row)) / 2

    def surface(angle: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
        return shape.points(angle, polar(row), MIDDLE)

    def even(column: NDArray[np.float64]) -> NDArray[np.float64]:
        return 2 * np.pi * column / sheet.around

    disc = fit_disc(sheet, 0, even, radius_of(polar, spacing.value.shape[1] - 1), surface)
    uv, _ = gauss_square(FACE_GAUSS)
    angle, row = (x.ravel() for x in disc.polar(uv))
    fit = Fit(sheet, uv)
    endo, epi = (
        fit.dofs(shape.points(angle, spacing.polar(depth, row), depth)) for depth in (0, 1)
    )
    return endo, epi


def _surface(
    shape: TruncatedEllipsoid, spacing: Spacing, depth: int, sheet: Sheet
) -> NDArray[np.float64]:
    """Degrees of freedom of one surface with a pole or a hole."""
    section, axis, _ = shape.semi_axes(depth)
    around = sheet.around
    step = 2 * np.pi / around
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1) @ section.T
    turn = step * np.stack([-np.sin(angle), np.cos(angle)], -1) @ section.T
    zero = np.zeros(around)
    polar, speed = spacing.value[depth], spacing.slope[depth]
    rows = []
    if sheet.first_row == 1:
        _, opening = shape.profile(polar[:1], depth)
        tangents = np.concatenate([section.T * opening * speed[0], np.zeros((2, 1))], axis=1)
        rows = [shape.points(zero[:1], zero[:1], depth), tangents]
    for p, v in zip(polar[sheet.first_row :], speed[sheet.first_row :], strict=True):
        dz = np.full(around, axis * np.sin(p) * v)
        (width,), (widening,) = shape.profile(np.array([p]), depth)
        value = shape.points(angle, zero + float(p), depth)
        sideways = shape.lean + 2 * value[0, 2] * shape.bend
        d_around = np.c_[turn * width, zero]
        d_along = np.c_[ring * widening * v + np.outer(dz, sideways), dz]
        d_both = np.c_[turn * widening * v, zero]
        rows.append(np.stack([value, d_around, d_along, d_both], 1).reshape(-1, 3))
    return np.concatenate(rows)
