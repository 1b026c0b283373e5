"""`personalize`: from mask to mesh in four steps (paper, figure 1), and an optimization."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from heartgen.anatomy import Anatomy, analyze_under, rim_cone, with_hole, with_views
from heartgen.clock import Clock, Progress
from heartgen.enhancement import enhance
from heartgen.errors import InputError, recalling
from heartgen.heart_kinds import LEFT_VENTRICLE, kind_of
from heartgen.images import Mask
from heartgen.images.accepting import MaskLike, accept_all
from heartgen.images.reading import log_findings
from heartgen.mesh import HexMesh
from heartgen.mesh.hermite import RIM
from heartgen.mesh.validity import certify
from heartgen.optimization import curve_transmural_lines, fit_target, misfit, optimize, settings_for
from heartgen.options import HOLE_SHARE, Options, chosen
from heartgen.registration import Deformation, Steering, register
from heartgen.reporting import Fit, assess, report_on
from heartgen.result import Personalization
from heartgen.templates import TruncatedEllipsoid, fit_ellipsoid
from heartgen.warping import warp

__all__ = ["Personalization", "personalize", "personalize_levels"]


def personalize(
    mask: MaskLike | Sequence[MaskLike],
    options: Options | None = None,
    *,
    affine: ArrayLike | None = None,
    spacing: ArrayLike | None = None,
    progress: Progress = lambda step, done: None,
    anatomy: Anatomy | None = None,
    **choices: Any,
) -> Personalization:
    """Fit a cubic Hermite mesh of the left ventricle, or of both, to a mask.

    Parameters
    ----------
    mask : path, Mask, array, nibabel image or SimpleITK image, or sequence of them
        A binary mask of the myocardium; a file is read by `heartgen.read_mask`, a label map by
        `heartgen.read_labels`. Or a short-axis stack and further views of the same heart, such as
        long-axis slices; those that are read elsewhere, with ``view=True``.
    options : Options, optional
        Defaults to ``Options()``.
    affine : (4, 4) array-like, optional
        Of an array: voxel index (i, j, k) to world, mm, LPS. If yours is of nibabel, which has RAS,
        give the image itself, or `heartgen.mask_from_array` with ``frame="RAS"``.
    spacing : float or (3,) array-like, optional
        Of an array, in place of an affine: distance of its voxels along i, j, k, mm.
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
    >>> heartgen.personalize(mask.voxels, spacing=4.0, optimize=False).mesh.n_elements
    72
    """
    options = chosen(options, choices)
    return personalize_levels(
        mask,
        (options.lod,),
        options,
        affine=affine,
        spacing=spacing,
        progress=progress,
        anatomy=anatomy,
    )[0]


def personalize_levels(
    mask: MaskLike | Sequence[MaskLike],
    levels: Iterable[int] = (1, 2, 3, 4, 5),
    options: Options | None = None,
    *,
    affine: ArrayLike | None = None,
    spacing: ArrayLike | None = None,
    progress: Progress = lambda step, done: None,
    anatomy: Anatomy | None = None,
    **choices: Any,
) -> tuple[Personalization, ...]:
    """Fit a mask at several levels of detail; analysis, template and registration are shared.

    Parameters
    ----------
    mask : path, Mask, array, nibabel image or SimpleITK image, or sequence of them
        As for `personalize`.
    levels : iterable of int
        Levels of detail.
    options : Options, optional
        All but the level of detail.
    affine, spacing : array-like, optional
        As for `personalize`.
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
    whole, wanted = chosen(options, choices), _levels(levels)
    images = accept_all(mask, affine=affine, spacing=spacing)
    return tuple(levels_in_turn(images, wanted, whole, progress, anatomy))


def levels_in_turn(
    images: Sequence[Mask],
    levels: tuple[int, ...],
    options: Options,
    progress: Progress,
    anatomy: Anatomy | None = None,
) -> Iterator[Personalization]:
    """The results of `personalize_levels`, each as soon as it is there.

    Parameters
    ----------
    images : sequence of Mask
        The mask, and further views of the same heart.
    levels : tuple of int
        Levels of detail.
    options : Options
        All but the level of detail.
    progress : callable
        As for `personalize`.
    anatomy : Anatomy, optional
        As for `personalize`.

    Yields
    ------
    Personalization
        For each level, in the order in which they are given.
    """
    # Many small systems: one thread of the linear algebra library is fastest, and its sums do not
    # depend on the number of cores.
    with (
        threadpool_limits(1, "blas"),
        recalling(finding.message for image in images for finding in image.findings),
    ):
        yield from _personalize(images[0], images[1:], levels, options, progress, anatomy)


def _levels(levels: Any) -> tuple[int, ...]:
    """Levels of detail, at least one."""
    wanted = tuple(levels) if isinstance(levels, Iterable) else ()
    if not wanted or isinstance(levels, str):
        raise InputError(f"levels {levels!r} are none: give levels of detail, for example (1, 2)")
    return wanted


def _personalize(
    mask: Mask,
    views: Sequence[Mask],
    levels: tuple[int, ...],
    options: Options,
    progress: Progress,
    anatomy: Anatomy | None,
) -> Iterator[Personalization]:
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
            anatomy = with_hole(anatomy, rim_cone(template))
    with clock.step("registration") as done:
        deformations = register(
            template,
            anatomy.surfaces,
            anatomy.frame,
            anatomy.voxel,
            anatomy.length,
            options.passes(max(levels), _is_whole_lv(anatomy)),
            Steering(progress=done),
        )
    start = _Start(mask, anatomy, ellipsoid, template, deformations)
    for chosen_level in each:
        yield _finish(start, chosen_level, Clock(progress, clock.seconds))


@dataclass(frozen=True, eq=False)
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
    options = replace(options, elements=options.elements or kind_of(anatomy).elements)
    with clock.step("warping"):
        level, warped = _deepest_valid(start.template, deformations, options)
    with clock.step("enhancement"):
        enhanced = _straightened(warped, options)
    with clock.step("optimization") as done:
        mesh, regularized = _optimized(enhanced, anatomy, options, done)
    if options.basis == "lagrange":
        mesh = mesh.to_lagrange()
    fit = Fit(
        mask=start.mask,
        anatomy=anatomy,
        options=options,
        warped=warped,
        enhanced=enhanced,
        mesh=mesh,
        limited=start.ellipsoid.limited,
        wanted=len(deformations),
        level=level,
        regularized=regularized,
        fold_bound=deformations[level - 1].least_determinant(),
    )
    with clock.step("assessment"):
        found = assess(fit)
    report = report_on(fit, found, clock.seconds)
    seen = start.mask.findings
    log_findings((each for each in report.findings if each not in seen), start.mask.name)
    return Personalization(
        start.mask, options, anatomy, start.template, deformations, warped, enhanced, mesh, report
    )


def _template(anatomy: Anatomy, ellipsoid: TruncatedEllipsoid, options: Options) -> HexMesh:
    """Template of what the mask shows."""
    kind = kind_of(anatomy)
    elements = options.elements or kind.elements
    hole = HOLE_SHARE * anatomy.radius if options.hole_radius is None else options.hole_radius
    return kind.template(
        anatomy, elements, options.transmural_grading, options.apex, hole, ellipsoid
    )


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
    return kind_of(anatomy) is LEFT_VENTRICLE and anatomy.slices is None


def _optimized(
    mesh: HexMesh, anatomy: Anatomy, options: Options, done: Callable[[float], None]
) -> tuple[HexMesh, int]:
    """Optimized mesh, and how many elements were regularized to be valid."""
    if not options.optimize:
        return mesh, 0
    settings = settings_for(
        options.lod,
        options.quality,
        kind_of(anatomy).weights,
        anatomy.slices is not None,
        options.insertion == "rounded",
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
