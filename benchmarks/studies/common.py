"""What the studies share: hearts, phantoms where none are given, and where results go."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from benchmarks.phantoms import written
from benchmarks.rows import case_of, masks_of, table
from heartgen.cohort import Case
from heartgen.cohort.summary import summarize

if TYPE_CHECKING:
    import pandas as pd

DPI = 150


def arguments(doc: str | None, name: str, lod: int | None = None) -> argparse.Namespace:
    """Masks, processes, and a folder for what the study of a name measures."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("masks", type=Path, nargs="*")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("benchmarks/results") / name)
    if lod is not None:
        parser.add_argument("--lod", type=int, default=lod)
    return parser.parse_args()


def cases_of(places: Sequence[Path], out: Path) -> list[Case]:
    """Cases in groups by their folder; phantoms if no masks are given."""
    paths = [p.absolute() for p in (masks_of(places) or written(out / "phantoms"))]
    return [Case(f"{p.parent.name}/{case_of(p)}", p, p.parent.name) for p in paths]


def summaries(results: pd.DataFrame) -> str:
    """A line for each group of results."""
    heads = ["", "fits", "success", "valid", "error median (mm)", "worst", "Q median", "worst"]
    lines = []
    for s in summarize(results):
        figures: list[object] = ["", "", "", ""]
        if s.error is not None and s.quality is not None:
            figures = [s.error.median, s.error.largest, s.quality.median, s.quality.least]
        lines.append([s.name, s.cases, s.successes, s.valid, *figures])
    return table(heads, lines)


def tell(text: str, figure: Figure, out: Path) -> None:
    """Print a table, and write it and a figure into a folder."""
    out.mkdir(parents=True, exist_ok=True)
    (out / "table.md").write_text(text + "\n")
    figure.savefig(out / "figure.png", dpi=DPI)
    print(f"{text}\n\n{out / 'table.md'}\n{out / 'figure.png'}")
