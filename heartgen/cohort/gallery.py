"""The best and the worst cases of a cohort in 3-D (paper, figure 11)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.anatomy import analyze_under
from heartgen.cohort.store import CASES
from heartgen.errors import HeartgenError
from heartgen.images.selecting import Selection
from heartgen.options import ANALYZED, Options, option_from_text
from heartgen.viewing.page import scene_page
from heartgen.viewing.saved import plot_saved

if TYPE_CHECKING:
    import pandas as pd

MOST = 3
"""Groups of which cases are shown; a page with more views is slow to turn."""


@dataclass(frozen=True)
class CaseView:
    """A case to look at.

    Attributes
    ----------
    title, caption : str
        Words below the scene.
    scene : str
        A page of its own.
    """

    title: str
    caption: str
    scene: str


def views_of(out: Path, done: pd.DataFrame) -> list[CaseView]:
    """Best and worst case, by error, of each of the largest groups.

    Parameters
    ----------
    out : Path
        Folder of the batch.
    done : DataFrame
        Cases with a mesh, with their groups.

    Returns
    -------
    list of CaseView
        Cases whose mesh or mask is no longer there are left out.
    """
    chosen: dict[str, tuple[str, dict[str, Any]]] = {}
    for group in done["group"].value_counts().index[:MOST]:
        part = done[done["group"] == group].sort_values("error_mean")
        for what, row in (("best", part.iloc[0]), ("worst", part.iloc[-1])):
            chosen.setdefault(str(row["case"]), (f"{group}, {what}", row.to_dict()))
    views = [_view(out, title, row) for title, row in chosen.values()]
    return [view for view in views if view is not None]


def _view(out: Path, title: str, row: dict[str, Any]) -> CaseView | None:
    """A case in 3-D."""
    mesh = out / CASES / row["case"] / "mesh.vtu"
    try:
        mask = _selection(row).read(row["mask"], row["ventricles"])
        chosen = {name: option_from_text(name, str(row[name])) for name in ANALYZED}
        anatomy = analyze_under(mask, Options(**chosen))
    except HeartgenError:
        return None
    if not mesh.is_file():
        return None
    plotter = plot_saved(mesh, anatomy)
    scene = scene_page(plotter)
    plotter.close()
    caption = (
        f"error {row['error_mean']:.3f} mm, 95 % below {row['error_p95']:.2f}, largest "
        f"{row['error_max']:.2f} · Q {row['q_mean']:.3f}, least {row['q_min']:.3f}"
    )
    return CaseView(f"{title}: {row['case']}", caption, scene)


def _selection(row: dict[str, Any]) -> Selection:
    """What of the file is the myocardium."""
    names = ("label", "labels", "rv_wall", "frame")
    label, labels, wall, frame = (row.get(name) for name in names)
    return Selection(
        tuple(label.split("+")) if isinstance(label, str) else (),
        labels if isinstance(labels, str) else None,
        None if wall is None or wall != wall else float(wall),
        None if frame is None or frame != frame else str(frame),
    )
