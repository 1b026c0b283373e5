"""Step 5: the report card, histograms, the runs compared, and the levels of detail."""

from __future__ import annotations

import html
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.hints import marked
from heartgen.widgets.panels.against import AgainstPanel
from heartgen.widgets.parts import (
    button,
    classed,
    head,
    name_html,
    picture,
    sections_html,
    text,
)
from heartgen.widgets.results_table import results_csv
from heartgen.widgets.runs import Outcome, siblings
from heartgen.widgets.session import Session
from heartgen.widgets.tradeoff_plot import Tradeoff, point
from heartgen.widgets.transfer import Download

DPI = 110
"""Of the histograms: 1056 pixels across."""


def link_tradeoff(plot: Tradeoff, session: Session) -> None:
    """Have a plot show the levels of the case that is looked at, and a click load a mesh.

    Parameters
    ----------
    plot : Tradeoff
        The plot.
    session : Session
        The visitor's work.
    """

    def clicked(change: Any) -> None:
        if session.shown is None:
            return
        for outcome in siblings(session, session.shown):
            if outcome.lod == change["new"] and outcome is not session.shown:
                session.show(outcome)

    def draw(_: Any = None) -> None:
        if session.shown is None:
            return
        with plot.hold_sync():
            plot.selected = session.shown.lod
            plot.points = [
                point(o, o.lod, str(o.lod), f"Level of detail {o.lod}")
                for o in siblings(session, session.shown)
            ]

    plot.observe(clicked, "selected")
    session.observe(draw, ["shown", "outcomes"])
    draw()


class AssessPanel:
    """How good the mesh is.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.card = text("", "hg-report")
        self.figure = marked(
            classed(widgets.Image(format="png"), "hg-histograms"),
            alt="Histograms of error and quality, and the mean error of each surface",
        )
        self.segments = text("", "hg-segments")
        self.tradeoff = Tradeoff()
        self.sweep = button(
            "Fit all levels of detail", "Fit this case at all five levels and compare", self._sweep
        )
        self.hint = text("", "hg-note")
        self.table = text("", "hg-table")
        self.csv = Download(
            self._hand_over, title="Download table", hint="All meshes and all measures, as CSV"
        )
        self.csv.disabled = False
        link_tradeoff(self.tradeoff, session)
        session.observe(self._draw, ["shown", "outcomes"])
        session.observe(self._enable, ["states"])
        levels = classed(
            widgets.VBox(
                [
                    text("<h3>Levels of detail: accuracy against quality</h3>"),
                    self.tradeoff,
                    self.hint,
                    self.sweep,
                ]
            ),
            "hg-levels",
        )
        self.against = AgainstPanel(session)
        runs = classed(widgets.VBox([text("<h3>Runs</h3>"), self.table, self.csv]), "hg-compare")
        self.body = classed(
            widgets.VBox(
                [
                    self.card,
                    self.figure,
                    self.segments,
                    classed(widgets.HBox([levels, runs, self.against.widget]), "hg-columns"),
                ]
            ),
            "hg-judge",
        )
        self.empty = text("<p>Run heartgen to see how good the mesh is.</p>", "hg-empty")
        self.widget = classed(
            widgets.VBox([head(session, "assess"), self.empty, self.body]), "hg-panel"
        )
        self._drawn: Outcome | None = None
        self.widget.layout.observe(self._draw, "display")
        self._draw()

    def _hand_over(self) -> None:
        content = results_csv(self.session.outcomes).encode()
        self.csv.hand_over("results.csv", content)

    def _sweep(self) -> None:
        self.session.sweep()

    def _enable(self, _: Any = None) -> None:
        self.sweep.disabled = (
            self.session.states["run"].phase == "blocked" or self.session.active_run is not None
        )

    def _draw(self, _: Any = None) -> None:
        shown = self.session.shown
        self.empty.layout.display = "none" if shown else ""
        self.body.layout.display = "" if shown else "none"
        if shown is None or self.widget.layout.display == "none":
            return  # another level is to be seen at once, and this is not looked at
        from heartgen.viewing.bullseye_svg import bullseye_html
        from heartgen.viewing.figures import draw_histograms
        from heartgen.viewing.segment_values import result_bullseyes

        if shown is not self._drawn:
            self._drawn = shown
            self.figure.value = picture(draw_histograms(shown.result), DPI)
            plots = "".join(map(bullseye_html, result_bullseyes(shown.result)))
            self.segments.value = f"<h3>By segment</h3><div>{plots}</div>"
        self.card.value = card_html(shown)
        others = siblings(self.session, shown)
        self.hint.value = (
            "Click a point to load its mesh."
            if len(others) > 1
            else "One level so far. The others show what accuracy costs in quality."
        )
        self.table.value = table_html(self.session.outcomes, shown)
        self._enable()


def card_html(outcome: Outcome) -> str:
    """The verdict, and all measures under their titles.

    Parameters
    ----------
    outcome : Outcome
        The mesh that is judged.
    """
    from heartgen.viewing.card import sections, verdict

    report = outcome.result.report
    judged = verdict(report)
    return (
        f'<p class="hg-verdict hg-{judged.level}"><b>{html.escape(outcome.title)}</b> · '
        f"{html.escape(judged.text)}</p>{sections_html(sections(report))}"
    )


def table_html(outcomes: list[Outcome], shown: Outcome) -> str:
    """All meshes side by side.

    Parameters
    ----------
    outcomes : list of Outcome
        A row for each.
    shown : Outcome
        The one that is looked at.
    """
    rows = "".join(
        f'<tr class="{"hg-shown" if o is shown else ""}"><td>{name_html(o.title)}</td>'
        f"<td>{o.result.report.accuracy.mean:.3f}</td><td>{o.result.report.accuracy.p95:.3f}</td>"
        f"<td>{o.result.report.quality.mean:.3f}</td><td>{o.result.report.quality.min:.3f}</td>"
        f"<td>{o.result.report.fairness.circumferential_median:.0f}</td>"
        f"<td>{o.result.report.fairness.longitudinal_median:.0f}</td>"
        f"<td>{'proven' if o.result.report.quality.valid else 'NOT valid'}</td></tr>"
        for o in reversed(outcomes)
    )
    return (
        '<div class="hg-scroll" tabindex="0" role="region" aria-label="Runs">'
        "<table><thead><tr><th>run</th><th>error (mm)</th><th>95 %</th><th>Q</th><th>least Q</th>"
        "<th>wriggle around (°)</th><th>along</th>"
        f"<th>validity</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
