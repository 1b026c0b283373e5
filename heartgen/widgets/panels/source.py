"""Step 1, on the side: a sample, an upload, and what its labels mean."""

from __future__ import annotations

import html
from pathlib import Path
from typing import Any

import ipywidgets as widgets

from heartgen.widgets.input_case import AUTO, BINARY, sample_choices
from heartgen.widgets.parts import button, choose, classed, head, row, text
from heartgen.widgets.session import MAX_UPLOAD, Session
from heartgen.widgets.transfer import MEGABYTE, Upload

OWN = "roles"
"""Scheme of labels that the user writes down."""

SCHEMES = (
    ("A mask, or structures with names", BINARY),
    ("A label map: find its scheme", AUTO),
    ("Labels of ACDC", "acdc"),
    ("Labels of M&Ms", "mnms"),
    ("Labels of EMIDEC", "emidec"),
    ("Labels of MM-WHS", "mmwhs"),
    ("Labels of UK Biobank", "ukbb"),
    ("Labels of TotalSegmentator", "totalsegmentator"),
    ("Labels as written below", OWN),
)

FORMATS = "NIfTI, NRRD, MetaImage, DICOM-SEG or RTSTRUCT"


class SourcePanel:
    """Where the mask comes from.

    Parameters
    ----------
    session : Session
        The visitor's work.
    first : str, optional
        Sample to begin with; None for none.
    """

    def __init__(self, session: Session, first: str | None = None) -> None:
        self.session = session
        self._first = first
        self._uploaded: Path | None = None
        self.sample = choose(
            [("Choose …", ""), *sample_choices()],
            "",
            "Sample",
            "Hearts of known shape, to try heartgen with",
        )
        self.scheme = choose(
            SCHEMES, BINARY, "File is", "What the numbers in an uploaded file stand for"
        )
        self.roles = row(
            "Labels",
            widgets.Text("lv_myocardium=2,lv_pool=3,rv_pool=1", continuous_update=False, layout={}),
            "Roles and their labels: lv_myocardium, lv_pool, rv_pool, rv_myocardium",
        )
        self.roles.layout.display = "none"
        self.frame = row(
            "Frame",
            widgets.Text("", placeholder="ED", continuous_update=False, layout={}),
            "Of a cine: number of the frame from 1, or ED or ES by the volume of the cavity",
        )
        self.frame.layout.display = "none"
        for control in (self.sample, self.scheme, self.roles, self.frame):
            classed(control, "hg-above")
        self.upload = Upload(session.folder, MAX_UPLOAD, self._arrived, self._refused, self._shown)
        limit = text(f"{FORMATS}, up to {MAX_UPLOAD / MEGABYTE:.0f} MB", "hg-note")
        self.about = text("", "hg-note hg-about")
        self.relabel = button(
            "Read it as a label map",
            "Find the scheme of its labels, and read the myocardium",
            self._relabel,
            "hg-primary hg-relabel",
        )
        self.keep = button("", "Leave the refused file, and go on", session.keep, "hg-keep")
        self.sample.observe(self._chosen, "value")
        self.scheme.observe(self._scheme_chosen, "value")
        self.roles.observe(self._read, "value")
        self.frame.observe(self._read, "value")
        session.observe(self._draw, ["case"])
        session.observe(self._draw_ways_on, ["states"])
        self.widget = widgets.VBox(
            [
                head(session, "input"),
                self.relabel,
                self.keep,
                self.sample,
                self.about,
                self.scheme,
                self.roles,
                self.frame,
                self.upload,
                limit,
            ]
        )
        self.widget.add_class("hg-card")
        self._draw_ways_on()

    def _shown(self) -> None:
        """The page is on the screen: what changes before, a browser may miss."""
        first, self._first = self._first, None
        if first is not None and self.session.case is None and not self.session.reading:
            self.sample.value = first

    def _chosen(self, change: Any) -> None:
        if change["new"]:
            self._uploaded = None
            self.frame.layout.display = "none"
            self.session.load_sample(change["new"])

    def _arrived(self, path: Path) -> None:
        """A file is there."""
        self._uploaded = path
        self.frame.layout.display = ""
        self.sample.value = ""
        self._read()

    def _refused(self, sentence: str) -> None:
        self.session.refuse(sentence)

    def _scheme_chosen(self, change: Any) -> None:
        self.roles.layout.display = "" if change["new"] == OWN else "none"
        self._read()

    def _read(self, _: Any = None) -> None:
        """Read the uploaded file anew, as what it is now said to be."""
        if self._uploaded is not None:
            scheme = self.roles.value if self.scheme.value == OWN else self.scheme.value
            self.session.load_file(self._uploaded, scheme, self.frame.value)

    def _relabel(self) -> None:
        """Read the refused file as the label map that it is."""
        self.scheme.value = self.session.offer

    def _draw_ways_on(self, _: Any = None) -> None:
        """After a refusal: read the file as a label map, or go on with the heart before."""
        session = self.session
        refused = session.awaited and bool(session.complaint)
        self.relabel.layout.display = "" if refused and session.offer else "none"
        self.keep.layout.display = "" if refused and session.case else "none"
        self.keep.description = f"Go on with {session.case.name}" if session.case else "Go on"

    def _draw(self, _: Any) -> None:
        case = self.session.case
        self.about.value = html.escape(case.description) if case else ""
