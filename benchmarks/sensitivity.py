"""How much the result depends on the refinement's weights: each halved and doubled.

usage: python -m benchmarks.sensitivity FOLDER_OR_MASK... [--lod 3] [--elements 1x12x6] [--jobs N]
                                        [--output FILE.jsonl]

Every mask is taken to the start of the refinement once, then refined with the default weights, and
with each weight at half and at twice its default (one round: no element is made firmer). The scale
of the distances is a common factor of spread, shear, bending, drift (weighed against squared
distances over the squared scale), so half the scale is a quarter of the four. Prints medians over
the masks, and the largest change that any mask sees.
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
from heartgen.refinement import Weights, patient_of, refine, weights_for

WEIGHTS = ("spread", "shear", "bending", "drift", "cut")
SCALED = WEIGHTS[:4]
"""Weights against the distances in units of their scale."""

FACTORS = (0.5, 2.0)
FIGURES = ("error", "quality", "quality_min", "scaled", "scaled_min")


def main() -> None:
    """Refine and tabulate."""
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
    anatomy, patient = result.anatomy, patient_of(result.anatomy)
    rows = []
    for name, weights in variants(weights_for(job["lod"], 1.0, anatomy.rv is not None)):
        mesh = refine(result.enhanced, patient, weights)
        quality = assess_quality(mesh)
        rows.append(
            {
                "case": case_of(path),
                "weights": name,
                "error": assess_accuracy(mesh, anatomy.myocardium, anatomy.wall_volume).mean,
                "quality": quality.mean,
                "quality_min": quality.min,
                "scaled": quality.scaled_mean,
                "scaled_min": quality.scaled_min,
                "valid": quality.valid,
            }
        )
    return rows


def variants(default: Weights) -> Iterator[tuple[str, Weights]]:
    """The weights by name, the default first."""
    yield "default", default
    for name in WEIGHTS:
        for factor in FACTORS:
            yield (
                f"{name} x {factor:g}",
                replace(default, **{name: factor * getattr(default, name)}),
            )
    for factor in FACTORS:
        scaled = {name: factor**2 * getattr(default, name) for name in SCALED}
        yield f"scale x {factor:g}", replace(default, **scaled)


def report(rows: Sequence[Row]) -> str:
    """Medians, and the largest change against the default on one mask."""
    done = [r for r in rows if "error" in r]
    default = {r["case"]: r for r in done if r["weights"] == "default"}
    heads = ["weights", *FIGURES, "valid", "largest change of error", "of Q", "of scaled"]
    lines = []
    for name in dict.fromkeys(r["weights"] for r in done):
        group = [r for r in done if r["weights"] == name]
        line: list[object] = [name, *(float(np.median(column(group, f))) for f in FIGURES)]
        line.append(f"{sum(r['valid'] for r in group)} of {len(group)}")
        ratio = [r["error"] / default[r["case"]]["error"] - 1 for r in group]
        line.append(f"{max(ratio, key=abs):+.1%}")
        for figure in ("quality", "scaled"):
            change = [r[figure] - default[r["case"]][figure] for r in group]
            line.append(f"{max(change, key=abs):+.3f}")
        lines.append(line)
    failed = [f"- {r['case']}: {r['failure']}" for r in rows if "failure" in r]
    return "\n".join([f"medians of {len(default)} masks", table(heads, lines), *failed])


if __name__ == "__main__":
    main()
