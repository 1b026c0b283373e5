"""Step 3, on the side: start, progress of each step, cancel, and the list of runs."""

from __future__ import annotations

import html
from typing import Any

import ipywidgets as widgets
from traitlets import link

from heartgen.options import STEPS
from heartgen.widgets.parts import button, classed, head, name_html, row, seconds, text
from heartgen.widgets.runs import Run
from heartgen.widgets.session import Session

PHASES = {
    "waiting": "waits",
    "running": "running",
    "done": "done",
    "failed": "failed",
    "cancelled": "cancelled",
}


class RunPanel:
    """Runs, one after the other.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.start = button(
            "Run", "Fit a mesh with these choices", self._start, "hg-primary hg-start"
        )
        self.sweep = button(
            "All levels",
            "Fit all five levels of detail and compare them (registration is shared)",
            self._sweep,
        )
        self.cancel = button("Cancel", "Stop this run", self._cancel, "hg-cancel")
        self.ahead = row(
            "Other levels",
            widgets.Checkbox(session.ahead, indent=False),
            "After a run, fit its other levels of detail while nothing else is to be done, so that "
            "the level can be changed at once",
        )
        classed(self.ahead, "hg-wide")
        self.ahead_note = text("", "hg-note")
        link((session, "ahead"), (self.ahead, "value"))
        session.observe(self._draw_ahead, ["ahead_of"])
        self.progress = text("", "hg-progress")
        self.rows: dict[Run, RunRow] = {}
        self.list = classed(widgets.VBox([]), "hg-runs")
        session.observe(self._draw, ["states"])
        session.observe(self._list, ["runs"])
        self.widget = classed(
            widgets.VBox(
                [
                    head(session, "run"),
                    classed(widgets.HBox([self.start, self.sweep, self.cancel]), "hg-buttons"),
                    self.progress,
                    self.ahead,
                    self.ahead_note,
                    self.list,
                ]
            ),
            "hg-card",
        )
        self._draw()

    def _start(self) -> None:
        self.session.start()

    def _sweep(self) -> None:
        self.session.sweep()

    def _cancel(self) -> None:
        run = self.session.active_run
        if run is not None:
            run.cancel()

    def _draw(self, _: Any = None) -> None:
        """Which buttons are of use."""
        blocked = self.session.states["run"].phase == "blocked"
        active = self.session.active_run is not None
        self.start.disabled = self.sweep.disabled = blocked or active
        self.cancel.disabled = not active
        self._draw_progress()

    def _draw_ahead(self, _: Any) -> None:
        levels = self.session.ahead_of
        self.ahead_note.value = f"level {levels} being fitted in the background" if levels else ""

    def _list(self, _: Any) -> None:
        for run in self.session.runs:
            if run not in self.rows:
                self.rows[run] = RunRow(self.session, run)
                run.observe(self._draw_progress, ["shares", "phase"])
        self.rows = {run: self.rows[run] for run in self.session.runs}
        self.list.children = [r.widget for r in reversed(self.rows.values())]

    def _draw_progress(self, _: Any = None) -> None:
        run = self.session.active_run
        self.progress.value = "" if run is None else progress_html(run)


class RunRow:
    """One run in the list.

    Parameters
    ----------
    session : Session
        The visitor's work.
    run : Run
        The run.
    """

    def __init__(self, session: Session, run: Run) -> None:
        self.session, self.run = session, run
        self.label = text("", "hg-run-label")
        self.show = button("Show", f"Show the mesh of run {run.number}", self._show, "hg-small")
        self.name = row(
            "Name",
            widgets.Text(run.name, placeholder=run.case.name, continuous_update=False),
            "Yours for this run, in lists and titles",
        )
        self.delete = button(
            "Delete", f"Remove run {run.number} and its meshes", self._delete, "hg-small"
        )
        self.own = classed(widgets.HBox([self.name, self.delete]), "hg-run-own")
        self.widget = classed(
            widgets.VBox([widgets.HBox([self.label, self.show]), self.own]), "hg-run"
        )
        self.name.observe(self._rename, "value")
        run.observe(self._draw, ["phase", "name", "outcomes"])
        session.observe(self._draw, ["shown"])
        self._draw()

    def _show(self) -> None:
        wanted = [o for o in self.run.outcomes if o.lod == self.session.choices.lod]
        self.session.show((wanted or list(self.run.outcomes))[0])

    def _rename(self, change: Any) -> None:
        self.session.rename(self.run, change["new"])

    def _delete(self) -> None:
        self.session.delete(self.run)

    def _draw(self, _: Any = None) -> None:
        run = self.run
        shown = self.session.shown is not None and self.session.shown.run == run.number
        detail = PHASES[run.phase]
        if run.phase == "done":
            report = run.outcomes[0].result.report
            detail = (
                f"error {report.accuracy.mean:.2f} mm · Q {report.quality.mean:.2f} · wriggle "
                f"{report.fairness.longitudinal_median:.0f}°"
                if len(run.levels) == 1
                else f"{len(run.outcomes)} meshes"
            ) + f" · {seconds(run.seconds)}"
            if len(run.levels) < len(run.outcomes):
                others = sorted(o.lod for o in run.outcomes if o.lod not in run.levels)
                detail += f" · also at level {', '.join(map(str, others))}"
            if run.reused:
                detail += f" · reused: {', '.join(run.reused)}"
        elif run.phase == "failed":
            detail = run.error
        self.label.value = (
            f'{name_html(run.title)}<span class="hg-{run.phase}">{html.escape(detail)}</span>'
        )
        self.show.disabled = run.phase != "done" or shown
        self.show.description = "Shown" if shown else "Show"
        self.own.layout.display = "" if shown else "none"
        (self.widget.add_class if shown else self.widget.remove_class)("hg-shown")


def progress_html(run: Run) -> str:
    """Bars of the steps, and the time left.

    Parameters
    ----------
    run : Run
        The run.
    """
    bars = "".join(
        f'<li class="{"hg-now" if step == run.step and run.shares[step] < 1 else ""}">'
        f"<span>{step}</span>"
        f'<progress max="1" value="{run.shares[step]:.2f}" aria-label="{step}"></progress></li>'
        for step in STEPS
    )
    if run.phase == "waiting":
        note = "waits for the work before it"
    else:
        note = f"about {seconds(max(run.left, 1))} left" if run.left == run.left else "starting"
    return f'<ol class="hg-bars">{bars}</ol><p class="hg-left" role="status">{note}</p>'
