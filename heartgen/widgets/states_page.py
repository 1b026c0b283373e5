"""The states of one heart: both extremes in 3-D, ejection fraction, strains, bull's-eye plots."""

from __future__ import annotations

import atexit
import html
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import ipywidgets as widgets

from heartgen.widgets.file_panel import FilePanel
from heartgen.widgets.frame import framed, two_sided
from heartgen.widgets.panels.view import key_html
from heartgen.widgets.parts import (
    button,
    card,
    choose,
    classed,
    row,
    sections_html,
    status,
    text,
)
from heartgen.widgets.runs import ALL_LEVELS, post_on_loop
from heartgen.widgets.states_session import Compared, StatesSession
from heartgen.widgets.transfer import Download
from heartgen.widgets.view_place import ViewPlace

if TYPE_CHECKING:
    from heartgen.widgets.states_session import HeartState

ABOUT = "One heart in several states: ejection fraction, strains, and where the wall thickens"

FIRST = "lv"
"""Beat that is loaded when the page opens."""

FORMATS = "Meshes (VTU, EXF, EX1); masks, label maps and cines, which are fitted"

PLAIN = ""
"""Coloring of the solid mesh by one color."""

BEATS = (
    ("Left ventricle, diastole and systole", "lv"),
    ("Both ventricles, diastole and systole", "biv"),
)
"""As in `heartgen.samples.beats`; a test compares."""


def states(beat: str | None = FIRST) -> widgets.Widget:
    """Make the app that compares states of a heart.

    Parameters
    ----------
    beat : str or None
        Sample to load as soon as the page is on the screen: ``"lv"`` or ``"biv"``.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell. Its `session` is the state behind the page.
    """
    page = StatesPage(beat)
    page.widget.session = page.session
    page.widget.page = page
    return page.widget


class StatesPage:
    """Controls, the 3-D view, and what was measured.

    Parameters
    ----------
    first : str, optional
        Sample to begin with; None for none.
    """

    def __init__(self, first: str | None = None) -> None:
        self.session = StatesSession(post_on_loop())
        atexit.register(self.session.close)
        session = self.session
        self.cine = row(
            "Cine: take end diastole and end systole",
            widgets.Checkbox(False, indent=False),
            "Of a file with many frames: those with the largest and the smallest cavity",
        )
        self.source = FilePanel(
            session.folder, BEATS, session.load_beat, self._arrived, session.refuse, FORMATS
        )
        self.source.first = first
        self.lod = choose(
            [(f"{level}", level) for level in ALL_LEVELS],
            session.lod,
            "Level of detail",
            "At which masks are fitted; the same for all states",
        )
        widgets.link((self.lod, "value"), (session, "lod"))
        self.status = text("", "hg-status")
        self.list = classed(widgets.VBox([]), "hg-runs")
        self.clear = button("Begin anew", "Remove all states", self._clear, "hg-small-wide")
        self.solid = choose([], None, "Solid", "State that is drawn solid")
        self.around = choose([], None, "Around it", "State through which the solid one is seen")
        self.color = choose(
            [("One color", PLAIN)], PLAIN, "Color by", "What the colors of the solid mesh show"
        )
        self.place = ViewPlace(self._draw_scene, session.post, self._told)
        self.key = text("", "hg-scale")
        self.result = text("", "hg-report")
        self.plots = classed(widgets.Box([]), "hg-plots")
        self.table = Download(self._save_table, title="Table (CSV)", hint="Save all values as CSV")
        self.report = Download(
            self._save_page, title="Page (HTML)", hint="Save a page with the 3-D view"
        )
        self._pairs: dict[str, HeartState] = {}
        for control in (self.solid, self.around, self.color):
            control.observe(self._draw_scene, "value")
        session.observe(self._draw_status, ["doing", "complaint", "states"])
        session.observe(self._draw_states, ["states"])
        session.observe(self._draw_results, ["compared"])
        self.widget = framed([two_sided(self._side(), [self._middle()])], ABOUT, "heartgen states")
        self._draw_status()
        self._draw_results()

    def _side(self) -> list[Any]:
        """Cards with controls."""
        return [
            self.source.card("1. Hearts", self.cine, self.lod),
            card("2. States", self.status, self.list, self.clear),
            card("3. Export", classed(widgets.HBox([self.table, self.report]), "hg-buttons")),
        ]

    def _middle(self) -> Any:
        """The 3-D view, and what was measured below it."""
        controls = classed(widgets.HBox([self.solid, self.around, self.color]), "hg-controls")
        look = classed(widgets.VBox([self.place.widget, self.key, controls]), "hg-look")
        return classed(widgets.VBox([look, self.result, self.plots]), "hg-panel hg-stack")

    def _arrived(self, path: Path, scheme: str) -> None:
        self.session.add_file(path, scheme, self.cine.value)

    def _clear(self) -> None:
        self.session.clear()

    def _draw_status(self, _: Any = None) -> None:
        """Say how the work stands."""
        session = self.session
        n = len(session.states)
        more = (
            f"{n} states are compared"
            if n > 1
            else "choose a sample, or upload at least two meshes or masks of one heart"
        )
        self.status.value = status(session.doing, session.complaint, more)

    def _draw_states(self, _: Any = None) -> None:
        """List the states, and have a choice among them."""
        session = self.session
        self.list.children = [self._entry(state) for state in session.states]
        self._pairs = {state.name: state for state in session.states}
        self.clear.disabled = not session.states
        self.place.open()
        if not self._pairs:
            return
        names = list(self._pairs)
        for choice, at in ((self.solid, -1), (self.around, 0)):
            kept = choice.value if choice.value in names else names[at]
            choice.options = names
            choice.value = kept
        self._draw_scene()

    def _entry(self, state: HeartState) -> Any:
        """A state in the list."""
        told = f"<b>{html.escape(state.name)}</b><span>{html.escape(state.origin)}</span>"
        away = button(
            "Remove",
            f"Compare without {state.name}",
            partial(self.session.remove, state),
            "hg-small-wide",
        )
        return classed(widgets.HBox([text(told, "hg-run-label"), away]), "hg-run")

    def _draw_results(self, _: Any = None) -> None:
        """Show what was measured."""
        found: Compared | None = self.session.compared
        for download in (self.table, self.report):
            download.disabled = found is None
        if found is None:
            self.result.value, self.plots.children = "", ()
            self.color.options = [("One color", PLAIN)]
            return
        from heartgen.viewing.bullseye_svg import bullseye_html

        self.result.value = comparison_html(found)
        self.plots.children = [
            text(bullseye_html(shown), "hg-bullseye") for shown in found.bullseyes
        ]
        chosen = self.color.value
        titles = [(f"Segments: {shown.title}", shown.key) for shown in found.bullseyes]
        self.color.options = [("One color", PLAIN), *titles]
        self.color.value = chosen if chosen in [key for _, key in titles] else PLAIN
        extremes = found.comparison.names
        self.solid.value = extremes[found.comparison.systole]
        self.around.value = extremes[found.comparison.diastole]

    def _draw_scene(self, _: Any = None) -> None:
        """Have the scene made in the thread, then show it."""
        solid, around = (self._pairs.get(c.value) for c in (self.solid, self.around))
        if self.place.view is None or solid is None or around is None:
            return
        found: Compared | None = self.session.compared
        shown = [] if found is None else found.bullseyes
        by = next((each for each in shown if each.key == self.color.value), None)

        def scene() -> Any:
            from heartgen.widgets.states_scene import Overlay, states_scene

            names = solid.name, around.name
            return states_scene(Overlay(solid.mesh, around.mesh, names, by))

        self.place.make(scene, self._show, self._failed)

    def _show(self, scene: Any) -> None:
        self.place.view.show(scene, reset=True, can_play=len(self._pairs) > 1)
        self.key.value = key_html(scene.painted, False)

    def _told(self, message: dict[str, Any]) -> None:
        """The view asks for the way from one state to the other."""
        solid, around = (self._pairs.get(c.value) for c in (self.solid, self.around))
        if message["kind"] == "play" and solid is not None and around is not None:
            states = [(state.name, state.mesh) for state in (solid, around)]
            self.place.make(lambda: _moving(states), self.place.view.move, self._failed)

    def _failed(self, sentence: str) -> None:
        self.key.value = html.escape(sentence)

    def _save_table(self) -> None:
        self.table.hand_over("states.csv", self.session.table().encode())

    def _save_page(self) -> None:
        """Make the page with the 3-D view."""
        from heartgen.viewing import compare_html

        found: Compared = self.session.compared
        meshes = [state.mesh for state in found.states]
        with TemporaryDirectory(prefix="heartgen-") as folder:
            path = Path(folder) / "states.html"
            compare_html(found.comparison, meshes, path, ", ".join(found.comparison.names))
            self.report.hand_over(path.name, path.read_bytes())


def _moving(states: list[tuple[str, Any]]) -> Any:
    """The solid mesh on its way to the other."""
    from heartgen.widgets.states_scene import states_moving

    return states_moving(states)


def comparison_html(found: Compared) -> str:
    """The ejection fraction, what changes, and a column of indices for each state.

    Parameters
    ----------
    found : Compared
        States that were compared.
    """
    from heartgen.viewing import states as table

    said = table.headline(found.comparison)
    notes = "".join(f"<li>{html.escape(note)}</li>" for note in found.comparison.notes)
    columns = table.states(found.comparison)
    heads = "".join(f'<th scope="col">{html.escape(name)}</th>' for name in columns.names)
    rows = "".join(
        f"<tr><td>{html.escape(name)}</td>"
        + "".join(f"<td>{html.escape(value)}</td>" for value in values)
        + "</tr>"
        for name, values in columns.rows
    )
    return (
        f'<p class="hg-verdict hg-{"doubtful" if notes else "good"}"><b>'
        f"{html.escape(said[0].upper() + said[1:])}</b></p>"
        f"{f'<ul>{notes}</ul>' if notes else ''}"
        f"{sections_html(table.changes(found.comparison))}"
        '<div class="hg-table"><h3>States</h3>'
        '<div class="hg-scroll" tabindex="0" role="region" aria-label="States">'
        f"<table><thead><tr><td></td>{heads}</tr></thead><tbody>{rows}</tbody></table></div></div>"
    )
