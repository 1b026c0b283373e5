"""Step 2, on the side: what heartgen shall do, what each choice means, and what it will cost."""

from __future__ import annotations

from typing import Any

import ipywidgets as widgets
from traitlets import link

from heartgen.errors import HeartgenError
from heartgen.widgets.costs import n_elements
from heartgen.widgets.parts import button, choose, classed, head, row, seconds, text
from heartgen.widgets.run_options import (
    BASES,
    INSERTIONS,
    LEVELS,
    MOST_ELEMENTS,
    TOPOLOGIES,
    TRANSMURAL_LINES,
    TRUNCATIONS,
    VENTRICLES,
    Alternative,
)
from heartgen.widgets.session import Session


class OptionsPanel:
    """The choices.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        c = session.choices
        self.lod = row(
            "Level of detail",
            widgets.IntSlider(c.lod, 1, 5, continuous_update=False),
            "How closely the mesh follows the mask: 1 is most stable, 5 most accurate. "
            "The paper uses 1 for left ventricles and 2 for both.",
        )
        self.level_note = text("", "hg-note hg-indented")
        self.ventricles = choose(
            [(title, key) for key, title in VENTRICLES.items()],
            c.ventricles,
            "Heart",
            "What the mask shows; heartgen recognizes it",
        )
        self.default_elements = row(
            "Default element numbers",
            widgets.Checkbox(c.default_elements, indent=False),
            "1×12×6 for a left ventricle (as in the paper), 2×12×8 for both (the paper has 2×9×8)",
        )
        self.numbers = {
            name: row(
                label,
                widgets.BoundedIntText(
                    getattr(c, name), min=3 if name == "circumferential" else 1, max=most
                ),
                tip,
            )
            for name, label, tip, most in (
                ("radial", "Radial", "Elements across the wall", MOST_ELEMENTS[0]),
                ("circumferential", "Around", "Elements around the long axis", MOST_ELEMENTS[1]),
                ("longitudinal", "Along", "Elements from apex to base", MOST_ELEMENTS[2]),
            )
        }
        self.numbers_box = classed(widgets.HBox(list(self.numbers.values())), "hg-numbers")
        self.truncation = choose(
            [(title, key) for key, title in TRUNCATIONS.items()],
            c.truncation,
            "Cut the base",
            "Valve anatomy at the base is not part of the mesh: cut the mask below it. "
            "The paper cuts by 5 mm.",
        )
        self.distance = row(
            "Below plane (mm)",
            widgets.BoundedFloatText(c.distance, min=0, max=40, step=1),
            "Distance of the cut below the basal plane, mm",
        )
        self.quality = row(
            "Quality weight",
            widgets.FloatLogSlider(
                c.quality,
                base=10,
                min=-1,
                max=1,
                step=0.1,
                continuous_update=False,
                readout_format=".2g",
            ),
            "Weight of element quality against accuracy in the optimization; 1 is the default",
        )
        self.optimize = row(
            "Optimize beyond the paper",
            widgets.Checkbox(c.optimize, indent=False),
            "Without it, heartgen stops after the paper's four steps",
        )
        self.enhance = row(
            "Straighten across the wall",
            widgets.Checkbox(c.enhance, indent=False),
            "The paper's fourth step: better elements, surfaces unmoved",
        )
        self.apex = self._kind("Apex", TOPOLOGIES, "topology")
        self.insertion = self._kind("RV insertion", INSERTIONS, "insertion")
        self.transmural_lines = self._kind("Transmural lines", TRANSMURAL_LINES, "transmural_lines")
        self.basis = self._kind("Basis", BASES, "basis")
        self.cost = text("", "hg-cost")
        for name, control in {
            "lod": self.lod,
            "ventricles": self.ventricles,
            "default_elements": self.default_elements,
            **self.numbers,
            "truncation": self.truncation,
            "distance": self.distance,
            "quality": self.quality,
            "optimize": self.optimize,
            "enhance": self.enhance,
        }.items():
            link((c, name), (control, "value"))
        c.observe(self._draw)
        session.observe(self._draw, ["cost_revision", "anatomy", "outcomes", "case"])
        self.rest = classed(
            widgets.VBox(
                [
                    self.ventricles,
                    self.default_elements,
                    self.numbers_box,
                    self.truncation,
                    self.distance,
                    self.quality,
                    self.enhance,
                    self.optimize,
                    self.apex,
                    self.insertion,
                    self.transmural_lines,
                    self.basis,
                ]
            ),
            "hg-rest",
        )
        self.more = button("", "Heart, elements, base, quality, steps, apex, basis", self._unfold)
        classed(self.more, "hg-more")
        self._unfolded = True
        self._unfold()
        self.widget = classed(
            widgets.VBox(
                [
                    head(session, "choices"),
                    self.lod,
                    self.level_note,
                    self.more,
                    self.rest,
                    self.cost,
                ]
            ),
            "hg-card",
        )
        self._draw()

    def _unfold(self) -> None:
        """Show or hide the choices that most runs leave alone."""
        self._unfolded = not self._unfolded
        self.rest.layout.display = "" if self._unfolded else "none"
        self.more.description = "▾ Fewer choices" if self._unfolded else "▸ More choices"

    def _kind(self, label: str, kinds: tuple[Alternative, ...], name: str) -> Any:
        """A list of kinds."""
        tip = " ".join(f"{kind.title}: {kind.explanation}" for kind in kinds)
        made = choose([(k.title, k.key) for k in kinds], kinds[0].key, label, tip)
        link((self.session.choices, name), (made, "value"))
        return made

    def _draw(self, _: Any = None) -> None:
        """Show what belongs to the choices of the moment, and what they cost."""
        c = self.session.choices
        self.level_note.value = LEVELS[c.lod] or "&nbsp;"
        self.numbers_box.layout.display = "none" if c.default_elements else ""
        self.distance.layout.display = "" if c.truncation == "distance" else "none"
        for control in (self.quality, self.insertion, self.transmural_lines):
            control.disabled = not c.optimize
        try:
            expected = seconds(self.session.expected_seconds())
            count = n_elements(c.options(), self.session.both)
            self.cost.value = f"about <b>{expected}</b> · {count} elements"
        except HeartgenError as error:
            self.cost.value = str(error)
