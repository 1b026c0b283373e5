"""How much the result depends on the optimization's weights: each halved and doubled.

usage: python -m benchmarks.sensitivity FOLDER_OR_MASK... [--lod 3] [--elements 1x12x6] [--jobs N]
                                        [--output FILE.jsonl]

Every mask is taken to the start of the optimization once, then optimized with the default weights,
and with each weight at half and at twice its default, to a valid mesh; the distance from the
patient is not bounded. `distance` is the unit of the distances: half of it is a quarter of all
other terms. Prints medians over the masks, and the largest change that any mask sees.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

import heartgen
from benchmarks.rows import Row, case_of, column, elements_of, jobs_of_masks, resume, table
from heartgen.assessment import assess_accuracy, assess_quality
from heartgen.errors import HeartgenError
from heartgen.fairness import assess_fairness
from heartgen.heart_kinds import kind_of
from heartgen.optimization import FitSettings, fit_target, optimize, settings_for

WEIGHTS = ("even", "angles", "fair", "smooth", "place", "distance", "cut", "apex")
FACTORS = (0.5, 2.0)
FIGURES = ("error", "quality", "quality_min", "scaled", "scaled_min", "along", "around")
"""Columns; the last two are the median wriggle of longitudinal and circumferential lines."""

CHANGES = {"quality": "Q", "scaled": "scaled", "along": "wriggle along"}
"""Figures of which the largest change is told, and what they are called there."""


def main() -> None:
    """Optimize and tabulate."""
    jobs, a = jobs_of_masks(__doc__, "sensitivity")
    print(report(resume(a.output, jobs, measure, a.jobs)))


def measure(job: Row) -> list[Row]:
    """One mask under all weights: a row for each."""
    path = Path(job["mask"])
    try:
        result = heartgen.personalize(
            heartgen.read_mask(path), lod=job["lod"], elements=elements_of(job["elements"])
        )
    except HeartgenError as error:
        return [{"case": case_of(path), "failure": str(error)}]
    anatomy, target = result.anatomy, fit_target(result.anatomy)
    default = settings_for(
        job["lod"],
        heart=kind_of(anatomy).weights,
        stack=anatomy.slices is not None,
        columns=result.mesh.topology.shape[1],
    )
    rows = []
    for name, settings in variants(default):
        mesh = optimize(result.enhanced, target, settings).mesh
        quality, lines = assess_quality(mesh), assess_fairness(mesh)
        rows.append(
            {
                "case": case_of(path),
                "weights": name,
                "error": assess_accuracy(mesh, anatomy.myocardium, anatomy.wall_volume).mean,
                "quality": quality.mean,
                "quality_min": quality.min,
                "scaled": quality.scaled_mean,
                "scaled_min": quality.scaled_min,
                "along": lines.longitudinal_median,
                "around": lines.circumferential_median,
                "valid": quality.valid,
            }
        )
    return rows


def variants(default: FitSettings) -> Iterator[tuple[str, FitSettings]]:
    """The settings by name, the default first."""
    yield "default", default
    for name in WEIGHTS:
        for factor in FACTORS:
            yield (
                f"{name} x {factor:g}",
                replace(default, **{name: factor * getattr(default, name)}),
            )


def report(rows: Sequence[Row]) -> str:
    """Medians, and the largest change against the default on one mask."""
    done = [r for r in rows if "error" in r]
    default = {r["case"]: r for r in done if r["weights"] == "default"}
    heads = ["weights", *FIGURES, "valid", "largest change of error"]
    heads += [f"of {name}" for name in CHANGES.values()]
    lines = []
    for name in dict.fromkeys(r["weights"] for r in done):
        group = [r for r in done if r["weights"] == name]
        line: list[object] = [name, *(float(np.median(column(group, f))) for f in FIGURES)]
        line.append(f"{sum(r['valid'] for r in group)} of {len(group)}")
        ratio = [r["error"] / default[r["case"]]["error"] - 1 for r in group]
        line.append(f"{max(ratio, key=abs):+.1%}")
        for figure in CHANGES:
            change = [r[figure] - default[r["case"]][figure] for r in group]
            line.append(f"{max(change, key=abs):+.3f}")
        lines.append(line)
    failed = [f"- {r['case']}: {r['failure']}" for r in rows if "failure" in r]
    return "\n".join([f"medians of {len(default)} masks", table(heads, lines), *failed])


if __name__ == "__main__":
    main()
