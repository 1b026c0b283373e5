"""Figures of merit: the page of the documentation, made from rows that other benchmarks stored.

usage: python -m benchmarks.merit RESULTS [--output docs/figures-of-merit.md]

RESULTS is a folder with one file of rows for each set of `SETS`: NAME.jsonl. Each section names its
data, its elements and level, and the command that made the rows. A set whose file is missing has
no section, and is named where the command runs.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.labels import BOUNDS, OUTCOMES
from benchmarks.rows import Row, table
from heartgen.options import STEPS

Tables = Callable[[Sequence[Row]], list[str]]

HEAD = """# Figures of merit

Accuracy, quality, fairness, success and speed on data of each kind: what stands in one table is of
one kind. Made by `python -m benchmarks.merit` from the rows that the command below each table
stores. The [glossary](glossary.md) has the words, and [limits](limits.md) what a success does not
say. Times are of one processor core on a shared machine, kernels compiled: compare them with each
other, not with yours.
"""


@dataclass(frozen=True)
class Set:
    """Hearts that were measured.

    Attributes
    ----------
    title : str
        What they are.
    data : str
        Where they are from; {cases} and {patients} are counted in the rows.
    command : str
        What makes the rows, but for paths.
    tables : callable
        From rows to the lines of its tables.
    """

    title: str
    data: str
    command: str
    tables: Tables


def fitted(rows: Sequence[Row]) -> list[str]:
    """Accuracy, quality, fairness, success and time by level, of rows of `benchmarks.hearts`."""
    done = [r for r in rows if "error" in r]
    levels = sorted({r["lod"] for r in rows})
    heads = ["median (worst)", *(f"level {k}" for k in levels)]
    at = [[r for r in done if r["lod"] == k] for k in levels]
    whole = [sum(r["lod"] == k for r in rows) for k in levels]

    def line(name: str, text: Callable[[list[Row]], str]) -> list[str]:
        return [name, *(text(r) for r in at)]

    def spread(key: str, worst: Callable[[list[float]], float], digits: int) -> Callable[..., str]:
        def text(part: list[Row]) -> str:
            values = [float(r[key]) for r in part]
            return f"{np.median(values):.{digits}f} ({worst(values):.{digits}f})"

        return text

    def share(key: str) -> list[str]:
        return [f"{sum(bool(r[key]) for r in p)} of {n}" for p, n in zip(at, whole, strict=True)]

    def where_known(name: str, key: str, digits: int) -> list[list[str]]:
        known = all(r[key] is not None for r in done)
        return [line(name, spread(key, max, digits))] if known else []

    seconds = [[sum(r.get(f"seconds {s}", 0.0) for s in STEPS) for r in part] for part in at]
    body = [
        line("error, mask to mesh, mm", spread("error", max, 3)),
        line("error, mesh to mask, mm", spread("reverse", max, 3)),
        line("Dice coefficient", spread("dice", min, 3)),
        line("quality Q", spread("quality", min, 3)),
        line("scaled Jacobian", spread("scaled", min, 3)),
        line("wriggle, longitudinal, degrees", spread("along", max, 0)),
        line("wriggle, circumferential, degrees", spread("around", max, 0)),
        *where_known("normals off the mask's, degrees", "normals", 1),
        ["proven valid", *share("valid")],
        ["success by our rule", *share("success")],
        ["success by the paper's rule", *share("paper_success")],
        [
            "time, s (95 % below)",
            *(f"{np.median(s):.1f} ({np.percentile(s, 95):.1f})" for s in seconds),
        ],
    ]
    return [table(heads, body)]


def labeled(rows: Sequence[Row]) -> list[str]:
    """Outcomes and cavities of the rows of `benchmarks.labels`."""
    done = [r for r in rows if "error" in r]
    count = [[name, sum(r["outcome"] == name for r in rows)] for name in OUTCOMES]
    middle = [
        [name, f"{np.median(values):.3g}", f"{np.percentile(values, 95):.3g}"]
        for name, values in (
            ("error, mm", [r["error"] for r in done]),
            ("quality Q", [r["quality"] for r in done]),
            ("wriggle, longitudinal, degrees", [r["wriggle"] for r in done]),
            ("time, s", [r["seconds"] for r in done]),
        )
    ]
    cavities = []
    for side in BOUNDS:
        off = np.abs([r[f"{side} cavity"] for r in done if r[f"{side} cavity"] is not None])
        if len(off):
            cells = [f"{np.median(off):.2%}", f"{np.percentile(off, 95):.2%}"]
            cavities.append([f"{side} cavity against its label", *cells])
    return [
        table(["outcome", f"of {len(rows)}"], count),
        "",
        table(["", "median", "95 %"], [*middle, *cavities]),
    ]


def spoiled(rows: Sequence[Row]) -> list[str]:
    """Outcomes of the rows of `benchmarks.mutations`, by mutation, both kinds together."""
    body = []
    for name in dict.fromkeys(r["mutation"] for r in rows):
        mine = [r for r in rows if r["mutation"] == name]
        body.append(
            [name, len(mine), *(sum(r["outcome"] == outcome for r in mine) for outcome in OUTCOMES)]
        )
    return [table(["mutation", "fits", *OUTCOMES], body)]


ATLAS = "statistical shape model of the Cardiac Atlas Project, end diastole and end systole"
ACDC = "ACDC (Bernard et al. 2018), end diastole and end systole"
LABELS = f"{{cases}} label maps of {{patients}} patients of {ACDC}"

SETS = {
    "lv": Set(
        "Left ventricle, dense masks",
        f"{{cases}} masks, 1 mm, from the {ATLAS}; 1×12×6 elements.",
        "hearts FOLDER --elements 1x12x6 --levels 1,3,5",
        fitted,
    ),
    "biv": Set(
        "Both ventricles, dense masks",
        "{cases} masks, 0.3 to 1 mm: patients and reference hearts of biv-me, Cobiveco, LDRB and a "
        "repaired tetralogy of Fallot, one heart in 25 phases, a rabbit; 2×12×8 elements.",
        "hearts FOLDERS --elements 2x12x8 --levels 3",
        fitted,
    ),
    "stacks-lv": Set(
        "Left ventricle, short-axis stacks",
        f"{{cases}} binary stacks of {{patients}} patients of {ACDC}; 1×12×6 elements.",
        "stacks fit FOLDER --elements 1x12x6 --lod 1",
        fitted,
    ),
    "stacks-biv": Set(
        "Both ventricles, short-axis stacks",
        f"{{cases}} binary stacks of {{patients}} patients of {ACDC}, the right wall drawn 3 mm "
        "thick; 2×9×8 elements.",
        "stacks fit FOLDER --elements 2x9x8 --lod 2",
        fitted,
    ),
    "labels-biv": Set(
        "Both ventricles, label maps of stacks",
        f"{LABELS}, as they are; 2×9×8 elements, level 2.",
        "labels FOLDER --elements 2x9x8 --lod 2",
        labeled,
    ),
    "labels-lv": Set(
        "Left ventricle, label maps of stacks",
        f"{LABELS}, as they are; 1×12×6 elements, level 1.",
        "labels FOLDER --ventricles lv --elements 1x12x6 --lod 1",
        labeled,
    ),
    "mutations": Set(
        "Label maps, spoiled",
        f"{LABELS}, each spoiled as scanners and observers spoil them, and meshed as a left "
        "ventricle (1×12×6, level 1) and as both (2×9×8, level 2).",
        "mutations FOLDER --every 12",
        spoiled,
    ),
}
"""By the name of the file of rows."""


def page(folder: Path) -> str:
    """The page, from a folder of rows."""
    parts = [HEAD]
    for name, given in SETS.items():
        file = folder / f"{name}.jsonl"
        if not file.is_file():
            print(f"left out: {file} (python -m benchmarks.{given.command})", file=sys.stderr)
            continue
        rows = [json.loads(line) for line in file.read_text().splitlines()]
        cases = {r["case"] for r in rows}
        patients = {case.partition("_")[0] for case in cases}
        data = given.data.format(cases=len(cases), patients=len(patients))
        parts += [f"## {given.title}", "", data, "", *given.tables(rows), ""]
        parts += [f"`python -m benchmarks.{given.command}`", ""]
    if len(parts) == 1:
        sys.exit(f"{folder} has no rows: it should hold one or more of {', '.join(SETS)} as .jsonl")
    return "\n".join(parts)


def main() -> None:
    """Write the page."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("results", type=Path)
    parser.add_argument("--output", type=Path, default=Path("docs/figures-of-merit.md"))
    given = parser.parse_args()
    given.output.write_text(page(given.results))


if __name__ == "__main__":
    main()
