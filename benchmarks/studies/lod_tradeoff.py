"""Accuracy against quality at levels of detail 1 to 5 (paper, figure 6).

usage: python -m benchmarks.studies.lod_tradeoff [FOLDER_OR_MASK...] [--jobs N] [--out FOLDER]

Of the paper's four steps, and with the optimization. Phantoms are fitted if no masks are given.
What is fitted stays in the folder and is not fitted again.
"""

from __future__ import annotations

from benchmarks.studies.common import arguments, cases_of, summaries, tell
from heartgen.cohort import Workers, sweep
from heartgen.cohort.summary import by_options
from heartgen.viewing.tradeoff import draw_sweep

VARIED = ["optimize", "lod"]


def main() -> None:
    """Fit, tabulate and draw."""
    a = arguments(__doc__, "lod_tradeoff")
    cases = cases_of(a.masks, a.out)
    results = sweep(cases, optimize=[False, True], out=a.out, workers=Workers(a.jobs))
    tell(summaries(by_options(results, VARIED)), draw_sweep(results, VARIED), a.out)


if __name__ == "__main__":
    main()
