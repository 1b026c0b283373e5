"""The tailored template of the left ventricle (paper, section 2.1, figure 2)."""

from __future__ import annotations

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

from heartgen.anatomy import Anatomy
from heartgen.mesh.bernstein import HERMITE_TO_BERNSTEIN, bernstein
from heartgen.mesh.hermite import chart_of, cup_topology
from heartgen.mesh.hexmesh import HexMesh
from heartgen.mesh.quadrature import gauss, gauss_square
from heartgen.mesh.surface_chart import Apex, SurfaceChart
from heartgen.templates.ellipsoid import TruncatedEllipsoid, fit_ellipsoid
from heartgen.templates.meridian import Meridians, best_meridians
from heartgen.templates.patch_map import FACE_GAUSS, Fit, fit_patch_map, radius_of
from heartgen.templates.spacing import Spacing, best_spacing

MIDDLE = 0.5
"""Depth in the wall of the surface on which a square patch is laid out."""

CHORD = 4.0
"""A cubic has slopes ``4 tan(step / 4)`` along an arc, over its radius, to meet the circle at its
middle too: six orders of the step closer than with the circle's own (Goldapp 1991, Approximation of
circular arcs by cubic polynomials)."""


def lv_template(
    anatomy: Anatomy,
    elements: tuple[int, int, int],
    graded: bool = True,
    apex: Apex = "collapsed",
    hole: float = 0.0,
    shape: TruncatedEllipsoid | None = None,
) -> HexMesh:
    """Truncated ellipsoid fitted to an anatomy, as a cubic Hermite mesh.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the elements' depth across the wall is graded for quality; otherwise linear.
    apex : {"collapsed", "hole", "patch"}
        In a pole, a hole or a square patch.
    hole : float
        Radius of the apical hole on the endocardium, mm.
    shape : TruncatedEllipsoid, optional
        The left ventricle's, by `heartgen.templates.ellipsoid.fit_ellipsoid`; fitted if omitted.

    Returns
    -------
    HexMesh
        In the world (LPS), mm; straight across the wall.
    """
    shape = shape or fit_ellipsoid(anatomy)
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
        Heart's frame, mm.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    graded : bool
        Whether the elements' depth across the wall is graded for quality; otherwise linear.
    apex : {"collapsed", "hole", "patch"}
        In a pole, a hole or a square patch.
    hole : float
        Radius of the apical hole on the endocardium, mm.

    Returns
    -------
    HexMesh
    """
    radial, around, along = elements
    chart = chart_of(apex, around, along)
    if apex == "patch":
        spacing = best_spacing(shape, elements, graded, apex, by_row=True)
        grading = spacing.grading
        endo, epi = _laid_out(shape, spacing, chart)
    else:
        meridians = best_meridians(shape, elements, graded, apex, hole)
        grading = meridians.grading
        endo, epi = (_surface(shape, meridians, depth, chart) for depth in (0, 1))
    topology = cup_topology(elements, grading, apex)
    dofs = np.zeros((radial + 1, 2, *endo.shape))
    dofs[0, 0], dofs[-1, 0] = endo, epi
    return HexMesh(topology.straightening @ dofs.reshape(-1, 3), topology)


def _laid_out(
    shape: TruncatedEllipsoid, spacing: Spacing, chart: SurfaceChart
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Degrees of freedom of endo- and epicardium whose faces are laid out on a disc."""

    def polar(row: NDArray[np.float64]) -> NDArray[np.float64]:
        return (spacing.polar(0, row) + spacing.polar(1, row)) / 2

    def surface(angle: NDArray[np.float64], row: NDArray[np.float64]) -> NDArray[np.float64]:
        return shape.points(angle, polar(row), MIDDLE)

    def even(column: NDArray[np.float64]) -> NDArray[np.float64]:
        return 2 * np.pi * column / chart.around

    patch_map = fit_patch_map(chart, 0, even, radius_of(polar, spacing.rows), surface)
    uv, _ = gauss_square(FACE_GAUSS)
    angle, row = (x.ravel() for x in patch_map.polar(uv))
    fit = Fit(chart, uv)
    endo, epi = (
        fit.dofs(shape.points(angle, spacing.polar(depth, row), depth)) for depth in (0, 1)
    )
    return endo, epi


def _surface(
    shape: TruncatedEllipsoid, meridians: Meridians, depth: int, chart: SurfaceChart
) -> NDArray[np.float64]:
    """Degrees of freedom of one surface with a pole or a hole."""
    section, _, _ = shape.semi_axes(depth)
    unit = section / np.sqrt(np.linalg.det(section))
    around, first = chart.around, chart.first_row
    step = 2 * np.pi / around
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle)], -1) @ unit.T
    turn = CHORD * np.tan(step / CHORD) * np.stack([-np.sin(angle), np.cos(angle)], -1) @ unit.T
    meridian = meridians.dofs[depth]
    center = _center_line(shape.middle(depth), meridian[..., 1], level=first == 1)
    rows = []
    if first == 1:
        pole = np.concatenate([center[0, 0], meridian[0, 0, 1:]])
        tangents = np.concatenate([meridian[0, 1, 0] * unit.T, np.zeros((2, 1))], axis=1)
        rows = [pole[None], tangents]
    flat = np.zeros((around, 1))
    for (middle, drift), ((radius, z), (widening, dz)) in zip(
        center[first:], meridian[first:], strict=True
    ):
        value = np.c_[middle + radius * ring, flat + z]
        d_around = np.c_[radius * turn, flat]
        d_along = np.c_[drift + widening * ring, flat + dz]
        d_both = np.c_[widening * turn, flat]
        rows.append(np.stack([value, d_around, d_along, d_both], 1).reshape(-1, 3))
    return np.concatenate(rows)


def _center_line(
    middle: NDArray[np.float64], height: NDArray[np.float64], level: bool
) -> NDArray[np.float64]:
    """Value and slope (rows + 1, 2, 2) of the middle of the sections, from those of their height.

    Where the axis bends, that is a least-squares fit, for a power of a cubic is no cubic.
    """
    rows = len(height) - 1
    t, _ = gauss(FACE_GAUSS)
    cubic = bernstein(t) @ HERMITE_TO_BERNSTEIN
    by_row = np.zeros((rows, len(t), 2 * (rows + 1)))
    for row in range(rows):
        by_row[row, :, 2 * row : 2 * row + 4] = cubic
    basis = by_row.reshape(rows * len(t), -1)
    z, dz = height.T
    slope = polyval(z, polyder(middle)) * dz
    out = np.stack([polyval(z, middle).T, slope.T], axis=1).reshape(-1, 2)
    free = np.ones(len(out), dtype=bool)
    free[[0, -2]] = False  # apex and base are where they are,
    free[1] = not level  # and the tangent plane of a pole is level
    missing = polyval(basis @ height.ravel(), middle).T - basis @ out
    out[free] += np.linalg.lstsq(basis[:, free], missing, rcond=None)[0]
    return np.asarray(out.reshape(-1, 2, 2))
