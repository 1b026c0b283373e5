"""Small parts of which the panels are made."""

from __future__ import annotations

import html
import io
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import ipywidgets as widgets

from heartgen.widgets.hints import explained
from heartgen.widgets.session import Session
from heartgen.widgets.steps import STEPS, StepState

if TYPE_CHECKING:
    from heartgen.viewing.card import Section

WEB = Path(__file__).parent / "web"

STYLES = ("theme.css", "style.css", "view.css", "help.css", "narrow.css")
"""What gives the pages their look, each over those before it."""

MARKS = {"blocked": "–", "ready": "", "running": "", "done": "✓", "failed": "!"}
"""What the badge of a step shows instead of its number."""

NAMES = {
    "blocked": "waits",
    "ready": "ready",
    "running": "running",
    "done": "done",
    "failed": "failed",
}


def head(session: Session, key: str) -> widgets.HTML:
    """Head of a step: its number, title and state, and why.

    Parameters
    ----------
    session : Session
        The visitor's work.
    key : str
        Of the step, see `STEPS`.
    """
    step = next(s for s in STEPS if s.key == key)
    shown = text("", f"hg-head hg-step-{key}")

    def draw(_: Any = None) -> None:
        state: StepState = session.states[key]
        mark = MARKS[state.phase] or str(step.number)
        shown.value = (
            f'<div class="hg-{state.phase}" role="status">'
            f'<span class="hg-badge" aria-hidden="true">{mark}</span>'
            f"<h2>{step.number}. {step.title}</h2>"
            f'<span class="hg-why"><b>{NAMES[state.phase]}</b> · {html.escape(state.reason)}</span>'
            "</div>"
        )

    session.observe(draw, "states")
    draw()
    return shown


def name_html(title: str) -> str:
    """A name in a list: where it is too long for its place, its middle is left out, not its end.

    Parameters
    ----------
    title : str
        Parts with dots between them, the last of which is always shown whole.
    """
    begin, dot, end = title.rpartition(" · ")
    return (
        f'<b class="hg-name" title="{html.escape(title)}"><span>{html.escape(begin)}</span>'
        f"<span>{html.escape(dot)}{html.escape(end)}</span></b>"
    )


def text(value: str = "", classes: str = "") -> widgets.HTML:
    """A piece of HTML.

    Parameters
    ----------
    value : str
        The HTML.
    classes : str
        CSS classes, with blanks between them.
    """
    return classed(widgets.HTML(value), classes)


def style() -> widgets.HTML:
    """What gives the page its look; once on every page."""
    rules = "".join((WEB / name).read_text(encoding="utf-8") for name in STYLES)
    return text(f"<style>{rules}</style>", "hg-style")


def card(title: str, *parts: Any) -> widgets.VBox:
    """A card of an app: what belongs together, under a title.

    Parameters
    ----------
    title : str
        Above the parts.
    *parts : ipywidgets.Widget
        From above to below.
    """
    heading = text(f"<h2>{html.escape(title)}</h2>", "hg-title")
    return classed(widgets.VBox([heading, *parts]), "hg-card")


def sections_html(sections: Iterable[Section]) -> str:
    """Tables of names and values, each under its title.

    Parameters
    ----------
    sections : iterable of Section
        From above to below.
    """
    parts = "".join(
        f"<section><h3>{html.escape(section.title)}</h3><table>"
        + "".join(
            f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>"
            for name, value in section.rows
        )
        + "</table></section>"
        for section in sections
    )
    return f'<div class="hg-sections">{parts}</div>'


def status(doing: str, complaint: str, otherwise: str = "") -> str:
    """A line that says how an app stands.

    Parameters
    ----------
    doing : str
        What is being done; empty when nothing is.
    complaint : str
        Why the last piece of work failed; empty if it did not.
    otherwise : str
        What is said when there is neither.
    """
    told = ""
    if complaint:
        told += f'<p class="hg-complaint" role="alert">{html.escape(complaint)}</p>'
    if doing:
        told += f'<p class="hg-doing" role="status">{html.escape(doing)} …</p>'
    elif otherwise and not complaint:
        told += f'<p class="hg-note" role="status">{html.escape(otherwise)}</p>'
    return told


def picture(figure: Any, dpi: int) -> bytes:
    """A figure as PNG.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        Drawn.
    dpi : int
        Dots per inch.
    """
    made = io.BytesIO()
    figure.savefig(made, dpi=dpi)
    return made.getvalue()


def classed(widget: Any, classes: str) -> Any:
    """A widget with CSS classes.

    Parameters
    ----------
    widget : ipywidgets.Widget
        Changed, and returned.
    classes : str
        CSS classes, with blanks between them.
    """
    for name in classes.split():
        widget.add_class(name)
    return widget


def row(label: str, control: Any, tooltip: str) -> Any:
    """A labeled control that explains itself on hover.

    The label is the widget's own description, which the browser ties to the control.

    Parameters
    ----------
    label : str
        In front of the control.
    control : ipywidgets.Widget
        Changed, and returned.
    tooltip : str
        What is shown on hover.
    """
    control.description = label
    return classed(explained(control, tooltip), "hg-row")


def button(title: str, tooltip: str, do: Callable[[], Any], classes: str = "") -> widgets.Button:
    """A button.

    Parameters
    ----------
    title : str
        On the button.
    tooltip : str
        What is shown on hover.
    do : callable
        Called on a click.
    classes : str
        CSS classes, with blanks between them.
    """
    made = widgets.Button(description=title, tooltip=tooltip)
    made.on_click(lambda _: do())
    return classed(made, f"hg-button {classes}".strip())


def choose(options: Any, value: Any, label: str, tooltip: str) -> Any:
    """A drop-down list of titles and values.

    Parameters
    ----------
    options : iterable of (str, object)
        Titles and values.
    value : object
        The one that is chosen at first.
    label : str
        In front of the list.
    tooltip : str
        What is shown on hover.
    """
    return row(label, widgets.Dropdown(options=list(options), value=value), tooltip)


def seconds(value: float) -> str:
    """A time in words, no more exact than an expectation is.

    Parameters
    ----------
    value : float
        Seconds; nan if nothing is known.
    """
    if value != value:
        return ""
    if value < 90:
        return f"{max(1, round(value))} s"
    return f"{value / 60:.0f} min"
