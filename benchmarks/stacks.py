"""Short-axis stacks: as the clinic has them, and made from dense masks whose truth is known.

usage: python -m benchmarks.stacks fit STACKS... [--score SCORE.py] [--fairness FAIRNESS.py]
                                                 [--every N]
       python -m benchmarks.stacks distance [DENSE...] [--cases 10]
       python -m benchmarks.stacks shifts [DENSE...] [--cases 20]
       python -m benchmarks.stacks noise [DENSE...] [--cases 10]
each with [--lod K] [--elements RxCxL] [--set NAME=VALUE,...] [--jobs N] [--output FILE.jsonl]

fit: every stack of some folders is fitted to the contours in its slices: success, meshes proven
valid, errors, qualities and wriggle of the lines, and what failed and why. With --score, an
independent script ``SCORE.py`` with a function ``score(mask, [mesh])`` measures each mesh, too, and
with --fairness one with a function ``fairness(elements, mask)``, see `benchmarks.hearts`. With
--every, only the first of every N stacks is fitted.

The others make stacks from dense masks, whose third index axis must be the long axis of the heart
(--cases of them, evenly chosen; phantoms if none are given), and measure the error to the dense
mask's surface.
distance: slices 4 to 20 mm apart, from two beginnings each, against the dense fit.
shifts: slices 8 mm apart, each shifted in its plane at random (without mean and trend, which are
place and tilt of the heart), with shifts taken back and not: how much of the error that they add
is taken back, and whether any is added where there are none.
noise: slices 8 mm apart, and the dense mask, with a fifth of the pixels at the boundary flipped,
with holes, islands, a slice missing in the middle, gaps in the wall: successes. Stacks may be
given, too: they are spoiled as they are, and have no truth.

Stores what it measures (resumable: only what is missing is fitted).
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import heartgen
from benchmarks.hearts import fit, summary
from benchmarks.phantoms import written
from benchmarks.rows import Row, case_of, column, elements_of, masks_of, resume, table
from benchmarks.sparse import DEFECTS, breathing, count, short_axis
from heartgen.anatomy import Anatomy, analyze
from heartgen.assessment import assess_accuracy
from heartgen.errors import HeartgenError
from heartgen.images import Mask

DISTANCES = (4.0, 8.0, 10.0, 14.0, 20.0)
"""Between slices, mm."""

BEGINNINGS = (0.25, 0.75)
"""Places of the first slice after the beginning of the heart, over the distance."""

DEVIATIONS = (0.0, 2.0, 3.0)
"""Of the shifts, mm."""

USUAL = 8.0
"""Distance of the slices that are shifted or carelessly segmented, mm."""

SIDES = ("lv_endo", "rv_endo", "epi")
"""Surfaces that do not depend on where the uppermost slice ends."""


def main() -> None:
    """Fit and tabulate."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("what", choices=("fit", *STUDIES))
    parser.add_argument("masks", type=Path, nargs="*")
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--lod", type=int, default=3)
    parser.add_argument("--elements")
    parser.add_argument("--score", type=Path)
    parser.add_argument("--fairness", type=Path)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--set", default="")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--output", type=Path)
    a = parser.parse_args()
    output = a.output or Path(f"benchmarks/results/stacks-{a.what}.jsonl")
    common = {"what": a.what, "lod": a.lod, "elements": a.elements, "set": a.set}
    if a.what == "fit":
        common["score"] = None if a.score is None else str(a.score)
        if a.fairness is not None:
            common["fairness"] = str(a.fairness)
        jobs = [{"mask": str(p)} | common for p in masks_of(a.masks)[:: a.every]]
        print(summary(resume(output, jobs, given, a.jobs), len(jobs), (a.lod,)))
        return
    print(STUDIES[a.what][1](rows_of(a.masks, common, a.cases, a.jobs, output)))


def rows_of(
    places: Sequence[Path], common: Row, cases: int, processes: int, output: Path
) -> list[Row]:
    """Measure some of the dense masks of some places, or phantoms if there is none."""
    masks = masks_of(places) if places else written(output.parent / "phantoms")
    chosen = [
        masks[n] for n in np.unique(np.linspace(0, len(masks) - 1, cases).round().astype(int))
    ]
    jobs = [{"mask": str(p), "seed": n} | common for n, p in enumerate(chosen)]
    return resume(output, jobs, made, processes)


def given(job: Row) -> list[Row]:
    """A stack as it is: a row."""
    scripts = {name: job[name] for name in ("score", "fairness") if job.get(name) is not None}
    return fit((job["mask"], (job["lod"],), choices_of(job), {job["lod"]: scripts}))


def made(job: Row) -> list[Row]:
    """Stacks made of a dense mask: a row each."""
    mask = heartgen.read_mask(job["mask"])
    dense = analyze(mask) if mask.stack_axis is None else None
    return [
        {"case": case_of(Path(job["mask"]))} | conditions | fitted(stack, dense, job, choices)
        for conditions, stack, choices in STUDIES[job["what"]][0](mask, job["seed"])
    ]


def fitted(stack: Mask, dense: Anatomy | None, job: Row, choices: Row) -> Row:
    """Figures of one fit."""
    try:
        result = heartgen.personalize(stack, lod=job["lod"], **choices_of(job), **choices)
    except HeartgenError as error:
        return {"failure": str(error)}
    report = result.report
    slices = result.anatomy.slices
    return against(result, dense) | {
        "error": report.accuracy.mean,
        "quality": report.quality.mean,
        "valid": report.quality.valid,
        "success": report.success,
        "paper_success": report.paper_success,
        "moved": bool(slices is not None and slices.shifts.any()),
    }


def against(result: heartgen.Result, dense: Anatomy | None) -> Row:
    """Error to the truth, where there is one."""
    if dense is None:
        return {"truth": float("nan")}
    truth = assess_accuracy(result.mesh, dense.myocardium, dense.wall_volume)
    sides = [truth.by_surface[s] for s in SIDES if s in truth.by_surface]
    return {"truth": truth.mean, "sides": float(np.mean(sides))}


def choices_of(job: Row) -> Row:
    """Options of a job."""
    from heartgen.options import settings_from_text

    found = settings_from_text(filter(None, job["set"].split(",")))
    choices: Row = {name: values[0] for name, values in found.items()}
    if job["elements"] is not None:
        choices["elements"] = elements_of(job["elements"])
    return choices


def at_distances(mask: Mask, seed: int) -> Any:
    """The dense mask, and slices farther and farther apart."""
    yield {"distance": 0.0, "beginning": 0.0}, mask, {}
    for distance in DISTANCES:
        for beginning in BEGINNINGS:
            stack = short_axis(mask, distance, beginning)
            yield {"distance": distance, "beginning": beginning}, stack, {}


def shifted(mask: Mask, seed: int) -> Any:
    """Slices with shifts, to be taken back or not."""
    slices = count(short_axis(mask, USUAL))
    for deviation in DEVIATIONS:
        stack = short_axis(mask, USUAL, shifts=breathing(slices, deviation, seed))
        for shifts in ("off", "auto"):
            yield {"deviation": deviation, "shifts": shifts}, stack, {"slice_alignment": shifts}


def spoiled(mask: Mask, seed: int) -> Any:
    """Slices, and the dense mask, with one defect each, as the reader takes them."""
    wholes = {"stack": short_axis(mask, USUAL), "dense": mask}
    if mask.stack_axis is not None:
        wholes = {"stack": mask}
    for kind, whole in wholes.items():
        for name, spoil in DEFECTS.items():
            bad = spoil(whole, np.random.default_rng(seed))
            read = heartgen.mask_from_array(bad.voxels, bad.affine, name=bad.name)
            yield {"defect": name, "of": kind}, read, {}


def distance_table(rows: Sequence[Row]) -> str:
    """Medians by distance."""
    heads = ["distance (mm)", "stacks", "error to the truth (mm)", "above dense", "worst"]
    heads += ["sides only", "to the slices", "Q", "valid", "success", "by the paper"]
    dense = {r["case"]: r for r in rows if r["distance"] == 0 and "truth" in r}
    lines = []
    for distance in (0.0, *DISTANCES):
        r = [x for x in rows if x["distance"] == distance and "truth" in x]
        if r:
            above = [x["truth"] - dense[x["case"]]["truth"] for x in r if x["case"] in dense]
            worst = float(column(r, "truth").max())
            lines.append(
                [
                    f"{distance:g}" if distance else "dense",
                    len(r),
                    _median(r, "truth"),
                    float(np.median(above)),
                    worst,
                    *(_median(r, name) for name in ("sides", "error", "quality")),
                    *_counts(r),
                ]
            )
    return "\n".join([table(heads, lines), *_failures(rows, "distance", "beginning")])


def shifts_table(rows: Sequence[Row]) -> str:
    """Medians by deviation, and what is taken back of what was added."""
    heads = ["deviation (mm)", "stacks", "error as they are (mm)", "taken back", "worst change"]
    heads += ["of what was added, taken back (median)", "moved"]
    found = {(r["case"], r["deviation"], r["shifts"]): r for r in rows if "truth" in r}
    cases = list(dict.fromkeys(r["case"] for r in rows))
    lines = []
    for deviation in DEVIATIONS:
        pairs = [
            tuple(
                found[k] for k in ((c, 0.0, "off"), (c, deviation, "off"), (c, deviation, "auto"))
            )
            for c in cases
            if {(c, 0.0, "off"), (c, deviation, "off"), (c, deviation, "auto")} <= set(found)
        ]
        none, off, auto = (column(part, "truth") for part in zip(*pairs, strict=True))
        share = "" if deviation == 0 else f"{np.median((off - auto) / (off - none)):.0%}"
        moved = f"{sum(p[2]['moved'] for p in pairs)} of {len(pairs)}"
        medians = [float(np.median(off)), float(np.median(auto)), float((auto - off).max())]
        lines.append([f"{deviation:g}", len(pairs), *medians, share, moved])
    return "\n".join([table(heads, lines), *_failures(rows, "deviation", "shifts")])


def noise_table(rows: Sequence[Row]) -> str:
    """Successes by defect."""
    heads = ["defect", "masks", "error to the truth (mm)", "worst", "to the mask", "Q"]
    heads += ["valid", "success", "by the paper"]
    lines = []
    for defect in (*DEFECTS, "all"):
        mine = [r for r in rows if defect in ("all", r["defect"])]
        r = [x for x in mine if "truth" in x]
        worst = float(column(r, "truth").max())
        medians = [_median(r, name) for name in ("error", "quality")]
        lines.append(
            [defect, len(mine), _median(r, "truth"), worst, *medians, *_counts(r, len(mine))]
        )
    missed = [
        f"- {r['case']} {r['of']} {r['defect']}: no success"
        for r in rows
        if not r.get("success", True)
    ]
    return "\n".join([table(heads, lines), *missed, *_failures(rows, "of", "defect")])


def _median(rows: Sequence[Row], name: str) -> float:
    """Median of a figure."""
    return float(np.median(column(rows, name)))


SUCCESSES = ("valid", "success", "paper_success")


def _counts(rows: Sequence[Row], of: int | None = None) -> list[str]:
    """Valid meshes, successes, and those by the paper's rule."""
    of = len(rows) if of is None else of
    return [f"{sum(r[name] for r in rows)} of {of}" for name in SUCCESSES]


def _failures(rows: Sequence[Row], *conditions: str) -> list[str]:
    """What has no mesh, and why."""
    return [
        f"- {r['case']} {' '.join(str(r[c]) for c in conditions)} FAILED: {r['failure']}"
        for r in rows
        if "failure" in r
    ]


STUDIES = {
    "distance": (at_distances, distance_table),
    "shifts": (shifted, shifts_table),
    "noise": (spoiled, noise_table),
}
"""What makes stacks from a dense mask, and the table of what came out."""


if __name__ == "__main__":
    main()
