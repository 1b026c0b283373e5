"""Error and quality over whole cohorts (paper, figure 10).

usage: python -m benchmarks.studies.robustness [FOLDER_OR_MASK...] [--lod 1] [--jobs N]
                                               [--out FOLDER]

A box for each folder. Phantoms are fitted if no masks are given. What is fitted stays in the folder
and is not fitted again.
"""

from __future__ import annotations

from benchmarks.studies.common import arguments, cases_of, summaries, tell
from heartgen.cohort import Workers, batch
from heartgen.cohort.summary import by_ventricles, reasons
from heartgen.viewing.distributions import draw_boxes


def main() -> None:
    """Fit, tabulate and draw."""
    a = arguments(__doc__, "robustness", lod=1)
    cases = cases_of(a.masks, a.out)
    results = by_ventricles(batch(cases, a.out, lod=a.lod, workers=Workers(a.jobs)))
    failed = [f"- {case} FAILED: {reason}" for case, reason in reasons(results)]
    tell("\n".join([summaries(results), *failed]), draw_boxes(results), a.out)


if __name__ == "__main__":
    main()
