"""The way in: every app and every tutorial with a picture and a sentence."""

from __future__ import annotations

import html
from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path

import ipywidgets as widgets

from heartgen.widgets.frame import framed
from heartgen.widgets.parts import classed, text

PICTURES = Path(__file__).parent / "pictures"

ABOUT = "Personalized cubic Hermite meshes of the heart: apps and tutorials"

REPOSITORY = "https://github.com/heartgen/heartgen/blob/HEAD/notebooks/"
"""Where tutorials are read, if they are not beside the apps."""

TUTORIALS = Path("../notebooks")
"""Folder of the tutorials in a checkout, from that of the apps."""

OPENED = "../../../lab/tree/notebooks/"
"""Address of the tutorials in JupyterLab, from that of an app in Voila or in JupyterLab."""


@dataclass(frozen=True)
class Entry:
    """An app or a tutorial.

    Attributes
    ----------
    name : str
        Of its notebook, without the ending, and of its picture.
    title, about : str
        Its name, and a sentence on what one does there.
    """

    name: str
    title: str
    about: str


APPS = (
    Entry(
        "dashboard",
        "Dashboard",
        "A segmentation in, a mesh out: choose a sample or upload a mask, fit it, turn it, cut it "
        "open, assess it, and take it away in one zip.",
    ),
    Entry(
        "tradeoff",
        "Trade-off",
        "What accuracy costs in quality: levels of detail, numbers of elements and weights of one "
        "heart or of several, plotted as they are fitted.",
    ),
    Entry(
        "states",
        "States",
        "One heart at the end of diastole and of systole: both in one view, ejection fraction, "
        "strains and bull's-eye plots.",
    ),
)

LESSONS = (
    Entry(
        "01_from_mask_to_mesh",
        "1. From mask to mesh",
        "The steps of the method on a sample heart, each with a picture of what it did.",
    ),
    Entry(
        "02_accuracy_and_quality",
        "2. Accuracy and quality",
        "How close a mesh lies to its mask, how good its elements are, and how to weigh both.",
    ),
    Entry(
        "03_fields_and_files",
        "3. Fields and files",
        "Fibers, coordinates and segments on the mesh, and the formats of the field's tools.",
    ),
)


def index() -> widgets.Widget:
    """Make the page that leads to all apps and tutorials.

    Returns
    -------
    ipywidgets.Widget
        Show it as the last line of a notebook's cell.
    """
    beside = TUTORIALS.is_dir()
    apps = "".join(_card(entry, f"{entry.name}.ipynb", new=False) for entry in APPS)
    lessons = "".join(
        _card(entry, f"{OPENED if beside else REPOSITORY}{entry.name}.ipynb", new=True)
        for entry in LESSONS
    )
    shown = text(
        f'<h2>Apps</h2><nav aria-label="Apps">{apps}</nav>'
        f'<h2>Tutorials</h2><nav aria-label="Tutorials">{lessons}</nav>',
        "hg-index",
    )
    return framed([classed(widgets.VBox([shown]), "hg-panel")], ABOUT, linked=False)


def _card(entry: Entry, address: str, new: bool) -> str:
    """A link with a picture, a title and a sentence."""
    picture = b64encode((PICTURES / f"{entry.name}.jpg").read_bytes()).decode()
    where = ' target="_blank" rel="noopener"' if new else ""
    return (
        f'<a href="{address}"{where}><img src="data:image/jpeg;base64,{picture}" alt="">'
        f"<b>{html.escape(entry.title)}</b><span>{html.escape(entry.about)}</span></a>"
    )
