"""The index leads to every app and tutorial that is there."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import ipywidgets as widgets
import pytest

from heartgen.widgets import index
from heartgen.widgets.index_page import APPS, LESSONS, PICTURES, REPOSITORY


def addresses() -> list[str]:
    return [address for page in pages(index()) for address in re.findall(r'href="([^"]+)"', page)]


def pages(widget: widgets.Widget) -> Iterator[str]:
    """HTML of what is below the page's header, from top to bottom."""
    if "hg-index" in getattr(widget, "_dom_classes", ()):
        yield widget.value
    for child in getattr(widget, "children", ()):
        yield from pages(child)


def test_every_notebook_has_an_entry(repository: Path) -> None:
    apps = {path.stem for path in (repository / "apps").glob("*.ipynb")} - {"index"}
    assert apps == {entry.name for entry in APPS}
    lessons = {path.stem for path in (repository / "notebooks").glob("*.ipynb")}
    assert lessons == {entry.name for entry in LESSONS}
    assert {path.stem for path in PICTURES.iterdir()} == apps | lessons


def test_tutorials_are_opened_where_they_are(
    repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    away = addresses()
    assert away[0] == "dashboard.ipynb"
    assert all(address.startswith(REPOSITORY) for address in away[len(APPS) :])
    monkeypatch.chdir(repository / "apps")
    lessons = addresses()[len(APPS) :]
    assert all(address.startswith("../../../lab/tree/notebooks/") for address in lessons)
