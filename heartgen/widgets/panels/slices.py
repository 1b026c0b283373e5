"""Step 1, in the middle: three slices to move through, and what the checks found."""

from __future__ import annotations

import html
import io
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.hints import explained, marked
from heartgen.widgets.parts import classed, text
from heartgen.widgets.session import Session

DPI = 100
"""Of a slice: 360 pixels across."""

STEPS = 60
"""Places a slider stops at."""

ML = 1000.0
"""mm^3 in a milliliter."""

BROKEN = ("first", "second", "third")
"""Names of an image's axes, where no heart is known."""


class SlicesPanel:
    """Slices along the axes of the heart, or of the image as long as no heart is known.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._view: Any = None
        self.images = [
            marked(widgets.Image(format="png"), alt=f"Slice {i + 1} of the mask") for i in range(3)
        ]
        self.titles = [text("", "hg-slice-title") for _ in range(3)]
        self.sliders = [
            explained(
                widgets.FloatSlider(
                    description=f"Slice {i + 1}",
                    continuous_update=False,
                    readout_format=".0f",
                    disabled=True,
                ),
                "Move the slice through the heart",
            )
            for i in range(3)
        ]
        for i, slider in enumerate(self.sliders):
            slider.observe(lambda change, i=i: self._move(i), "value")
        columns = [
            classed(widgets.VBox([title, image, slider]), "hg-slice")
            for title, image, slider in zip(self.titles, self.images, self.sliders, strict=True)
        ]
        self.title = text("", "hg-title")
        self.key = text("", "hg-key")
        self.findings = text("", "hg-findings")
        self.widget = classed(
            widgets.VBox(
                [
                    self.title,
                    classed(widgets.HBox(columns), "hg-slices"),
                    self.key,
                    self.findings,
                ]
            ),
            "hg-panel",
        )
        session.observe(self._draw, ["case", "anatomy", "complaint"])
        self._draw()

    def _draw(self, _: Any = None) -> None:
        """Show another mask, or what is now known of it."""
        case = self.session.case
        self.findings.value = findings_html(self.session)
        name = "The mask" if case is None else html.escape(case.name)
        self.title.value = f"<h2>{name} in three slices</h2>"
        if case is None:
            for image in self.images:
                image.value = blank()
            return
        from heartgen.viewing.slice_views import SLICES, slice_view

        view = slice_view(case.mask, self.session.anatomy)
        self._view = None  # the sliders say nothing while they are set
        for i, slice_ in enumerate(SLICES):
            across = 3 - slice_.across - slice_.up
            low, high = float(view.low[across]), float(view.high[across])
            slider = self.sliders[i]
            slider.min, slider.max = min(low, slider.min), max(high, slider.max)
            slider.value = float(view.center[across])
            slider.min, slider.max = low, high
            slider.step = (high - low) / STEPS
            slider.disabled = False
            self.titles[i].value = (
                slice_.title.replace(", at the thin line", "").capitalize()
                if self.session.anatomy is not None
                else f"Across the {BROKEN[across]} axis of the image"
            )
        self._view = view
        for i in range(3):
            self._move(i)
        self.key.value = key_html(self.session)

    def _move(self, i: int) -> None:
        """Draw a slice anew."""
        if self._view is None:
            return
        from heartgen.viewing.slice_views import SLICES, draw_slice

        buffer = io.BytesIO()
        draw_slice(self._view, SLICES[i], self.sliders[i].value).savefig(buffer, dpi=DPI)
        self.images[i].value = buffer.getvalue()


def key_html(session: Session) -> str:
    """What the colors of the slices mean.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """
    from heartgen.viewing.slice_views import MYOCARDIUM, line_colors

    names = [(MYOCARDIUM, "mask")]
    if session.anatomy is not None:
        names += [(color, name) for name, color in line_colors(session.anatomy).items()]
    return "".join(f'<span><i style="background:{c}"></i>{name}</span>' for c, name in names)


def findings_html(session: Session) -> str:
    """What is in the mask: its sizes, and what the checks found.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """
    case, anatomy = session.case, session.anatomy
    if session.complaint:
        sentence = "<br>".join(html.escape(line) for line in session.complaint.splitlines())
        return f'<p class="hg-complaint" role="alert">{sentence}</p>'
    if case is None:
        return '<p class="hg-empty">Choose a sample, or upload a mask of the myocardium.</p>'
    from heartgen.viewing.card import number

    mask = case.mask
    facts = [
        ("voxels", " × ".join(map(str, mask.voxels.shape))),
        ("voxel size", " × ".join(f"{s:.3g}" for s in mask.spacing) + " mm"),
        ("myocardium", f"{number(mask.volume / ML)} ml"),
    ]
    notes = [*mask.findings]
    if anatomy is not None:
        cut = anatomy.base.truncation
        facts += [
            ("heart", "left ventricle" if anatomy.rv is None else "both ventricles"),
            ("cavity", f"{number(anatomy.length)} mm long, {number(anatomy.radius)} mm radius"),
            ("wall", f"{number(anatomy.wall_thickness)} mm"),
            ("base", "not cut" if cut is None else f"cut by {number(cut)} mm"),
        ]
        notes += anatomy.findings
    rows = "".join(
        f"<div><dt>{name}</dt><dd>{html.escape(value)}</dd></div>" for name, value in facts
    )
    if notes:
        told = "".join(f"<li>{html.escape(note.message)}</li>" for note in notes)
        checks = f"<h3>What the checks found</h3><ul>{told}</ul>"
    else:
        checks = '<p class="hg-fine">The checks found nothing to mend.</p>'
    return f'<dl class="hg-facts">{rows}</dl>{checks}'


def blank() -> bytes:
    """An empty picture of the size of a slice."""
    return (
        b"\x89PNG\r\n\x1a\n\x00\x00\x00\rIHDR\x00\x00\x00\x01\x00\x00\x00\x01\x08\x06\x00\x00\x00"
        b"\x1f\x15\xc4\x89\x00\x00\x00\rIDATx\x9cc\xf8\xff\xff?\x03\x00\x08\xfc\x02\xfe\xa7\x9a"
        b"\xa0\xa0\x00\x00\x00\x00IEND\xaeB`\x82"
    )
