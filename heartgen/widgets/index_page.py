"""The way in: every app and every tutorial with a picture and a sentence."""

from __future__ import annotations

import html
from base64 import b64encode
from dataclasses import dataclass
from pathlib import Path

import ipywidgets as widgets

from heartgen.widgets.frame import framed, main_part
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
        "01_first_mesh",
        "1. Your first mesh",
        "From a segmentation to a mesh, its report, and a file, in one line each.",
    ),
    Entry(
        "02_hermite",
        "2. What a high-order mesh is",
        "Drag a derivative, break a C1 node, and measure why few curved elements do.",
    ),
    Entry(
        "03_shape_analysis",
        "3. Shape analysis",
        "How axes and sizes of a heart are found without a landmark.",
    ),
    Entry(
        "04_template",
        "4. The template",
        "Ideal hearts, three kinds of apex, versions and the insertion line.",
    ),
    Entry(
        "05_registration",
        "5. Registration",
        "Watch it iterate; node spacing, smoothness, and how folds are ruled out.",
    ),
    Entry(
        "06_warping",
        "6. Warping",
        "The whole continuum is carried along, not the nodes alone.",
    ),
    Entry(
        "07_quality",
        "7. Quality",
        "What the Jacobian ratio measures, how it is gamed, and the certificate.",
    ),
    Entry(
        "08_tradeoff",
        "8. The trade-off",
        "Accuracy against quality: read the curve, and choose a level of detail.",
    ),
    Entry(
        "09_sparse_data",
        "9. Sparse data",
        "Few slices far apart, and slices that breathing has shifted.",
    ),
    Entry(
        "10_cohort",
        "10. A cohort",
        "Many hearts in one call: box plots, the best case and the worst.",
    ),
    Entry(
        "11_simulation",
        "11. From mesh to simulation",
        "Formats, fibers, boundary groups, and a ventricle that fills.",
    ),
    Entry(
        "12_your_own_data",
        "12. Your own data",
        "Masks, label maps and arrays; the checks; what to do when it fails.",
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
    panel = classed(widgets.VBox([shown]), "hg-panel")
    return framed([main_part([panel])], ABOUT, linked=False)


def _card(entry: Entry, address: str, new: bool) -> str:
    """A link with a picture, a title and a sentence."""
    picture = b64encode((PICTURES / f"{entry.name}.jpg").read_bytes()).decode()
    where = ' target="_blank" rel="noopener"' if new else ""
    return (
        f'<a href="{address}"{where}><img src="data:image/jpeg;base64,{picture}" alt="">'
        f"<b>{html.escape(entry.title)}</b><span>{html.escape(entry.about)}</span></a>"
    )
