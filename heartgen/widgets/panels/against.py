"""Two results side by side: the table of their differences, and the map of it in the 3-D view."""

from __future__ import annotations

import html
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.parts import choose, classed, text
from heartgen.widgets.runs import Outcome
from heartgen.widgets.session import Session

NOTHING = ("nothing", None)


class AgainstPanel:
    """What the shown mesh is compared with.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.other = choose(
            [NOTHING],
            None,
            "Compare with",
            "Another mesh of this heart; the view then offers the difference as colors",
        )
        self.table = text("", "hg-table hg-against")
        self.other.observe(self._chosen, "value")
        session.observe(self._draw, ["shown", "outcomes"])
        self.widget = classed(
            widgets.VBox([text("<h3>Difference</h3>"), self.other, self.table]), "hg-levels"
        )
        self._draw()

    def _chosen(self, change: Any) -> None:
        self.session.against = change["new"]
        self._draw_table()

    def _draw(self, _: Any = None) -> None:
        """Offer the other meshes of the heart that is shown."""
        shown = self.session.shown
        others = [
            (o.title, o)
            for o in self.session.outcomes
            if shown is not None and o.case is shown.case and o is not shown
        ]
        chosen = self.other.value if self.other.value in [o for _, o in others] else None
        self.other.options = [NOTHING, *others]
        self.other.value = chosen
        self.other.disabled = not others
        self._draw_table()

    def _draw_table(self) -> None:
        shown, other = self.session.shown, self.other.value
        self.table.value = "" if shown is None or other is None else table_html(shown, other)


def table_html(shown: Outcome, other: Outcome) -> str:
    """The figures of two meshes side by side.

    Parameters
    ----------
    shown, other : Outcome
        Of one heart.
    """
    from heartgen.viewing.differences import difference_rows

    heads = "".join(
        f'<th scope="col">{html.escape(name)}</th>'
        for name in (shown.title, other.title, "difference")
    )
    rows = "".join(
        f'<tr><th scope="row">{name}</th>' + "".join(f"<td>{value}</td>" for value in values)
        for name, *values in difference_rows(shown.result.report, other.result.report)
    )
    note = "In the view, color by Difference to see where both are apart."
    return (
        '<div class="hg-scroll" tabindex="0" role="region" aria-label="Difference">'
        f"<table><thead><tr><td></td>{heads}</tr></thead><tbody>{rows}</tbody></table></div>"
        f'<p class="hg-note">{note}</p>'
    )
