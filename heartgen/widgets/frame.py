"""The frame of every app: style, header, footer, and what tells of a session that has ended."""

from __future__ import annotations

import html
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import ipywidgets as widgets

from heartgen import GLOSSARY, __version__
from heartgen.widgets.help import Help
from heartgen.widgets.hints import hints, marked
from heartgen.widgets.parts import classed, style, text
from heartgen.widgets.transfer import Pulse

INDEX = "index.ipynb"
"""Notebook that leads to all apps, where it is beside the one that is shown."""

FOOTER = (
    f"Research use, not for diagnosis · heartgen {__version__} · method of Lamata et al. (2014) · "
    "what you upload stays in your own session and is removed with it · "
    f'<a href="{GLOSSARY}" target="_blank" rel="noopener">words and units</a>'
)


def framed(
    parts: Sequence[Any],
    about: str,
    title: str = "heartgen",
    *,
    linked: bool = True,
    guide: Help | None = None,
    kept: bool = False,
) -> widgets.Widget:
    """Put the parts of an app under a header and above a footer.

    Parameters
    ----------
    parts : sequence of ipywidgets.Widget
        From above to below.
    about : str
        A clause on what the app does.
    title : str
        Its name.
    linked : bool
        Whether a link leads to all apps, where they are served.
    guide : Help, optional
        Of the app; otherwise one without a tour.
    kept : bool
        Whether what was done is found again when the page is opened anew.
    """
    link = f'<a href="{INDEX}">All apps</a>' if linked and Path(INDEX).is_file() else ""
    header = f"<h1>{html.escape(title)}</h1><p>{html.escape(about)}</p>{link}"
    return classed(
        widgets.VBox(
            [
                style(),
                marked(
                    classed(widgets.HBox([text(header), guide or Help()]), "hg-header"),
                    role="banner",
                ),
                *parts,
                Pulse(kept=kept),
                hints(),
                marked(text(FOOTER, "hg-footer"), role="contentinfo"),
            ]
        ),
        "hg-app",
    )


def two_sided(side: Sequence[Any], middle: Sequence[Any]) -> widgets.Widget:
    """Controls on the side, what they lead to beside them.

    Parameters
    ----------
    side, middle : sequence of ipywidgets.Widget
        From above to below.
    """
    return classed(
        widgets.HBox(
            [
                marked(
                    classed(widgets.VBox(list(side)), "hg-side"),
                    role="region",
                    aria_label="Input and choices",
                ),
                main_part(middle),
            ]
        ),
        "hg-body",
    )


def main_part(parts: Sequence[Any]) -> widgets.Widget:
    """What a page is for, which those who use a screen reader find by its landmark.

    Parameters
    ----------
    parts : sequence of ipywidgets.Widget
        From above to below.
    """
    return marked(classed(widgets.VBox(list(parts)), "hg-main"), role="main")
