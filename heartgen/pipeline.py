"""`personalize`: from mask to mesh in four steps (paper, figure 1), and an optimization."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from threadpoolctl import threadpool_limits

from heartgen.anatomy import (
    Anatomy,
    Cone,
    analyze_under,
    cone_through,
    raw_indicator,
    with_hole,
    with_views,
)
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.clock import Clock, Progress
from heartgen.coverage import assess_coverage
from heartgen.enhancement import enhance
from heartgen.errors import InputError, recalling
from heartgen.fairness import assess_fairness
from heartgen.fields import FIELDS, FiberRule, clinical_indices, make_fields
from heartgen.fields.catalog import DIRECTIONS, check_names
from heartgen.fit_findings import (
    elements_regularized,
    lod_reduced,
    min_jacobian_ratio_missed,
    template_limited,
)
from heartgen.formats import cells_of, fields_held, file_name, write_mesh, write_text
from heartgen.images import Mask
from heartgen.mesh import HexMesh, MeshField
from heartgen.mesh.hermite import RIM
from heartgen.mesh.jacobian import jacobian_ratio
from heartgen.mesh.validity import certify
from heartgen.optimization import curve_transmural_lines, fit_target, misfit, optimize, settings_for
from heartgen.options import HOLE_SHARE, Options, usual_elements
from heartgen.registration import Deformation, register
from heartgen.renamed import new_options
from heartgen.report import REPORT, Report, mask_sha256, measured, slices_of
from heartgen.templates import (
    TruncatedEllipsoid,
    biventricular_template,
    fit_ellipsoid,
    lv_template,
)
from heartgen.warping import warp

if TYPE_CHECKING:
    import pyvista


@dataclass(frozen=True)
class Personalization:
    """A mesh fitted to a patient, and everything on the way to it.

    Attributes
    ----------
    mask : Mask
        What the mesh is fitted to.
    options : Options
        Of the run.
    anatomy : Anatomy
        What the shape analysis measured.
    template : HexMesh
        The tailored template, placed on the patient.
    deformations : tuple of Deformation
        The map after each registration pass.
    warped : HexMesh
        The mesh before enhancement.
    enhanced : HexMesh
        The mesh before optimization.
    mesh : HexMesh
        The result; mm, world (LPS).
    report : Report
        How good the mesh is.

    Examples
    --------
    >>> from pathlib import Path
    >>> from tempfile import TemporaryDirectory
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> result = heartgen.personalize(mask, optimize=False)
    >>> with TemporaryDirectory() as folder:
    ...     [path.name for path in result.write(folder)]
    ['mesh.exf', 'mesh.vtu', 'report.json']
    >>> [field.name for field in result.fields(["aha", "thickness"])]
    ['aha segment', 'wall thickness']
    """

    mask: Mask
    options: Options
    anatomy: Anatomy
    template: HexMesh
    deformations: tuple[Deformation, ...]
    warped: HexMesh
    enhanced: HexMesh
    mesh: HexMesh
    report: Report = field(repr=False)

    def write(
        self,
        folder: str | Path,
        formats: tuple[str, ...] = ("exf", "vtu"),
        fields: Iterable[str | MeshField] = tuple(FIELDS),
        rule: FiberRule | None = None,
        cells: str | None = None,
    ) -> list[Path]:
        """Write the mesh and its report; each file appears whole or not at all.

        Parameters
        ----------
        folder : path
            Created if absent; gets ``mesh.exf``, ``mesh.vtu`` and ``report.json``.
        formats : tuple of str
            Names of the mesh formats, of `heartgen.formats.FORMATS`.
        fields : iterable of str or MeshField
            Fields on the mesh that go into the files that have a place for them: names of
            `heartgen.fields.FIELDS`, of which all are written if omitted, or fields of your own.
        rule : FiberRule, optional
            Angles of the fibers.
        cells : {"hex8", "hex20", "hex27", "tet4", "tet10"}, optional
            Cells for the formats of linear or quadratic cells; the usual ones of each if omitted.

        Returns
        -------
        list of Path
            The files written.
        """
        folder, fields = Path(folder), tuple(fields)
        named = check_names(name for name in fields if isinstance(name, str))
        made = self.fields(_needed(named, formats), rule)
        own = tuple(field for field in fields if isinstance(field, MeshField))
        paths: list[Path] = []
        for name in formats:
            path = folder / file_name("mesh", name)
            wanted = cells_of(name, cells)
            paths += write_mesh(self.mesh, path, (*made, *own), name, wanted).files
        write_text(self.report.to_json() + "\n", folder / REPORT)
        return [*paths, folder / REPORT]

    def fields(
        self, names: Iterable[str] | None = None, rule: FiberRule | None = None
    ) -> tuple[MeshField, ...]:
        """Make fields on the mesh.

        Parameters
        ----------
        names : iterable of str, optional
            Of `heartgen.fields.FIELDS`: material coordinates, AHA segments, fibers and their
            angles, and thickness and curvature of the wall; all if omitted.
        rule : FiberRule, optional
            Angles of the fibers.

        Returns
        -------
        tuple of MeshField
        """
        return make_fields(
            self.mesh, names, rule=rule, septal_direction=self.options.septal_direction
        )

    def plot(self, **options: Any) -> pyvista.Plotter:
        """Show the mesh over the mask's surface; options go to `heartgen.viewing.plot`.

        Parameters
        ----------
        **options : object
            As of `heartgen.viewing.plot`.
        """
        from heartgen.viewing import plot

        return plot(self, **options)


def personalize(
    mask: Mask | Sequence[Mask],
    options: Options | None = None,
    *,
    progress: Progress = lambda step, done: None,
    anatomy: Anatomy | None = None,
    **choices: Any,
) -> Personalization:
    """Fit a cubic Hermite mesh of the left ventricle, or of both, to a mask.

    Parameters
    ----------
    mask : Mask, or sequence of Mask
        From `heartgen.read_mask`; or a short-axis stack and further views of the same heart, such
        as long-axis slices, read with ``view=True``.
    options : Options, optional
        Defaults to ``Options()``.
    progress : callable
        Called with the name of the running step and the share of it that is done. It cancels the
        run by raising `heartgen.errors.Cancelled`.
    anatomy : Anatomy, optional
        What `heartgen.anatomy.analyze` gave for this mask under the same options, if it was asked
        before; it is not asked again.
    **choices : object
        Single options, such as ``lod=3``, that replace those of `options`.

    Returns
    -------
    Personalization

    Raises
    ------
    HeartgenError
        With one sentence that says what is wrong, where, and what to do.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> result = heartgen.personalize(mask, optimize=False)  # leaves out what takes longest
    >>> result.report.success
    True
    >>> result.report.accuracy.mean < 0.5  # mm
    True
    """
    options = replace(options or Options(), **new_options(choices))
    levels = (options.lod,)
    return personalize_levels(mask, levels, options, progress=progress, anatomy=anatomy)[0]


def personalize_levels(
    mask: Mask | Sequence[Mask],
    levels: Iterable[int] = (1, 2, 3, 4, 5),
    options: Options | None = None,
    *,
    progress: Progress = lambda step, done: None,
    anatomy: Anatomy | None = None,
    **choices: Any,
) -> tuple[Personalization, ...]:
    """Fit a mask at several levels of detail; analysis, template and registration are shared.

    Parameters
    ----------
    mask : Mask, or sequence of Mask
        As for `personalize`.
    levels : iterable of int
        Levels of detail.
    options : Options, optional
        All but the level of detail.
    progress : callable
        As for `personalize`.
    anatomy : Anatomy, optional
        As for `personalize`.
    **choices : object
        Single options that replace those of `options`.

    Returns
    -------
    tuple of Personalization
        The same as `personalize` gives for each level; the time of a shared step counts in each.

    Raises
    ------
    HeartgenError
        With one sentence that says what is wrong, where, and what to do.

    Examples
    --------
    >>> import heartgen
    >>> mask = heartgen.samples.ideal_cup(4.0).mask
    >>> results = heartgen.personalize_levels(mask, (1, 2), optimize=False)
    >>> [result.options.lod for result in results]
    [1, 2]
    """
    # Many small systems: one thread of the linear algebra library is fastest, and its sums do not
    # depend on the number of cores.
    with threadpool_limits(1, "blas"):
        whole = replace(options or Options(), **new_options(choices))
        images = [mask] if isinstance(mask, Mask) else list(mask)
        if not images:
            raise InputError("there is no image of the heart: give a mask, and further views of it")
        with recalling(finding.message for image in images for finding in image.findings):
            return _personalize(images[0], images[1:], tuple(levels), whole, progress, anatomy)


def _personalize(
    mask: Mask,
    views: Sequence[Mask],
    levels: tuple[int, ...],
    options: Options,
    progress: Progress,
    anatomy: Anatomy | None,
) -> tuple[Personalization, ...]:
    """The pipeline."""
    each = [replace(options, lod=lod) for lod in levels]
    clock = Clock(progress)
    with clock.step("shape analysis"):
        anatomy = anatomy or analyze_under(mask, options)
        anatomy = with_views(anatomy.uncut or anatomy, views)
    with clock.step("template"):
        ellipsoid = fit_ellipsoid(anatomy)
        template = _template(anatomy, ellipsoid, options)
        if RIM in template.topology.surfaces:
            anatomy = with_hole(anatomy, _cone(template))
    with clock.step("registration") as done:
        deformations = register(
            template,
            anatomy.surfaces,
            anatomy.frame,
            anatomy.voxel,
            anatomy.length,
            options.passes(max(levels), _is_whole_lv(anatomy)),
            done,
        )
    start = _Start(mask, anatomy, ellipsoid, template, deformations)
    return tuple(_finish(start, o, Clock(progress, clock.seconds)) for o in each)


@dataclass(frozen=True)
class _Start:
    """What the levels of detail have in common."""

    mask: Mask
    anatomy: Anatomy
    ellipsoid: TruncatedEllipsoid
    template: HexMesh
    deformations: tuple[Deformation, ...]


def _finish(start: _Start, options: Options, clock: Clock) -> Personalization:
    """Warp, enhance, optimize and assess at one level of detail."""
    anatomy, deformations = start.anatomy, start.deformations[: options.lod]
    options = replace(options, elements=options.elements or usual_elements(anatomy.rv is not None))
    with clock.step("warping"):
        level, warped = _deepest_valid(start.template, deformations, options)
    with clock.step("enhancement"):
        enhanced = _straightened(warped, options)
    with clock.step("optimization") as done:
        mesh, regularized = _optimized(enhanced, anatomy, options, done)
    if options.basis == "lagrange":
        mesh = mesh.to_lagrange()
    with clock.step("assessment"):
        slices = anatomy.slices
        accuracy = assess_accuracy(
            mesh,
            anatomy.myocardium,
            anatomy.wall_volume,
            None if slices is None else slices.outline,
            None if slices is None or not slices.shifts.any() else slices.given,
            raw_indicator(start.mask, anatomy) if slices is None else None,
        )
        quality = assess_quality(mesh)
        coverage = assess_coverage(mesh, start.mask, anatomy)
        fairness = assess_fairness(mesh, anatomy)
        unoptimized = assess_fairness(enhanced)
    report = Report(
        name=start.mask.name,
        mask_sha256=mask_sha256(start.mask),
        options=asdict(options),
        accuracy=accuracy,
        quality=quality,
        fairness=fairness,
        unenhanced_quality=float(jacobian_ratio(warped).mean()),
        unoptimized_quality=float(jacobian_ratio(enhanced).mean()),
        unoptimized_fairness=unoptimized,
        measurements=measured(anatomy, mesh),
        indices=clinical_indices(mesh, options.septal_direction),
        coverage=coverage,
        voxel_diagonal=start.mask.voxel_diagonal,
        pixel_diagonal=start.mask.pixel_diagonal,
        fold_bound=deformations[level - 1].least_determinant(),
        slices=slices_of(anatomy),
        findings=start.mask.findings
        + anatomy.findings
        + template_limited(start.ellipsoid.limited)
        + lod_reduced(len(deformations), level)
        + elements_regularized(regularized)
        + ((coverage.finding,) if coverage.finding else ())
        + min_jacobian_ratio_missed(quality.min, options.min_jacobian_ratio),
        seconds=clock.seconds,
    )
    return Personalization(
        start.mask, options, anatomy, start.template, deformations, warped, enhanced, mesh, report
    )


def _needed(fields: Iterable[str], formats: Iterable[str]) -> list[str]:
    """Names of the fields for which one of these formats has a place."""
    held = {fields_held(name) for name in formats}
    if "all" in held:
        return list(fields)
    return [name for name in fields if name == DIRECTIONS] if "directions" in held else []


def _template(anatomy: Anatomy, ellipsoid: TruncatedEllipsoid, options: Options) -> HexMesh:
    """Template of what the mask shows."""
    make = lv_template if anatomy.rv is None else biventricular_template
    elements = options.elements or usual_elements(anatomy.rv is not None)
    hole = HOLE_SHARE * anatomy.radius if options.hole_radius is None else options.hole_radius
    return make(anatomy, elements, options.transmural_grading, options.apex, hole, ellipsoid)


def _cone(template: HexMesh) -> Cone:
    """Cone through the rims of the template's apical hole."""
    radial = template.topology.index[template.topology.surfaces[RIM][:, 0], 0]
    rims = []
    for layer, face in ((0, 0.0), (radial.max(), 1.0)):
        elements = template.topology.surfaces[RIM][radial == layer, 0]
        rims.append(template.evaluate(np.array([[0.0, 0.0, face]]))[elements, 0])
    return cone_through(*rims)


def _deepest_valid(
    template: HexMesh, deformations: tuple[Deformation, ...], options: Options
) -> tuple[int, HexMesh]:
    """Warped mesh of the highest level that is proven valid, and that level.

    If the mesh is optimized afterwards, folds are no reason to fall back: they are unfolded there.
    """
    for level in range(len(deformations), 0, -1):
        warped = warp(template, deformations[level - 1])
        if options.optimize or certify(_straightened(warped, options)).all_valid:
            return level, warped
    return len(deformations), warp(template, deformations[-1])


def _straightened(warped: HexMesh, options: Options) -> HexMesh:
    """The enhanced mesh, unless that is not wanted."""
    return enhance(warped) if options.enhance else warped


def _is_whole_lv(anatomy: Anatomy) -> bool:
    """Whether there is one ventricle alone, and all of it was seen."""
    return anatomy.rv is None and anatomy.slices is None


def _optimized(
    mesh: HexMesh, anatomy: Anatomy, options: Options, done: Callable[[float], None]
) -> tuple[HexMesh, int]:
    """Optimized mesh, and how many elements were regularized to be valid."""
    if not options.optimize:
        return mesh, 0
    settings = settings_for(
        options.lod,
        options.quality,
        anatomy.rv is not None,
        anatomy.slices is not None,
        options.insertion,
        mesh.topology.shape[1],
    )
    target = fit_target(anatomy)
    # Who turns the dial up asks for quality; and a stack shows little of the surface.
    bounded = options.quality <= 1 and anatomy.slices is None
    allowed = misfit(mesh, target) if bounded else np.inf
    optimized = optimize(mesh, target, settings, allowed, options.min_jacobian_ratio, done)
    mesh = optimized.mesh
    if options.transmural_lines == "curved" and optimized.valid:
        mesh = curve_transmural_lines(mesh, options.min_jacobian_ratio, done)
    return mesh, int(optimized.regularized.sum())
