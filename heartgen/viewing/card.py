"""What a reader wants to know of a report, as titled rows of text, for a table or a page."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from heartgen.assessment import QUALITY_THRESHOLD
from heartgen.fairness import Fairness
from heartgen.fields import Indices
from heartgen.report import Report, RightMeasurements

SURFACE_NAMES = {
    "lv_endo": "LV endocardium",
    "rv_endo": "RV endocardium",
    "rv_apex": "RV apex",
    "epi": "epicardium",
    "base": "base",
    "apical_rim": "apical hole",
}
"""What the named surfaces of a mesh are called in print."""

LEVELS = {"basal": range(1, 7), "mid": range(7, 13), "apical": range(13, 17)}
"""AHA segments of each level but the apex."""

COUNTED_FROM = {
    "measured": "the right ventricle",
    "given": "the direction given",
    "assumed": "the patient's right and front, assumed",
}
"""How it is known where the septum is."""

DIGITS = 3
"""Significant digits of a measurement: hundredths of a millimeter in a heart of 100 mm."""


@dataclass(frozen=True)
class Verdict:
    """Whether the mesh may be used.

    Attributes
    ----------
    level : {"good", "doubtful", "bad"}
        Success; valid but not a success by our rule; not valid.
    text : str
        `heartgen.report.Report.status`.
    """

    level: Literal["good", "doubtful", "bad"]
    text: str


@dataclass(frozen=True)
class Section:
    """Rows of a name and a value under a title.

    Attributes
    ----------
    title : str
        Of the table.
    rows : tuple of (str, str)
        Name and value of each measure.
    """

    title: str
    rows: tuple[tuple[str, str], ...]


def verdict(report: Report) -> Verdict:
    """The status of a result, and how it is to be colored.

    Parameters
    ----------
    report : Report
        Of a fitted mesh.
    """
    if not report.quality.valid:
        return Verdict("bad", report.status)
    return Verdict("good" if report.success else "doubtful", report.status)


def _raw(raw: float | None) -> tuple[tuple[str, str], ...]:
    """The error to the mask's own steps, if it has any."""
    return () if raw is None else (("mean, raw mask", f"{number(raw)} mm"),)


def sections(report: Report) -> tuple[Section, ...]:
    """Accuracy, quality, fairness, the heart's sizes and the time taken.

    Parameters
    ----------
    report : Report
        Of a fitted mesh.
    """
    a, q, m = report.accuracy, report.quality, report.measurements
    truncation = "none" if m.truncation is None else f"{number(m.truncation)} mm below the rim"
    return (
        Section(
            "Distance from mask to mesh",
            (
                ("mean", f"{number(a.mean)} mm"),
                ("95 % below", f"{number(a.p95)} mm"),
                ("largest", f"{number(a.max)} mm"),
                *((SURFACE_NAMES[s], f"{number(d)} mm") for s, d in a.by_surface.items()),
                *_raw(a.raw_mean),
                ("from mesh to mask", f"{number(a.reverse_mean)} mm"),
                ("overlap (Dice)", f"{a.dice:.3f}"),
                ("wall covered", f"{report.coverage.wall:.1%}"),
                ("outline covered", f"{report.coverage.contour:.1%}"),
            ),
        ),
        Section(
            "Quality of the elements",
            (
                ("Jacobian ratio, mean", f"{q.mean:.3f}"),
                ("at 2, 3 Gauss points", ", ".join(f"{q.by_gauss[n]:.3f}" for n in "23")),
                ("Jacobian ratio, least", f"{q.min:.3f}"),
                ("mean before enhancement", f"{report.unenhanced_quality:.3f}"),
                ("mean before optimization", f"{report.unoptimized_quality:.3f}"),
                ("scaled Jacobian, mean", f"{q.scaled_mean:.3f}"),
                ("scaled Jacobian, least", f"{q.scaled_min:.3f}"),
                (f"elements below {QUALITY_THRESHOLD}", f"{q.below_threshold:.0%}"),
                ("validity", "proven" if q.valid else q.faults),
            ),
        ),
        _lines(report.fairness, report.unoptimized_fairness),
        Section(
            "Left ventricle",
            (
                ("length of the cavity", f"{number(m.length)} mm"),
                ("radius of the cavity", f"{number(m.radius)} mm"),
                ("wall at mid-height", f"{number(m.wall_thickness)} mm"),
                ("wall at the apex", f"{number(m.apex_thickness)} mm"),
                ("truncation", truncation),
                ("blood pool", f"{number(m.pool_volume)} ml"),
                ("myocardium, mask", f"{number(m.wall_volume)} ml"),
                ("myocardium, mesh", f"{number(m.mesh_volume)} ml"),
            ),
        ),
        *_right(m.right),
        *_clinical(report.indices),
        Section(
            "Time",
            (
                *((step, f"{seconds:.1f} s") for step, seconds in report.seconds.items()),
                ("total", f"{sum(report.seconds.values()):.1f} s"),
            ),
        ),
    )


def _lines(f: Fairness, before: Fairness) -> Section:
    """How the lines run, and how the surfaces face."""
    rows = [
        ("wriggle around, median", degrees(f.circumferential_median)),
        ("wriggle around, worst", degrees(f.circumferential_max)),
        ("median before optimization", degrees(before.circumferential_median)),
        ("wriggle along, median", degrees(f.longitudinal_median)),
        ("wriggle along, worst", degrees(f.longitudinal_max)),
        ("median before optimization", degrees(before.longitudinal_median)),
    ]
    if f.normal_mean is not None and f.normal_p95 is not None:
        rows += [
            ("normals off by, mean", degrees(f.normal_mean)),
            ("normals off by, 95 % below", degrees(f.normal_p95)),
        ]
    return Section("Fairness of lines and surfaces", tuple(rows))


def _right(m: RightMeasurements | None) -> tuple[Section, ...]:
    """The right ventricle's sizes, if there is one."""
    if m is None:
        return ()
    rows = (
        ("free wall", f"{number(m.wall_thickness)} mm"),
        ("septum", f"{number(m.septal_thickness)} mm"),
        ("width", f"{number(m.width)} mm"),
        ("lowest point", f"{number(-m.apex_level)} mm below the base"),
        ("seen from the left one", f"{m.insertion[0]:.0f} to {m.insertion[1]:.0f} degrees"),
        ("blood pool", f"{number(m.pool_volume)} ml"),
    )
    return (Section("Right ventricle", rows),)


def _clinical(i: Indices) -> tuple[Section, ...]:
    """Clinical indices, and the thickness of the wall by segment."""
    rows = [
        ("left cavity", f"{number(i.lv_cavity_volume)} ml"),
        ("left ventricular mass", f"{number(i.lv_mass)} g"),
        ("long axis", f"{number(i.long_axis_length)} mm"),
        ("sphericity", f"{i.sphericity:.2f}"),
    ]
    if i.rv_cavity_volume is not None and i.rv_mass is not None and i.rv_lv_ratio is not None:
        rows[1:1] = [("right cavity", f"{number(i.rv_cavity_volume)} ml")]
        rows[3:3] = [("right free wall", f"{number(i.rv_mass)} g")]
        rows.append(("right over left cavity", f"{i.rv_lv_ratio:.2f}"))
    thickness = [
        (f"{level} {segments[0]}–{segments[-1]}", _listed(i, segments))
        for level, segments in LEVELS.items()
    ]
    thickness.append(("apex 17", _listed(i, (17,))))
    thickness.append(("counted from", COUNTED_FROM[i.septum]))
    return (
        Section("Clinical indices", tuple(rows)),
        Section("Wall thickness by AHA segment (mm)", tuple(thickness)),
    )


def _listed(i: Indices, segments: Iterable[int]) -> str:
    """Thicknesses of segments in a row; a dash where there is no such segment."""
    found = (i.wall_thickness.get(segment) for segment in segments)
    return " ".join("–" if value is None else f"{value:.1f}" for value in found)


def number(value: float) -> str:
    """A measurement with three significant digits, never in powers of ten above one.

    Parameters
    ----------
    value : float
        In the unit in which it is shown.
    """
    return f"{value:#.{DIGITS}g}".rstrip(".") if abs(value) < 10**DIGITS else f"{value:.0f}"


def degrees(angle: float) -> str:
    """An angle in degrees, to a tenth.

    Parameters
    ----------
    angle : float
        Degrees.
    """
    return f"{angle:.1f}°"
