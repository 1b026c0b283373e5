"""Error against quality, of the paper's four steps and of the default, at every level of detail.

usage: python -m benchmarks.pareto FOLDER_OR_MASK... [--elements 1x12x6] [--levels 1,2,3,4,5]
                                   [--in-voxels FOLDER_NAME...] [--jobs N] [--output FILE.jsonl]

Stores a row per mask, pipeline and level (resumable: only what is missing is fitted), prints the
two pipelines side by side, the cases on which the default is worse than the paper's pipeline at the
same level, and those on which error or quality do not fall from level to level, and draws the
medians, quartiles and single cases next to the rows, as FILE.png. Folders named in --in-voxels are
measured in their voxel rather than in mm, so that hearts of other sizes can join the human ones.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np

import heartgen
from benchmarks.rows import Row, case_of, column, elements_of, masks_of, resume, table
from heartgen.assessment import QUALITY_THRESHOLD
from heartgen.errors import HeartgenError

PIPELINES = {"paper": False, "heartgen": True}
"""Names of the pipelines, and whether they optimize."""

FIELD_STYLES = {"paper": ("#D55E00", "s"), "heartgen": ("#0072B2", "o")}
"""Colors that every kind of color vision tells apart (Okabe & Ito), and markers."""

ERROR_TOLERANCE = 1.02
"""Largest error, relative to the paper's or to the level's before, that counts as no worse."""

QUALITY_TOLERANCE = 0.005
"""Largest loss of Q that counts as no worse, and largest rise that counts as none."""

NAMED = 12
"""Offenders named."""

INCHES, DOTS = (7.5, 5.5), 150


def main() -> None:
    """Fit, tabulate and draw."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("masks", type=Path, nargs="+")
    parser.add_argument("--elements")
    parser.add_argument("--levels", default="1,2,3,4,5")
    parser.add_argument("--in-voxels", nargs="*", default=[])
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path, default=Path("benchmarks/results/pareto.jsonl"))
    a = parser.parse_args()
    jobs = [
        {"mask": str(p), "pipeline": name, "elements": a.elements, "levels": a.levels}
        for p in masks_of(a.masks)
        for name in PIPELINES
    ]
    rows = resume(a.output, jobs, fit, a.jobs)
    for row in rows:
        row["shown"] = row.get("error", np.nan)
        if Path(row["job"]["mask"]).parent.name in a.in_voxels:
            row["shown"] = row.get("voxels", np.nan)
    print(report(rows))
    picture = a.output.with_suffix(".png")
    draw([r for r in rows if "error" in r], picture, a.elements or "default elements")
    print(f"\nplot: {picture}")


def fit(job: Row) -> list[Row]:
    """One mask through one pipeline, at all levels."""
    path, levels = Path(job["mask"]), [int(k) for k in job["levels"].split(",")]
    choices = {"optimize": PIPELINES[job["pipeline"]], "elements": elements_of(job["elements"])}
    common = {"case": case_of(path), "set": path.parent.name, "pipeline": job["pipeline"]}
    try:
        results = heartgen.personalize_levels(heartgen.read_mask(path), levels, **choices)
    except HeartgenError as error:
        return [common | {"lod": k, "failure": str(error)} for k in levels]
    return [
        common
        | {
            "lod": lod,
            "error": r.report.accuracy.mean,
            "voxels": r.report.accuracy.mean / r.anatomy.voxel,
            "p95": r.report.accuracy.p95,
            "max": r.report.accuracy.max,
            "quality": r.report.quality.mean,
            "quality_min": r.report.quality.min,
            "scaled": r.report.quality.scaled_mean,
            "scaled_min": r.report.quality.scaled_min,
            "along": r.report.fairness.longitudinal_median,
            "around": r.report.fairness.circumferential_median,
            "valid": r.report.quality.valid,
            "lod_reduced": any(f.check == "level of detail" for f in r.report.findings),
            "seconds": sum(r.report.seconds.values()),
        }
        for lod, r in zip(levels, results, strict=True)
    ]


def report(rows: Sequence[Row]) -> str:
    """Tables and checks, as markdown."""
    done = [r for r in rows if "error" in r]
    failed = [r for r in rows if "failure" in r]
    parts = [side_by_side(done), not_worse(done), falling(done)]
    names = sorted({f"- {r['case']}, {r['pipeline']}: {r['failure']}" for r in failed})
    if names:
        parts.append("Not fitted:\n" + "\n".join(names))
    return "\n\n".join(parts)


def side_by_side(rows: Sequence[Row]) -> str:
    """Median and worst figures of both pipelines; wriggle in degrees."""
    heads = ["set", "LoD", "pipeline", "cases", "error median", "error worst", "Q median"]
    heads += ["Q worst", "scaled median", "scaled worst"]
    heads += ["wriggle along median", "worst", "wriggle around median", "worst", "valid"]
    sets = sorted({r["set"] for r in rows})
    groups = [(s, [r for r in rows if r["set"] == s]) for s in sets]
    if len(sets) > 1:
        groups.append(("all", list(rows)))
    lines = []
    for name, members in groups:
        for lod, pipeline in _conditions(members):
            r = [x for x in members if (x["lod"], x["pipeline"]) == (lod, pipeline)]
            e, q, j = (column(r, n) for n in ("shown", "quality", "scaled"))
            spread = [np.median(e), e.max(), np.median(q), q.min(), np.median(j), j.min()]
            for wriggle in (column(r, n) for n in ("along", "around")):
                spread += [np.median(wriggle), wriggle.max()]
            valid = sum(x["valid"] for x in r)
            lines.append([name, lod, pipeline, len(r), *map(float, spread), f"{valid} of {len(r)}"])
    return table(heads, lines)


def _conditions(rows: Sequence[Row]) -> Iterator[tuple[int, str]]:
    """Levels and pipelines that have rows."""
    for lod in sorted({r["lod"] for r in rows}):
        for pipeline in PIPELINES:
            if any((r["lod"], r["pipeline"]) == (lod, pipeline) for r in rows):
                yield lod, pipeline


def not_worse(rows: Sequence[Row]) -> str:
    """Cases and levels on which the default is worse than the paper's pipeline."""
    paper = {(r["job"]["mask"], r["lod"]): r for r in rows if r["pipeline"] == "paper"}
    pairs = [
        (r, paper[r["job"]["mask"], r["lod"]])
        for r in rows
        if r["pipeline"] == "heartgen" and (r["job"]["mask"], r["lod"]) in paper
    ]
    names = [f"{ours['case']} LoD {ours['lod']}" for ours, _ in pairs]
    error = [ours["shown"] / theirs["shown"] for ours, theirs in pairs]
    quality = [theirs["quality"] - ours["quality"] for ours, theirs in pairs]
    return "\n".join(
        [
            f"The default against the paper's pipeline, {len(pairs)} cases and levels:",
            _offenders(
                "error worse by more than 2 %", zip(error, names, strict=True), ERROR_TOLERANCE
            ),
            _offenders(
                "Q worse by more than 0.005", zip(quality, names, strict=True), QUALITY_TOLERANCE
            ),
        ]
    )


def falling(rows: Sequence[Row]) -> str:
    """Cases on which error or quality do not fall from level to level."""
    lines = ["From each level to the next:"]
    for pipeline in PIPELINES:
        series: dict[str, list[Row]] = {}
        for r in (r for r in rows if r["pipeline"] == pipeline):
            series.setdefault(r["job"]["mask"], []).append(r)
        error, rise, fall = [], [], []
        for members in series.values():
            members.sort(key=lambda r: r["lod"])
            for low, high in pairwise(members):
                name = f"{low['case']} LoD {low['lod']} to {high['lod']}"
                error.append((high["shown"] / low["shown"], name))
                rise.append((high["quality"] - low["quality"], name))
                fall.append(low["quality"] - high["quality"])
        if error:
            lines += [
                _offenders(f"{pipeline}: error rises", error, 1.0),
                _offenders(f"{pipeline}: error rises by more than 2 %", error, ERROR_TOLERANCE),
                _offenders(f"{pipeline}: Q rises by more than 0.005", rise, QUALITY_TOLERANCE),
                f"- {pipeline}: largest fall of Q {max(fall):.3f}",
            ]
    return "\n".join(lines)


def _offenders(what: str, figures: Iterable[tuple[float, str]], limit: float) -> str:
    """How many figures exceed a limit, and which, the worst first."""
    figures = list(figures)
    beyond = sorted((f for f in figures if f[0] > limit), reverse=True)
    named = "; ".join(f"{name} ({value:.3f})" for value, name in beyond[:NAMED])
    more = f"; and {len(beyond) - NAMED} more" if len(beyond) > NAMED else ""
    worst = max((f[0] for f in figures), default=np.nan)
    return f"- {what}: {len(beyond)} (largest {worst:.3f}){': ' + named + more if beyond else ''}"


def draw(rows: Sequence[Row], path: Path, title: str) -> None:
    """Error against quality: single cases faint, medians with quartiles, a line by pipeline."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(figsize=INCHES, layout="constrained")
    for pipeline, (color, marker) in FIELD_STYLES.items():
        middle = []
        for lod in sorted({r["lod"] for r in rows}):
            r = [x for x in rows if (x["lod"], x["pipeline"]) == (lod, pipeline)]
            if not r:
                continue
            e, q = (np.percentile(column(r, n), (25, 50, 75)) for n in ("shown", "quality"))
            points = column(r, "shown"), column(r, "quality")
            axes.plot(*points, marker, color=color, alpha=0.15, markersize=3, zorder=1)
            bars = [[e[1] - e[0]], [e[2] - e[1]]], [[q[1] - q[0]], [q[2] - q[1]]]
            axes.errorbar(e[1], q[1], xerr=bars[0], yerr=bars[1], color=color, capsize=3, zorder=3)
            axes.annotate(
                str(lod),
                (e[1], q[1]),
                xytext=(-8, 8),
                textcoords="offset points",
                ha="right",
                color=color,
                weight="bold",
            )
            middle.append((e[1], q[1]))
        if middle:
            label = {"paper": "the paper's four steps", "heartgen": "heartgen's default"}[pipeline]
            line = np.transpose(middle)
            axes.plot(*line, marker=marker, color=color, label=label, zorder=2)
    axes.axhline(QUALITY_THRESHOLD, color="0.4", linestyle="--", linewidth=1)
    axes.annotate(
        f"success: Q above {QUALITY_THRESHOLD}",
        (1, QUALITY_THRESHOLD),
        xycoords=("axes fraction", "data"),
        xytext=(-4, 3),
        textcoords="offset points",
        ha="right",
        color="0.4",
    )
    unit = "mm" if all(r["shown"] == r["error"] for r in rows) else "mm, or voxels of small hearts"
    cases = len({r["job"]["mask"] for r in rows})
    axes.set_xlabel(f"mean distance from the mask's surface to the mesh ({unit})")
    axes.set_ylabel("mean Jacobian ratio Q")
    axes.set_title(f"{cases} hearts, {title}, levels of detail 1 to 5: medians and quartiles")
    axes.legend()
    axes.grid(alpha=0.2)
    figure.savefig(path, dpi=DOTS)
    plt.close(figure)


if __name__ == "__main__":
    main()
