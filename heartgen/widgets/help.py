"""Help on the page: a tour, the glossary, keyboard shortcuts, and links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import anywidget
from traitlets import Dict, List

from heartgen import GLOSSARY
from heartgen.widgets.glossary import rows
from heartgen.widgets.transfer import WEB

REPOSITORY = "https://github.com/heartgen/heartgen"

LINKS = (
    ("The paper: Lamata et al. (2014)", "https://doi.org/10.1098/rsif.2013.1023"),
    ("Tutorials", f"{REPOSITORY}/tree/HEAD/notebooks"),
    ("How to cite", f"{REPOSITORY}/blob/HEAD/CITATION.cff"),
    ("Source", REPOSITORY),
    ("The glossary as a page", GLOSSARY),
)
"""Titles and addresses."""


@dataclass(frozen=True)
class Stop:
    """A step of the tour.

    Attributes
    ----------
    place : str
        CSS selector of what is shown.
    title, text : str
        What is said of it.
    click : str
        CSS selector of what is clicked before; empty for nothing.
    """

    place: str
    title: str
    text: str
    click: str = ""


@dataclass(frozen=True)
class Shortcut:
    """A key that does what a click does.

    Attributes
    ----------
    key : str
        As browsers name it.
    title : str
        What it does.
    click : str
        CSS selector of what is clicked.
    """

    key: str
    title: str
    click: str


TOUR = (
    Stop(
        ".hg-side .hg-card:has(.hg-step-input)",
        "Input",
        "Choose a sample, or upload a segmentation: a mask of the myocardium, or a label map.",
    ),
    Stop(
        ".hg-side .hg-choices",
        "Choices",
        "The level of detail weighs accuracy against stability. The others have good defaults; "
        "each explains itself under the mouse.",
    ),
    Stop(
        ".hg-side .hg-card:has(.hg-step-run)",
        "Run",
        "Run fits one mesh, All levels fits five to compare. Every run stays in the list.",
    ),
    Stop(
        ".hg-slices",
        "Slices",
        "What was read, in three slices through the heart, and what the checks found below.",
        ".hg-tab-input",
    ),
    Stop(
        ".hg-look",
        "View",
        "The mesh in 3-D, from the template to the optimized mesh: color it by error or quality, "
        "cut it open, lay it over the mask.",
        ".hg-tab-view",
    ),
    Stop(
        "#hg-panel-assess",
        "Assess",
        "One verdict, and what it rests on: distances, the quality Q of the elements, fairness, "
        "and the levels compared.",
        ".hg-tab-assess",
    ),
    Stop(
        "#hg-panel-export",
        "Export",
        "The mesh in the formats of your tools, a report, and the same in Python.",
        ".hg-tab-export",
    ),
)
"""Of the dashboard."""

SHORTCUTS = (
    Shortcut("1", "Slices", ".hg-tab-input"),
    Shortcut("4", "View", ".hg-tab-view"),
    Shortcut("5", "Assess", ".hg-tab-assess"),
    Shortcut("6", "Export", ".hg-tab-export"),
    Shortcut("r", "Run", ".hg-start"),
    Shortcut("c", "Cancel the run", ".hg-cancel"),
    Shortcut("m", "More or fewer choices", ".hg-choices .hg-more"),
)
"""Of the dashboard; the help has its own beside them."""


class Help(anywidget.AnyWidget):
    """A button in the header, and the help that it opens.

    Parameters
    ----------
    tour : sequence of Stop
        Empty for no tour.
    shortcuts : sequence of Shortcut
        Beside that of the help itself.
    **traits : object
        First values of the attributes.
    """

    _esm = WEB / "help.js"
    tour: List[dict[str, str]] = List().tag(sync=True)
    shortcuts: List[dict[str, str]] = List().tag(sync=True)
    words: List[dict[str, str]] = List().tag(sync=True)
    links: Dict[str, str] = Dict(dict(LINKS)).tag(sync=True)

    def __init__(
        self, tour: Sequence[Stop] = (), shortcuts: Sequence[Shortcut] = (), **traits: Any
    ) -> None:
        super().__init__(
            tour=[asdict(each) for each in tour],
            shortcuts=[asdict(each) for each in shortcuts],
            words=rows(),
            **traits,
        )
