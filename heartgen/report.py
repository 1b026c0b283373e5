"""The report of one personalization: plain data that a table, a page or a file can show."""

from __future__ import annotations

import hashlib
import json
import platform
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

from heartgen.assessment import QUALITY_THRESHOLD, Accuracy, Quality
from heartgen.coverage import Coverage
from heartgen.errors import HeartgenError, InputError
from heartgen.fairness import Fairness
from heartgen.fields.indices import Indices
from heartgen.images.mask import Finding, Mask
from heartgen.options import Options
from heartgen.renamed import REPORT as FORMER
from heartgen.renamed import has_former_attributes, new_options
from heartgen.shown import as_html, in_lines

REPORT = "report.json"
"""Name of the file of a report, beside the mesh."""

PROVEN = "proven everywhere: no element folds, no two walls cross"
"""What the report says of a valid mesh."""

PACKAGES = ("heartgen", "numpy", "scipy", "numba", "SimpleITK")


@dataclass(frozen=True)
class RightMeasurements:
    """Sizes of the right ventricle, mm, ml and degrees.

    Attributes
    ----------
    wall_thickness, septal_thickness, width : float
        mm.
    apex_level : float
        Height of its lowest point over the basal plane, mm, negative.
    insertion : (float, float)
        Angles about the left ventricle's axis between which it lies, degrees.
    pool_volume : float
        ml.
    """

    wall_thickness: float
    septal_thickness: float
    width: float
    apex_level: float
    insertion: tuple[float, float]
    pool_volume: float


@dataclass(frozen=True)
class Measurements:
    """Sizes found by the shape analysis, mm and ml.

    Attributes
    ----------
    length, radius, wall_thickness, apex_thickness : float
        mm.
    truncation : float or None
        Distance below the basal plane at which the base was cut, mm.
    pool_volume, wall_volume, mesh_volume : float
        Left blood pool and wall of the mask, and volume of the mesh, ml.
    right : RightMeasurements or None
        None for a left ventricle alone.
    """

    length: float
    radius: float
    wall_thickness: float
    apex_thickness: float
    truncation: float | None
    pool_volume: float
    wall_volume: float
    mesh_volume: float
    right: RightMeasurements | None = None


@dataclass(frozen=True)
class SliceReport:
    """A slice of a short-axis stack.

    Attributes
    ----------
    height : float
        Above the first slice with data, from apex to base, mm.
    shift : (float, float, float)
        In-plane shift that was taken back, mm, world (LPS); zero if none was.
    """

    height: float
    shift: tuple[float, float, float]


@has_former_attributes(FORMER)
@dataclass(frozen=True)
class Report:
    """What was done and how good it is.

    Attributes
    ----------
    name : str
        The mask's name.
    mask_sha256 : str
        Of its voxels and their place, as of `mask_sha256`.
    options : dict
        Options of the run.
    accuracy : Accuracy
        How far mask and mesh are apart.
    quality : Quality
        How well shaped the elements are.
    fairness : Fairness
        How smoothly the lines of the mesh run.
    unenhanced_quality : float
        Mean Jacobian ratio before the enhancement step.
    unoptimized_quality : float
        Mean Jacobian ratio before the optimization step.
    unoptimized_fairness : Fairness
        Of the lines before the optimization step.
    measurements : Measurements
        Sizes of the heart.
    indices : Indices
        Clinical indices of the mesh.
    coverage : Coverage
        What of the image the mesh accounts for.
    voxel_diagonal : float
        mm; the paper's limit for the mean error.
    pixel_diagonal : float
        mm; ours: of a stack, in the plane of its slices.
    fold_bound : float
        Proven lower bound of det(I + grad u) of each link of the deformation.
    slices : tuple of SliceReport
        Of a short-axis stack, from apex to base; empty for other masks.
    findings : tuple of Finding
        What reading and shape analysis saw.
    seconds : dict of str to float
        Time of each step.
    versions : dict of str to str
        Of heartgen, Python and the libraries that shape the result.
    mask_source : dict or None
        Where the mask was read, as `Mask.source`; None if it came as an array.
    """

    name: str
    mask_sha256: str
    options: dict[str, Any]
    accuracy: Accuracy
    quality: Quality
    fairness: Fairness
    unenhanced_quality: float
    unoptimized_quality: float
    unoptimized_fairness: Fairness
    measurements: Measurements
    indices: Indices
    coverage: Coverage
    voxel_diagonal: float
    pixel_diagonal: float
    fold_bound: float
    slices: tuple[SliceReport, ...]
    findings: tuple[Finding, ...]
    seconds: dict[str, float]
    versions: dict[str, str] = field(default_factory=lambda: _versions())
    mask_source: Mapping[str, Any] | None = None

    @property
    def grain(self) -> str:
        """What the limit of our rule is the diagonal of."""
        return "pixel" if self.pixel_diagonal < self.voxel_diagonal else "voxel"

    @property
    def paper_success(self) -> bool:
        """The paper's rule (section 3.5): error below the voxel diagonal and quality above 0.33."""
        return self.accuracy.mean < self.voxel_diagonal and self.quality.mean > QUALITY_THRESHOLD

    @property
    def shortcomings(self) -> tuple[str, ...]:
        """Why the mesh is no success, in words; none if it is one.

        Our rule: the paper's, with the diagonal of a pixel for the slices of a stack; valid; and
        no finding that is serious, such as a part of the heart that is left out.
        """
        error, ratio = self.accuracy.mean, self.quality.mean
        said = {
            f"error above the {self.grain} diagonal ({error:.2f}, not below "
            f"{self.pixel_diagonal:.2f} mm)": not error < self.pixel_diagonal,
            f"quality below the threshold ({ratio:.3f}, not above {QUALITY_THRESHOLD})": (
                not ratio > QUALITY_THRESHOLD
            ),
            self.quality.faults: not self.quality.valid,
        }
        serious = (finding.message for finding in self.findings if finding.serious)
        return (*(text for text, so in said.items() if so), *serious)

    @property
    def success(self) -> bool:
        """Our rule: whether there are no `shortcomings`."""
        return not self.shortcomings

    @property
    def status(self) -> str:
        """Whether the mesh may be used, and why: one sentence for all who say it."""
        if not self.quality.valid:
            return f"not valid: {self.quality.faults}"
        if self.success:
            return (
                f"success: error below the {self.grain} diagonal ({self.pixel_diagonal:.2f} mm), "
                f"quality above {QUALITY_THRESHOLD}, valid everywhere, all of the heart covered"
            )
        by_paper = ", a success by the paper's rule" if self.paper_success else ""
        return "; ".join(self.shortcomings) + by_paper

    def to_dict(self) -> dict[str, Any]:
        """Nested dictionary of plain values."""
        return {**asdict(self), "success": self.success, "paper_success": self.paper_success}

    def to_json(self) -> str:
        """JSON text."""
        return json.dumps(self.to_dict(), indent=1, sort_keys=False, allow_nan=False)

    def __str__(self) -> str:
        a, q = self.accuracy, self.quality
        lines = [
            f"{self.name}: {self.status}",
            f"  error    mean {a.mean:.3f}  95 % {a.p95:.3f}  max {a.max:.3f} mm"
            f"  ({self.grain} diagonal {self.pixel_diagonal:.2f} mm)",
            *_raw(a),
            *_as_given(a),
            f"  quality  mean {q.mean:.3f}  min {q.min:.3f}  scaled Jacobian {q.scaled_mean:.3f}"
            f"  (threshold {QUALITY_THRESHOLD})",
            _wriggle(self.fairness, self.unoptimized_fairness),
            "  validity " + (PROVEN if q.valid else q.faults),
            f"  coverage {self.coverage.wall:.1%} of the wall, {self.coverage.contour:.1%} of the "
            "outline",
            f"  time     {sum(self.seconds.values()):.1f} s",
        ]
        return "\n".join(lines + [f"  note     {f.message}" for f in self.findings])

    def __repr__(self) -> str:
        return in_lines(str(self).splitlines(), " in print(report)")

    def _repr_html_(self) -> str:
        return as_html(repr(self))


def _raw(accuracy: Accuracy) -> list[str]:
    """The paper's error and the other direction, beside ours."""
    raw = "" if accuracy.raw_mean is None else f"unsmoothed mask {accuracy.raw_mean:.3f}  "
    return [f"           {raw}from mesh to mask {accuracy.reverse_mean:.3f} mm"]


def mask_sha256(mask: Mask) -> str:
    """SHA-256 of the voxels of a mask and of their place, in hexadecimal digits.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    """
    return hashlib.sha256(mask.voxels.tobytes() + mask.affine.tobytes()).hexdigest()


def options_beside(mesh: Path) -> Options:
    """Options that a mesh was made under.

    Parameters
    ----------
    mesh : Path
        A file of the mesh.

    Returns
    -------
    Options
        Those in the report in the same folder; the usual ones if there is no report.

    Raises
    ------
    InputError
        If the report does not say them.
    """
    path = mesh.parent / REPORT
    if not path.is_file():
        return Options()
    try:
        said = json.loads(path.read_text(encoding="utf-8"))["options"]
        return Options(**new_options(said, stored=True))
    except HeartgenError:
        raise
    except (OSError, ValueError, LookupError, AttributeError, TypeError) as error:
        raise InputError(
            f"{path}: This report does not say what the mesh beside it was made under: move it "
            "away, or fit the mask again."
        ) from error


def _as_given(a: Accuracy) -> list[str]:
    """A line on the error to slices before they were moved, if they were."""
    if a.as_given is None:
        return []
    return [f"  as given mean {a.as_given:.3f} mm, to the slices before they were moved"]


def _wriggle(f: Fairness, before: Fairness) -> str:
    """A line on how the lines run, and how the surfaces face."""
    normals = "" if f.normal_mean is None else f"  normals {f.normal_mean:.1f}"
    return (
        f"  fairness wriggle around {f.circumferential_median:.0f}  "
        f"along {f.longitudinal_median:.0f}{normals} degrees  (before optimization "
        f"{before.circumferential_median:.0f} and {before.longitudinal_median:.0f})"
    )


def _versions() -> dict[str, str]:
    """Versions that determine the result."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}
