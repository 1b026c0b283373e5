"""The building of a report: all that is measured of a fit, and all that was found on the way."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from heartgen.anatomy import Anatomy, raw_indicator
from heartgen.assessment import Accuracy, Quality, assess_accuracy, assess_quality
from heartgen.coverage import ML, Coverage, assess_coverage
from heartgen.fairness import Fairness, assess_fairness
from heartgen.fields import clinical_indices
from heartgen.fit_findings import (
    elements_regularized,
    lod_reduced,
    min_jacobian_ratio_missed,
    template_limited,
)
from heartgen.images import Mask
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import jacobian_ratio, volume
from heartgen.options import Options
from heartgen.report import Measurements, Report, RightMeasurements, SliceReport, mask_sha256


@dataclass(frozen=True, eq=False)
class Fit:
    """A fit that is to be reported.

    Attributes
    ----------
    mask : Mask
        What the mesh is fitted to.
    anatomy : Anatomy
        The patient's heart, measured.
    options : Options
        With the numbers of elements that were made.
    warped, enhanced, mesh : HexMesh
        Before enhancement, before optimization, and the result.
    limited : tuple of str
        What of the template's ellipsoid is at a bound.
    wanted, level : int
        Registration passes asked for, and those behind the mesh.
    regularized : int
        Elements that were regularized to be valid.
    fold_bound : float
        Least determinant of the deformation of that level.
    """

    mask: Mask
    anatomy: Anatomy
    options: Options
    warped: HexMesh
    enhanced: HexMesh
    mesh: HexMesh
    limited: tuple[str, ...]
    wanted: int
    level: int
    regularized: int
    fold_bound: float


@dataclass(frozen=True)
class Assessment:
    """How good a mesh is.

    Attributes
    ----------
    accuracy : Accuracy
        How far mask and mesh are apart.
    quality : Quality
        How well shaped the elements are.
    coverage : Coverage
        What of the image the mesh accounts for.
    fairness, unoptimized_fairness : Fairness
        Of the lines, and of those before the optimization.
    """

    accuracy: Accuracy
    quality: Quality
    coverage: Coverage
    fairness: Fairness
    unoptimized_fairness: Fairness


def assess(fit: Fit) -> Assessment:
    """Measure how good the mesh of a fit is.

    Parameters
    ----------
    fit : Fit
        What was made, and of what.

    Returns
    -------
    Assessment
    """
    mesh, anatomy, slices = fit.mesh, fit.anatomy, fit.anatomy.slices
    return Assessment(
        accuracy=assess_accuracy(
            mesh,
            anatomy.myocardium,
            anatomy.wall_volume,
            None if slices is None else slices.outline,
            None if slices is None or not slices.shifts.any() else slices.given,
            raw_indicator(fit.mask, anatomy) if slices is None else None,
        ),
        quality=assess_quality(mesh),
        coverage=assess_coverage(mesh, fit.mask, anatomy),
        fairness=assess_fairness(mesh, anatomy),
        unoptimized_fairness=assess_fairness(fit.enhanced),
    )


def report_on(fit: Fit, found: Assessment, seconds: dict[str, float]) -> Report:
    """Put together the report of a fit.

    Parameters
    ----------
    fit : Fit
        What was made, and of what.
    found : Assessment
        Of its mesh.
    seconds : dict of str to float
        Time of each step.

    Returns
    -------
    Report
    """
    mask, anatomy, options = fit.mask, fit.anatomy, fit.options
    coverage, quality = found.coverage, found.quality
    return Report(
        name=mask.name,
        mask_sha256=mask_sha256(mask),
        options=asdict(options),
        accuracy=found.accuracy,
        quality=quality,
        fairness=found.fairness,
        unenhanced_quality=float(jacobian_ratio(fit.warped).mean()),
        unoptimized_quality=float(jacobian_ratio(fit.enhanced).mean()),
        unoptimized_fairness=found.unoptimized_fairness,
        measurements=measured(anatomy, fit.mesh),
        indices=clinical_indices(fit.mesh, options.septal_direction),
        coverage=coverage,
        voxel_diagonal=mask.voxel_diagonal,
        pixel_diagonal=mask.pixel_diagonal,
        fold_bound=fit.fold_bound,
        slices=slices_of(anatomy),
        findings=mask.findings
        + anatomy.findings
        + template_limited(fit.limited)
        + lod_reduced(fit.wanted, fit.level)
        + elements_regularized(fit.regularized)
        + ((coverage.finding,) if coverage.finding else ())
        + min_jacobian_ratio_missed(quality.min, options.min_jacobian_ratio),
        seconds=seconds,
        mask_source=mask.source,
    )


def measured(anatomy: Anatomy, mesh: HexMesh) -> Measurements:
    """Sizes of a heart and of its mesh.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    mesh : HexMesh
        mm, world (LPS).

    Returns
    -------
    Measurements
    """
    return Measurements(
        length=anatomy.length,
        radius=anatomy.radius,
        wall_thickness=anatomy.wall_thickness,
        apex_thickness=anatomy.apex_thickness,
        truncation=anatomy.base.truncation,
        pool_volume=anatomy.pool_volume / ML,
        wall_volume=anatomy.wall_volume / ML,
        mesh_volume=volume(mesh) / ML,
        right=_right(anatomy),
    )


def slices_of(anatomy: Anatomy) -> tuple[SliceReport, ...]:
    """Heights and shifts of the slices of a stack.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.

    Returns
    -------
    tuple of SliceReport
        Empty if the mask is no stack.
    """
    if anatomy.slices is None:
        return ()
    heights = anatomy.slices.heights - anatomy.slices.heights[0]
    return tuple(
        SliceReport(float(height), (float(x), float(y), float(z)))
        for height, (x, y, z) in zip(heights, anatomy.slices.shifts, strict=True)
    )


def _right(anatomy: Anatomy) -> RightMeasurements | None:
    """Sizes of the right ventricle."""
    if anatomy.rv is None:
        return None
    low, high = np.degrees(anatomy.rv.insertion)
    return RightMeasurements(
        wall_thickness=anatomy.rv.wall_thickness,
        septal_thickness=anatomy.rv.septal_thickness,
        width=anatomy.rv.width,
        apex_level=anatomy.rv.apex_level,
        insertion=(float(low), float(high)),
        pool_volume=anatomy.rv.pool_volume / ML,
    )
