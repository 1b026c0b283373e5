"""Error and quality as slices lie farther apart (paper, figure 9).

usage: python -m benchmarks.studies.slice_distance [FOLDER_OR_MASK...] [--lod 3] [--jobs N]
                                                   [--out FOLDER]

Stacks of slices 4 to 20 mm apart are made from ten dense masks whose third index axis is the long
axis of the heart, or from phantoms if none are given; see `benchmarks.stacks`. What is fitted stays
in the folder and is not fitted again.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from benchmarks.rows import Row, column
from benchmarks.stacks import distance_table, rows_of
from benchmarks.studies.common import arguments, tell
from heartgen.viewing.tradeoff import COLORS, FAINT

HEARTS = 10

SIZE = (9.0, 3.6)
"""Inches."""

PANELS = {"truth": "error to the dense mask (mm)", "quality": "mean quality Q"}


def main() -> None:
    """Fit, tabulate and draw."""
    a = arguments(__doc__, "slice_distance", lod=3)
    common = {"what": "distance", "lod": a.lod, "elements": None, "set": ""}
    rows = rows_of(a.masks, common, HEARTS, a.jobs, a.out / "rows.jsonl")
    tell(distance_table(rows), draw(rows), a.out)


def draw(rows: Sequence[Row]) -> Figure:
    """Medians and quartiles of error and quality against the distance; the dense fit at zero."""
    figure = Figure(figsize=SIZE, layout="constrained", facecolor="white")
    done = [r for r in rows if "truth" in r]
    distances = sorted({r["distance"] for r in done})
    for axes, (name, label) in zip(figure.subplots(1, len(PANELS)), PANELS.items(), strict=True):
        values = [column([r for r in done if r["distance"] == d], name) for d in distances]
        low, middle, high = np.transpose([np.percentile(v, (25, 50, 75)) for v in values])
        axes.fill_between(distances, low, high, color=COLORS[0], alpha=FAINT, linewidth=0)
        axes.plot(distances, middle, marker="o", color=COLORS[0])
        axes.set(xlabel="distance between slices (mm); 0: dense", ylabel=label)
        axes.set_ylim(bottom=0)
        axes.spines[["top", "right"]].set_visible(False)
    hearts = len({r["case"] for r in done})
    figure.suptitle(f"medians and quartiles of {hearts} hearts", fontsize="medium")
    return figure


if __name__ == "__main__":
    main()
