"""Step 6: the download, and the same in Python."""

from __future__ import annotations

import html
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import ipywidgets as widgets

from heartgen.errors import HeartgenError
from heartgen.widgets.parts import choose, classed, head, row, text
from heartgen.widgets.runs import Outcome, siblings
from heartgen.widgets.session import Session
from heartgen.widgets.transfer import MEGABYTE, Copy, Download

TICKED = ("exf", "vtu")
"""Mesh formats that are in the zip unless they are not wanted."""

CELLS = (
    ("the usual of each", ""),
    ("hexahedra of 8 nodes", "hex8"),
    ("hexahedra of 20 nodes", "hex20"),
    ("hexahedra of 27 nodes", "hex27"),
    ("tetrahedra of 4 nodes", "tet4"),
    ("tetrahedra of 10 nodes", "tet10"),
)
"""Cells of the formats that do not hold the mesh itself."""

ALWAYS = "Always: report.json, manifest.json (options, versions, hashes), reproduce.py"


class ExportPanel:
    """What goes into the zip.

    Parameters
    ----------
    session : Session
        The visitor's work.
    """

    def __init__(self, session: Session) -> None:
        self.session = session
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="heartgen-zip")
        self.formats: dict[str, Any] = {}
        self.boxes = widgets.VBox([])
        self.cells = choose(
            CELLS,
            "",
            "Simple cells",
            "Into what the mesh is cut for the formats that are not marked exact; not for surfaces",
        )
        self.report = _check("Report: a page with the 3-D view, opens anywhere", "Add report.html")
        self.figures = _check("Pictures: slices, histograms, mesh", "Add pictures as PNG")
        self.download = Download(
            self._make, title="Download zip", hint="Make the archive and save it"
        )
        self.which = text("", "hg-which")
        self.note = text("", "hg-note")
        self.code = text("", "hg-code")
        self.copy = Copy()
        session.observe(self._draw, ["states", "shown"])
        self.widget = classed(
            widgets.VBox(
                [
                    head(session, "export"),
                    self.which,
                    classed(
                        widgets.HBox(
                            [
                                classed(
                                    widgets.VBox(
                                        [
                                            text("<h3>Mesh</h3>"),
                                            self.boxes,
                                            self.cells,
                                        ]
                                    ),
                                    "hg-take",
                                ),
                                classed(
                                    widgets.VBox(
                                        [
                                            text("<h3>With it</h3>"),
                                            self.report,
                                            self.figures,
                                            text(ALWAYS, "hg-note"),
                                            self.download,
                                            self.note,
                                            text("<h3>The same in Python</h3>"),
                                            self.code,
                                            self.copy,
                                        ]
                                    ),
                                    "hg-python",
                                ),
                            ]
                        ),
                        "hg-columns",
                    ),
                ]
            ),
            "hg-panel",
        )
        self._draw()

    def _draw(self, _: Any = None) -> None:
        self.download.disabled = self.session.states["export"].phase not in ("ready", "done")
        shown = self.session.shown
        self.which.value = "" if shown is None else f"<p>{html.escape(_which(shown))}</p>"
        if shown is None:
            self.code.value = "<p>Run heartgen first.</p>"
            self.copy.text = ""
            return
        from heartgen.widgets.bundle import reproduce

        if not self.formats:
            self.formats = _format_boxes()
            self.boxes.children = tuple(self.formats.values())
        self.copy.text = reproduce(shown)
        self.code.value = f"<pre tabindex=0>{html.escape(self.copy.text)}</pre>"

    def _make(self) -> None:
        """Make the archive in a thread."""
        shown = self.session.shown
        formats = [name for name, box in self.formats.items() if box.value]
        wanted = {
            "report": self.report.value,
            "figures": self.figures.value,
            "cells": self.cells.value or None,
        }
        levels = siblings(self.session, shown)
        self.note.value = "Making the archive …"
        self._pool.submit(self._work, shown, formats, wanted, levels)

    def _work(self, shown: Any, formats: list[str], wanted: dict[str, Any], levels: Any) -> None:
        from heartgen.widgets.bundle import make_bundle

        try:
            name, content = make_bundle(shown, formats, levels=levels, **wanted)
        except HeartgenError as error:
            sentence = str(error)
            self.session.post(lambda: self._failed(sentence))
        except Exception as error:
            sentence = f"the archive cannot be made ({type(error).__name__}: {error})"
            self.session.post(lambda: self._failed(sentence))
        else:
            self.session.post(lambda: self._hand_over(name, content))

    def _failed(self, sentence: str) -> None:
        self.download.busy = False
        self.note.value = html.escape(sentence)

    def _hand_over(self, name: str, content: bytes) -> None:
        self.download.hand_over(name, content)
        self.session.taken = name
        self.note.value = f"{html.escape(name)}, {len(content) / MEGABYTE:.1f} MB"


def _which(shown: Outcome) -> str:
    """Which mesh is handed out."""
    return f"Run {shown.run}: {shown.case.name}, level of detail {shown.lod}, is handed out."


def _format_boxes() -> dict[str, Any]:
    """A box for every mesh format there is."""
    from heartgen.formats import FORMATS, file_name

    return {
        name: _check(str(each), f"Add {file_name('mesh', name)}", ticked=name in TICKED)
        for name, each in FORMATS.items()
    }


def _check(title: str, tooltip: str, ticked: bool = True) -> Any:
    """A box to tick."""
    return classed(row(title, widgets.Checkbox(ticked, indent=False), tooltip), "hg-wide")
