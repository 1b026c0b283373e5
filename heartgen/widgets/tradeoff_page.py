"""Accuracy against quality over levels of detail, elements and weights (paper, figure 6), live."""

from __future__ import annotations

import atexit
import html
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import ipywidgets as widgets

from heartgen.widgets.file_panel import FilePanel
from heartgen.widgets.frame import framed, two_sided
from heartgen.widgets.input_case import sample_choices
from heartgen.widgets.panels.view import ViewPanel
from heartgen.widgets.parts import button, card, classed, picture, row, status, text
from heartgen.widgets.runs import ALL_LEVELS, Outcome, Run, post_on_loop
from heartgen.widgets.session import Session
from heartgen.widgets.tradeoff_plot import ONE, Tradeoff, point
from heartgen.widgets.tradeoff_study import TradeoffStudy
from heartgen.widgets.transfer import Download

if TYPE_CHECKING:
    from heartgen.widgets.input_case import InputCase

ABOUT = "What accuracy costs in quality: levels of detail, elements and weights compared, live"

FIRST = "lifelike"
"""Sample that is loaded and fitted when the page opens."""

FORMATS = "NIfTI, NRRD, MetaImage, DICOM-SEG or RTSTRUCT"

DPI = 200
"""Of the picture that is downloaded."""

COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#26303b")
"""As in `heartgen.viewing.tradeoff`; a test compares."""


def tradeoff(sample: str | None = FIRST) -> widgets.Widget:
    """Make the app that explores the trade-off between accuracy and quality.

    Parameters
    ----------
    sample : str or None
        Sample to load and fit as soon as the page is on the screen.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell. Its `study` is the state behind the page.
    """
    page = TradeoffPage(sample)
    page.widget.study = page.study
    page.widget.page = page
    return page.widget


class TradeoffPage:
    """Hearts, choices, the plot, the mesh of a point, and the table.

    Parameters
    ----------
    first : str, optional
        Sample to begin with; None for none.
    """

    def __init__(self, first: str | None = None) -> None:
        self.study = TradeoffStudy(post_on_loop())
        self.shown = Session(post_on_loop())
        for each in (self.study, self.shown):
            atexit.register(each.close)
        study = self.study
        self.source = FilePanel(
            study.folder, sample_choices(), study.add_sample, study.add_file, study.refuse, FORMATS
        )
        self.source.first = first
        self._fit_first = first is not None
        self.hearts = classed(widgets.VBox([]), "hg-runs")
        self.levels = [
            row(f"{lod}", widgets.Checkbox(lod in study.levels, indent=False), f"Fit level {lod}")
            for lod in ALL_LEVELS
        ]
        self.elements = row(
            "Elements",
            widgets.Text(study.elements, layout={}),
            "Radial x circumferential x longitudinal, with commas between: auto, 2x12x6, 1x24x12",
        )
        self.qualities = row(
            "Quality weights",
            widgets.Text(study.qualities, layout={}),
            "Weights of quality against accuracy, with commas between: 0.5, 1, 2",
        )
        for control in (self.elements, self.qualities):
            classed(control, "hg-above")
        self.run = button("Fit", "Fit all hearts with all of these", self._start, "hg-primary")
        self.cancel = button("Cancel", "End the fits that go on or wait", study.cancel)
        self.bar = text("", "hg-status")
        self.plot = Tradeoff()
        self.hint = text("", "hg-note")
        self.view = ViewPanel(self.shown, titled=False)
        self.table = text("", "hg-table hg-wide-table")
        self.csv = Download(self._save_table, title="Table (CSV)", hint="Save all values as CSV")
        self.png = Download(self._save_plot, title="Plot (PNG)", hint="Save the plot as a picture")
        study.observe(self._draw_status, ["doing", "complaint", "hearts", "runs", "moved"])
        study.observe(self._draw_hearts, ["hearts"])
        study.observe(self._draw_outcomes, ["outcomes", "runs"])
        self.plot.observe(self._clicked, "selected")
        side, middle = self._side(), [self._middle()]
        self.widget = framed([two_sided(side, middle)], ABOUT, "heartgen trade-off")
        self._draw_status()
        self._draw_outcomes()

    def _side(self) -> list[Any]:
        """Cards with controls."""
        levels = classed(widgets.HBox(self.levels), "hg-levels-row")
        buttons = classed(widgets.HBox([self.run, self.cancel]), "hg-buttons")
        export = classed(widgets.HBox([self.csv, self.png]), "hg-buttons")
        return [
            self.source.card("1. Hearts", self.hearts),
            card(
                "2. Choices",
                text("Levels of detail", "hg-fact"),
                levels,
                self.elements,
                self.qualities,
                buttons,
                self.bar,
            ),
            card("3. Export", export),
        ]

    def _middle(self) -> Any:
        """Plot and view beside each other, and the table."""
        plot = classed(
            widgets.VBox(
                [text("<h3>Accuracy against quality</h3>"), self.plot, self.hint],
            ),
            "hg-levels",
        )
        view = classed(widgets.VBox([self.view.widget]), "hg-beside")
        both = classed(widgets.HBox([plot, view]), "hg-columns")
        return classed(widgets.VBox([both, self.table]), "hg-panel hg-stack")

    def _start(self) -> None:
        """Fit what is asked for."""
        study = self.study
        ticked = tuple(lod for lod, box in zip(ALL_LEVELS, self.levels, strict=True) if box.value)
        study.levels, study.elements = ticked, self.elements.value
        study.qualities = self.qualities.value
        study.start()

    def _draw_status(self, _: Any = None) -> None:
        """Say how the work stands."""
        study = self.study
        self.cancel.disabled = not study.active
        self.run.disabled = not study.hearts
        done = sum(not run.active for run in study.runs)
        current = next((run for run in study.runs if run.phase == "running"), None)
        doing = study.doing
        if current is not None:
            doing = f"{_told(current)}: {current.step or 'shape analysis'}"
        meshes = f"{len(study.outcomes)} meshes; for more, change the choices and press Fit"
        ready = meshes if study.outcomes else "press Fit" if study.hearts else "choose a heart"
        said = status(doing, study.complaint, ready)
        if study.active:
            share = (done + (_share(current) if current else 0)) / len(study.runs)
            said += f'<progress aria-label="All runs" max="1" value="{share:.3f}"></progress>'
            said += f'<p class="hg-note">{done} of {len(study.runs)} runs are done</p>'
        self.bar.value = said

    def _draw_hearts(self, _: Any = None) -> None:
        """List the hearts; the first is fitted at once."""
        study = self.study
        self.hearts.children = [self._entry(heart) for heart in study.hearts]
        self.view.open()
        if self._fit_first and study.hearts:
            self._fit_first = False
            self._start()

    def _entry(self, heart: InputCase) -> Any:
        """A heart in the list."""
        told = f"<b>{html.escape(heart.name)}</b><span>{html.escape(heart.description)}</span>"
        remove = partial(self.study.remove, heart)
        away = button("Remove", f"Fit {heart.name} no more", remove, "hg-small-wide")
        return classed(widgets.HBox([text(told, "hg-run-label"), away]), "hg-run")

    def _draw_outcomes(self, _: Any = None) -> None:
        """Plot and list what has been fitted."""
        outcomes = self.study.outcomes
        for download in (self.csv, self.png):
            download.disabled = not outcomes
        self.hint.value = (
            "The numbers are levels of detail. Click a point to see its mesh."
            if outcomes
            else "Points appear as meshes are fitted: near the upper left corner is best."
        )
        if outcomes and self.shown.shown is None:
            self.shown.show(outcomes[0])
        ids = {outcome: n for n, outcome in enumerate(outcomes)}
        named = self.study.curves()
        points, shapes = [], []
        for n, (name, along) in enumerate(named):
            shapes.append({"name": name, "color": COLORS[n % len(COLORS)]})
            points += [
                point(o, ids[o], str(o.lod), f"{name}, level of detail {o.lod}", n) for o in along
            ]
        with self.plot.hold_sync():
            self.plot.curves = shapes if len(shapes) > 1 else [ONE]
            self.plot.points = points
            self.plot.selected = ids.get(self.shown.shown)
        self._draw_table()

    def _draw_table(self) -> None:
        self.table.value = table_html(self.study.runs, self.shown.shown)

    def _clicked(self, change: Any) -> None:
        """Show the mesh of a point."""
        chosen = change["new"]
        if chosen is not None and self.study.outcomes[chosen] is not self.shown.shown:
            self.shown.show(self.study.outcomes[chosen])
            self._draw_table()

    def _save_table(self) -> None:
        self.csv.hand_over("tradeoff.csv", self.study.table().encode())

    def _save_plot(self) -> None:
        """Draw the plot as for a paper."""
        from heartgen.viewing.tradeoff import Point, draw_curves

        drawn = {
            name: [
                Point(str(o.lod), o.result.report.accuracy.mean, o.result.report.quality.mean)
                for o in along
            ]
            for name, along in self.study.curves()
        }
        hearts = dict.fromkeys(o.case.name for o in self.study.outcomes)
        self.png.hand_over("tradeoff.png", picture(draw_curves(drawn, ", ".join(hearts)), DPI))


def table_html(runs: Sequence[Run], shown: Outcome | None) -> str:
    """All meshes side by side, and what could not be fitted.

    Parameters
    ----------
    runs : sequence of Run
        The newest last.
    shown : Outcome or None
        The mesh that is looked at.
    """
    rows = "".join(_row(o, o is shown) for run in runs for o in run.outcomes) + "".join(
        f'<tr><td>{html.escape(_told(run))}</td><td colspan="8">{html.escape(run.error)}</td></tr>'
        for run in runs
        if run.phase == "failed"
    )
    if not rows:
        return ""
    heads = ("heart", "elements", "weight", "level", "error (mm)", "95 %", "Q", "least Q", "status")
    return (
        '<h3>Meshes</h3><div class="hg-scroll" tabindex="0" role="region" aria-label="Meshes">'
        f"<table><thead><tr>{''.join(f'<th>{h}</th>' for h in heads)}</tr></thead>"
        f"<tbody>{rows}</tbody></table></div>"
    )


def _row(outcome: Outcome, shown: bool) -> str:
    """A mesh in the table."""
    report, options = outcome.result.report, outcome.result.options
    cells = (
        html.escape(outcome.case.name),
        "×".join(map(str, options.elements or ())),
        f"{options.quality:g}",
        str(options.lod),
        f"{report.accuracy.mean:.3f}",
        f"{report.accuracy.p95:.3f}",
        f"{report.quality.mean:.3f}",
        f"{report.quality.min:.3f}",
        "success" if report.success else html.escape(report.status),
    )
    mark = ' class="hg-shown"' if shown else ""
    return f"<tr{mark}>{''.join(f'<td>{cell}</td>' for cell in cells)}</tr>"


def _told(run: Run) -> str:
    """Heart and options of a run."""
    counts = run.options.elements
    parts = [run.case.name]
    if counts is not None:
        parts.append("x".join(map(str, counts)))
    return ", ".join([*parts, f"quality {run.options.quality:g}"])


def _share(run: Run) -> float:
    """How much of a run is done, by steps."""
    shares = list(run.shares.values())
    return float(sum(shares) / len(shares)) if shares else 0.0
