"""The report of a cohort: one page, which opens in any browser without server or network."""

from __future__ import annotations

import html
import io
from collections.abc import Iterable, Sequence
from importlib.resources import files
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from heartgen.assessment import QUALITY_THRESHOLD
from heartgen.cohort.gallery import CaseView, views_of
from heartgen.cohort.rows import FAILED, SUCCESS
from heartgen.cohort.store import TABLE, read_results
from heartgen.cohort.summary import Spread, Summary, by_ventricles, meshed, reasons, summarize
from heartgen.formats import write_text
from heartgen.viewing.distributions import draw_boxes, draw_distributions
from heartgen.viewing.page import gradient
from heartgen.viewing.scene import MASK, color_scale

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

RULE = (
    "Success is that of Lamata et al. (2014), section 3.5, of a mesh that is proven valid: a mean "
    "distance from mask to mesh below the diagonal of a voxel, and a mean quality above "
    f"{QUALITY_THRESHOLD}. There, 87 % of 216 left ventricles were one (median error 1.18 mm, "
    "quality 0.37), and 84 % of 39 of both ventricles (1.62 mm, 0.37)."
)

GROUPS = ("group", "cases", "success", "valid", "no mesh", "error: median", "quartiles", "worst")
QUALITIES = ("Q: median", "quartiles", "worst")
WRIGGLES = ("wriggle along (°): median", "quartiles", "worst")
FIGURES = {
    "error_mean": "error",
    "error_p95": "95 %",
    "error_max": "largest",
    "q_mean": "Q",
    "q_min": "least Q",
    "fair_circumferential_median": "wriggle around (°)",
    "fair_longitudinal_median": "along",
    "seconds": "s",
}
"""Columns of the table of all cases, and their heads."""


def write_report(out: str | Path, path: str | Path | None = None) -> Path:
    """Write the page of a batch: figures by group, best and worst cases in 3-D, failures and why.

    Parameters
    ----------
    out : path
        Folder of the batch.
    path : path, optional
        ``report.html`` in that folder if not given; the file appears whole or not at all.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    HeartgenError
        If there are no results, or the page cannot be written.
    """
    out = Path(out)
    table = by_ventricles(read_results(out))
    page = Path(path) if path is not None else out / "report.html"
    text = files("heartgen.cohort").joinpath("batch_report.html").read_text(encoding="utf-8")
    write_text(Template(text).substitute(_fields(out, table)), page)
    return page


def _fields(out: Path, table: pd.DataFrame) -> dict[str, str]:
    """What the template asks for."""
    summaries = summarize(table)
    done = table[meshed(table)]
    doubtful = done[done["status"] != SUCCESS]
    return {
        "title": html.escape(out.resolve().name),
        "lead": _lead(summaries),
        "rule": html.escape(RULE),
        "groups": _groups(summaries),
        "figures": _figures(done),
        "views": _views(views_of(out, done)),
        "key": gradient(color_scale("error")),
        "mask_color": MASK,
        "failures": _pairs(reasons(table)),
        "doubtful": _pairs(zip(doubtful["case"], doubtful["status"], strict=True)),
        "count": str(len(table)),
        "cases": _cases(table),
        "made": html.escape(_made(table)),
    }


def _lead(summaries: Sequence[Summary]) -> str:
    """The cohort in one sentence."""
    cases = sum(s.cases for s in summaries)
    successes, failures = (sum(getattr(s, n) for s in summaries) for n in ("successes", "failures"))
    return (
        f"<b>{successes} of {cases}</b> cases are a success ({successes / cases:.0%}); "
        f"<b>{failures}</b> have no mesh."
    )


def _groups(summaries: Sequence[Summary]) -> str:
    """What each group came to."""
    rows = [
        [
            s.name,
            s.cases,
            f"{s.successes} ({s.successes / s.cases:.0%})",
            s.valid,
            s.failures,
            *_spread(s.error, "largest"),
            *_spread(s.quality, "least"),
            *_spread(s.wriggle, "largest", 1),
        ]
        for s in summaries
    ]
    return _table((*GROUPS, *QUALITIES, *WRIGGLES), rows)


def _spread(spread: Spread | None, worst: str, digits: int = 3) -> tuple[str, str, str]:
    """Median, quartiles and worst value."""
    if spread is None:
        return "", "", ""
    quartiles = f"{spread.low:.{digits}f} to {spread.high:.{digits}f}"
    return f"{spread.median:.{digits}f}", quartiles, f"{getattr(spread, worst):.{digits}f}"


def _figures(done: pd.DataFrame) -> str:
    """Box plots and histograms, if there is anything to draw."""
    if done.empty:
        return ""
    drawn = {
        "Error and quality of every case": draw_boxes(done),
        "Distributions": draw_distributions(done),
    }
    return "\n".join(
        f'<h2>{title}</h2><div class="panel">{_svg(figure)}</div>'
        for title, figure in drawn.items()
    )


def _svg(figure: Figure) -> str:
    """A figure as a part of a page."""
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return buffer.getvalue().partition("<svg")[2].join(("<svg", ""))


def _views(views: Sequence[CaseView]) -> str:
    """Best and worst cases in 3-D."""
    if not views:
        return ""
    shown = "\n".join(
        f'<figure class="panel"><iframe loading="lazy" title="{html.escape(v.title)}" '
        f'srcdoc="{html.escape(v.scene)}"></iframe><figcaption><b>{html.escape(v.title)}</b><br>'
        f'<span class="soft">{html.escape(v.caption)}</span></figcaption></figure>'
        for v in views
    )
    scale = color_scale("error")
    return (
        f'<h2>Best and worst cases</h2><div class="views">{shown}</div>'
        f'<p class="key">{scale.title}: {scale.limits[0]:g}<span class="bar"></span>'
        f'{scale.limits[1]:g} or more<span class="chip"></span>mask, where it leaves the mesh'
        '<span class="soft"> · drag: turn · wheel: zoom</span></p>'
    )


def _pairs(pairs: Iterable[tuple[Any, Any]]) -> str:
    """Cases and what is to be said of them."""
    rows = list(pairs)
    return _table(("case", "why"), rows, words=(1,)) if rows else '<span class="soft">None.</span>'


def _figure(name: str, value: float) -> str:
    """A figure of a case, if it has it; angles to a tenth of a degree."""
    if value != value:  # not a number
        return ""
    return f"{value:.1f}" if name.startswith("fair") else f"{value:.3f}"


def _cases(table: pd.DataFrame) -> str:
    """Figures of all cases, with links to their folders."""
    shown = [name for name in FIGURES if name in table]
    order = table.sort_values(shown[0], ascending=False, na_position="first") if shown else table
    rows, kinds = [], []
    for row in order.to_dict("records"):
        figures = [_figure(n, row[n]) for n in shown]
        rows.append([row["case"], row["group"], *figures, row["status"]])
        failed = str(row["status"]).startswith(FAILED)
        kinds.append("failed" if failed else "" if row["success"] else "doubtful")
    heads = ("case", "group", *(FIGURES[name] for name in shown), "status")
    return _table(heads, rows, words=(1, len(heads) - 1), kinds=kinds)


def _made(table: pd.DataFrame) -> str:
    """What made it, and where all of it is."""
    names = [name for name in table if str(name).startswith("version_")]
    versions = [f"{n.removeprefix('version_')} {', '.join(_unique(table[n]))}" for n in names]
    return (
        f"{' · '.join(versions)} · all figures are in {TABLE}.csv. Research use, not for diagnosis."
    )


def _unique(column: pd.Series) -> list[str]:
    """Values of a column, each once."""
    return sorted(map(str, column.dropna().unique()))


def _table(
    heads: Sequence[str],
    rows: Iterable[Sequence[Any]],
    words: Sequence[int] = (),
    kinds: Sequence[str] = (),
) -> str:
    """A table; cells of words are aligned to the left."""
    style = ["words" if n in words else "" for n in range(len(heads))]
    head = "".join(
        f'<th class="{c}">{html.escape(h)}</th>' for h, c in zip(heads, style, strict=True)
    )
    lines = []
    for n, row in enumerate(rows):
        kind = kinds[n] if kinds else ""
        cells = (
            f'<td class="{c}">{html.escape(str(cell))}</td>'
            for cell, c in zip(row, style, strict=True)
        )
        lines.append(f'<tr class="{kind}">{"".join(cells)}</tr>')
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(lines)}</tbody></table>"
