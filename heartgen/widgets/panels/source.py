"""Step 1, on the side: a sample, an upload, and what its labels mean."""

from __future__ import annotations

import html
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import ipywidgets as widgets

from heartgen.errors import HeartgenError, InputError
from heartgen.widgets.hearts import hearts_in, may_have_frames
from heartgen.widgets.input_case import AUTO, BINARY, sample_choices
from heartgen.widgets.keeping.archive import ENDING
from heartgen.widgets.panels.several import SeveralPanel
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

FORMATS = "NIfTI, NRRD, MetaImage, DICOM-SEG or RTSTRUCT; several files, or a zip of them"


class SourcePanel:
    """Where the mask comes from.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._uploaded: Path | None = None
        self._recalling = False
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
        self.opened: Callable[[Path], None] | None = None
        folder = partial(getattr, session, "folder")
        self.upload = Upload(
            folder,
            MAX_UPLOAD,
            self._arrived,
            self._refused,
            in_use=lambda: bool(session.queue),
            several=True,
            title="Upload files",
        )
        limit = text(
            f"{FORMATS}, up to {MAX_UPLOAD / MEGABYTE:.0f} MB; or a session that was saved",
            "hg-note",
        )
        self.several = SeveralPanel(session)
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
        session.observe(self._draw, ["case", "origin"])
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
                self.several.widget,
            ]
        )
        self.widget.add_class("hg-card")
        self._draw_ways_on()

    def _chosen(self, change: Any) -> None:
        if change["new"] and not self._recalling:
            self._uploaded = None
            self.session.hearts = []
            self.frame.layout.display = "none"
            self.session.load_sample(change["new"])

    def _arrived(self, path: Path) -> None:
        """A file is there: an image, or a session that was saved."""
        if path.suffix == ENDING and self.opened is not None:
            self.opened(path)
            return
        try:
            if path.is_dir() and (beside := next(path.glob(f"*{ENDING}"), None)):
                raise InputError(f"{beside.name} is a session that was saved: upload it by itself.")
            hearts = hearts_in(path)
        except HeartgenError as error:
            self.session.refuse(str(error))
            return
        framed = any(map(may_have_frames, hearts))
        self._uploaded = None  # so that nothing is read anew by what follows
        if not framed:
            self.frame.value = ""
        self.frame.layout.display = "" if framed else "none"
        self._uploaded = hearts[0]
        self.sample.value = ""
        self.session.refused = []
        several = hearts if len(hearts) > 1 else []
        self.session.hearts = [{"file": str(path)} for path in several]
        self._read()

    def recall(self) -> None:
        """Say of the input that was brought back where it comes from."""
        origin = self.session.origin
        self._uploaded = None  # so that nothing is read anew by what follows
        known = {value for _, value in SCHEMES}
        self._recalling = True
        self.sample.value = origin.get("sample", "")
        self._recalling = False
        if "file" not in origin:
            return
        scheme = origin["scheme"]
        self.scheme.value = scheme if scheme in known else OWN
        if scheme not in known:
            self.roles.value = scheme
        self.frame.value = origin["frame"]
        self.frame.layout.display = ""
        self._uploaded = Path(origin["file"])
        self.upload.recall(self._uploaded)

    def _refused(self, sentence: str) -> None:
        self.session.refuse(sentence)

    def _scheme_chosen(self, change: Any) -> None:
        self.roles.layout.display = "" if change["new"] == OWN else "none"
        self._read()

    def _read(self, _: Any = None) -> None:
        """Read the uploaded file anew, as what it is now said to be; of several, what is shown."""
        if self._uploaded is None:
            return
        session, (scheme, frame) = self.session, self._said()
        hearts = [{**heart, "scheme": scheme, "frame": frame} for heart in session.hearts]
        at = session.origin.get("file", "")
        if any(heart["file"] == at for heart in hearts):
            self._uploaded = Path(at)
        session.hearts = hearts
        if self.several.together.value and hearts:
            self.several.look()
        else:
            session.load_file(self._uploaded, scheme, frame)

    def _said(self) -> tuple[str, str]:
        """Scheme and frame, as the visitor says they are."""
        scheme = self.roles.value if self.scheme.value == OWN else self.scheme.value
        return scheme, self.frame.value

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
        """Say what the input is; one that a run was made of, and is shown again, is known, too."""
        case = self.session.case
        if self.session.origin.get("sample", "") != self.sample.value:
            self.recall()
        self.about.value = html.escape(case.description) if case else ""
