"""Step 2, on the side: what heartgen shall do, what each choice means, and what it will cost."""

from __future__ import annotations

from typing import Any

import ipywidgets as widgets

from heartgen.errors import HeartgenError
from heartgen.options import OPTIONS
from heartgen.options.option import by_step
from heartgen.widgets.costs import n_elements
from heartgen.widgets.option_controls import OptionControl, option_control
from heartgen.widgets.parts import button, classed, head, seconds, text
from heartgen.widgets.session import Session

LEVELS = {1: "most stable", 3: "a good balance", 5: "most accurate"}
"""Notes on levels of detail."""


class OptionsPanel:
    """The choices: a control for each option of heartgen, those that few need folded away by step.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self.controls: dict[str, OptionControl] = {
            name: option_control(option, session.choices) for name, option in OPTIONS.items()
        }
        self.level_note = text("", "hg-note hg-indented")
        self.cost = text("", "hg-cost")
        lod = self.controls["lod"]
        lod.widget.children = (*lod.inputs, self.level_note, lod.note)
        basic = [self.controls[k].widget for k, o in OPTIONS.items() if o.about.level == "basic"]
        others = by_step(o for o in OPTIONS.values() if o.about.level == "advanced")
        groups: list[Any] = []
        for step, options in others.items():
            groups.append(text(f"<h3>{step}</h3>", "hg-group"))
            groups += [self.controls[option.name].widget for option in options]
        self.rest = classed(widgets.VBox(groups), "hg-rest")
        self.more = button("", "All options, by the step that they change", self._unfold)
        classed(self.more, "hg-more")
        self.widget = classed(
            widgets.VBox(
                [
                    head(session, "choices"),
                    *basic,
                    self.more,
                    self.rest,
                    self.cost,
                ]
            ),
            "hg-card hg-choices",
        )
        self._unfolded = True
        self._unfold()
        session.choices.observe(self._draw)
        session.observe(self._draw, ["cost_revision", "anatomy", "outcomes", "case"])
        self._draw()

    def _unfold(self) -> None:
        """Show or hide the choices that most runs leave alone, and a sentence on each."""
        self._unfolded = not self._unfolded
        self.rest.layout.display = "" if self._unfolded else "none"
        self.more.description = "▾ Fewer choices" if self._unfolded else "▸ More choices"
        (self.widget.add_class if self._unfolded else self.widget.remove_class)("hg-unfolded")

    def _draw(self, _: Any = None) -> None:
        """Show what belongs to the choices of the moment, and what they cost."""
        choices = self.session.choices
        self.level_note.value = LEVELS.get(choices.lod, "&nbsp;")
        for control in self.controls.values():
            control.draw(choices)
        try:
            expected = seconds(self.session.expected_seconds())
            count = n_elements(choices.options(), self.session.both)
            self.cost.value = f"about <b>{expected}</b> · {count} elements"
        except HeartgenError as error:
            self.cost.value = str(error)
