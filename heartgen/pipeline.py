"""`personalize`: from mask to mesh in four steps (paper, figure 1)."""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from heartgen.anatomy import Anatomy, analyse
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.enhancement import enhance
from heartgen.errors import InputError
from heartgen.formats import write_mesh, write_text
from heartgen.images import Finding, Mask
from heartgen.mesh import HexMesh
from heartgen.mesh.jacobian import volume
from heartgen.mesh.validity import certify
from heartgen.registration import Deformation, register
from heartgen.report import Measurements, Report
from heartgen.templates import lv_template
from heartgen.warping import warp

if TYPE_CHECKING:
    from collections.abc import Iterator

    import pyvista

STEPS = ("shape analysis", "template", "registration", "warping", "enhancement", "assessment")
ML = 1000.0
"""mm^3 in a millilitre."""

Progress = Callable[[str, float], None]
"""Called with the name of the running step and the share of it that is done; raise to cancel."""


@dataclass(frozen=True)
class Options:
    """What the user may choose.

    Attributes
    ----------
    lod : int
        Level of detail: 1, coarse and most stable, to 5, most accurate.
    elements : (int, int, int)
        Elements (radial, circumferential, longitudinal).
    truncate : float or {"auto", "off"}
        Truncation below the basal plane, mm; ``"auto"`` where valve anatomy is present.
    enhance : bool
        Straighten the mesh across the wall after warping.
    depth : {"graded", "linear"}
        Parametrisation across the wall: graded for even elements, or proportional.
    """

    lod: int = 1
    elements: tuple[int, int, int] = (1, 12, 6)
    truncate: float | Literal["auto", "off"] = "auto"
    enhance: bool = True
    depth: Literal["graded", "linear"] = "graded"

    def __post_init__(self) -> None:
        if self.lod not in range(1, 6):
            raise InputError(f"level of detail {self.lod} does not exist: choose 1 to 5")
        if len(self.elements) != 3 or any(int(n) != n or n < 1 for n in self.elements):
            raise InputError(
                f"elements {self.elements} are not three positive numbers: give radial, "
                "circumferential and longitudinal, for example 1x12x6"
            )
        if isinstance(self.truncate, str) and self.truncate not in ("auto", "off"):
            raise InputError(
                f"truncation {self.truncate!r} is not known: give a distance in mm, auto or off"
            )
        if self.depth not in ("graded", "linear"):
            raise InputError(f"depth {self.depth!r} is not known: choose graded or linear")


@dataclass(frozen=True)
class Personalization:
    """A mesh fitted to a patient, and everything on the way to it.

    Attributes
    ----------
    mask : Mask
    options : Options
    anatomy : Anatomy
        What the shape analysis measured.
    template : HexMesh
        The tailored template, placed on the patient.
    deformations : tuple of Deformation
        The map after each registration pass.
    warped : HexMesh
        The mesh before enhancement.
    mesh : HexMesh
        The result; mm, world (LPS).
    report : Report
    """

    mask: Mask
    options: Options
    anatomy: Anatomy
    template: HexMesh
    deformations: tuple[Deformation, ...]
    warped: HexMesh
    mesh: HexMesh
    report: Report = field(repr=False)

    def write(self, folder: str | Path, formats: tuple[str, ...] = ("exf", "vtu")) -> list[Path]:
        """Write the mesh and its report; each file appears whole or not at all.

        Parameters
        ----------
        folder : path
            Created if absent; gets ``mesh.exf``, ``mesh.vtu`` and ``report.json``.
        formats : tuple of str
            File name extensions of the mesh formats.

        Returns
        -------
        list of Path
            The files written.
        """
        folder = Path(folder)
        paths = [folder / f"mesh.{extension}" for extension in formats]
        for path in paths:
            write_mesh(self.mesh, path)
        write_text(self.report.to_json() + "\n", folder / "report.json")
        return [*paths, folder / "report.json"]

    def plot(self, **options: Any) -> pyvista.Plotter:
        """Show the mesh over the mask's surface; options go to `heartgen.viewing.plot`."""
        from heartgen.viewing import plot

        return plot(self, **options)


def personalize(
    mask: Mask,
    options: Options | None = None,
    *,
    progress: Progress = lambda step, done: None,
    **choices: Any,
) -> Personalization:
    """Fit a cubic Hermite mesh of the left ventricle to a mask.

    Parameters
    ----------
    mask : Mask
        From `heartgen.read_mask`.
    options : Options, optional
        Defaults to ``Options()``.
    progress : callable
        Called with the name of the running step and the share of it that is done. It cancels the
        run by raising `heartgen.errors.Cancelled`.
    **choices
        Single options, such as ``lod=3``, that replace those of `options`.

    Returns
    -------
    Personalization

    Raises
    ------
    HeartgenError
        With one sentence that says what is wrong, where, and what to do.
    """
    options = replace(options or Options(), **choices)
    clock = _Clock(progress)
    with clock.step("shape analysis"):
        anatomy = analyse(mask, options.truncate)
    with clock.step("template"):
        template = lv_template(anatomy, options.elements, graded=options.depth == "graded")
    with clock.step("registration") as done:
        deformations = register(
            template,
            anatomy.surfaces,
            anatomy.frame,
            anatomy.voxel,
            anatomy.length,
            options.lod,
            done,
        )
    with clock.step("warping"):
        level, warped = _deepest_valid(template, deformations, options.enhance)
    with clock.step("enhancement"):
        mesh = enhance(warped) if options.enhance else warped
    with clock.step("assessment"):
        accuracy = assess_accuracy(mesh, anatomy.myocardium, anatomy.wall_volume)
        quality = assess_quality(mesh)
        unenhanced = assess_quality(warped).mean if options.enhance else quality.mean
    report = Report(
        name=mask.name,
        options=asdict(options),
        accuracy=accuracy,
        quality=quality,
        unenhanced_quality=unenhanced,
        measurements=_measurements(anatomy, mesh),
        voxel_diagonal=mask.voxel_diagonal,
        fold_bound=deformations[level - 1].least_determinant(),
        findings=mask.findings + anatomy.findings + _fallen_back(options.lod, level),
        seconds=clock.seconds,
    )
    return Personalization(mask, options, anatomy, template, deformations, warped, mesh, report)


def _deepest_valid(
    template: HexMesh, deformations: tuple[Deformation, ...], straighten: bool
) -> tuple[int, HexMesh]:
    """Warped mesh of the highest level that is proven valid, and that level."""
    for level in range(len(deformations), 0, -1):
        warped = warp(template, deformations[level - 1])
        if certify(enhance(warped) if straighten else warped).all_valid:
            return level, warped
    return len(deformations), warp(template, deformations[-1])


def _fallen_back(lod: int, level: int) -> tuple[Finding, ...]:
    """Tell the user when a level of detail could not be had."""
    if level == lod:
        return ()
    message = f"level of detail {lod} folds an element: the mesh is that of level {level}"
    return (Finding("level of detail", message),)


class _Clock:
    """Times the steps and reports their progress."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.seconds: dict[str, float] = {}

    @contextmanager
    def step(self, name: str) -> Iterator[Callable[[float], None]]:
        start = time.perf_counter()
        self.progress(name, 0.0)
        yield lambda done: self.progress(name, done)
        self.progress(name, 1.0)
        self.seconds[name] = round(time.perf_counter() - start, 3)


def _measurements(anatomy: Anatomy, mesh: HexMesh) -> Measurements:
    """Sizes for the report."""
    return Measurements(
        length=anatomy.length,
        radius=anatomy.radius,
        wall_thickness=anatomy.wall_thickness,
        apex_thickness=anatomy.apex_thickness,
        truncation=anatomy.base.truncation,
        pool_volume=anatomy.pool_volume / ML,
        wall_volume=anatomy.wall_volume / ML,
        mesh_volume=volume(mesh) / ML,
    )
