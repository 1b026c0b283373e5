"""The plot of error against quality, whose points may be clicked."""

from __future__ import annotations

from typing import Any

import anywidget
from traitlets import Any as AnyTrait
from traitlets import Float, List

from heartgen.widgets.runs import Outcome
from heartgen.widgets.transfer import WEB

THRESHOLD = 0.33
"""Least mean quality of a success (paper, section 3.2); as in `heartgen.assessment`."""

ONE = {"name": "", "color": "#0b5cad"}
"""The curve of a plot that has one."""


class Tradeoff(anywidget.AnyWidget):
    """Error against quality, in curves of points that may be clicked.

    Attributes
    ----------
    points : list of dict
        As of `point`.
    curves : list of dict
        Name and color of each.
    selected : object
        Of the point that is shown, its id.
    threshold : float
        Quality below which a mesh is no success.
    """

    _esm = WEB / "tradeoff.js"
    points: List[dict[str, Any]] = List().tag(sync=True)
    curves: List[dict[str, Any]] = List([ONE]).tag(sync=True)
    selected = AnyTrait(None, allow_none=True).tag(sync=True)
    threshold = Float(THRESHOLD).tag(sync=True)


def point(outcome: Outcome, number: int, label: str, about: str, curve: int = 0) -> dict[str, Any]:
    """A point of the plot.

    Parameters
    ----------
    outcome : Outcome
        A mesh.
    number : int
        By which the point is told from others.
    label : str
        Inside of it.
    about : str
        Its name for those who do not see it.
    curve : int
        To which it belongs.
    """
    report = outcome.result.report
    return {
        "id": number,
        "label": label,
        "about": about,
        "curve": curve,
        "error": report.accuracy.mean,
        "quality": report.quality.mean,
    }
