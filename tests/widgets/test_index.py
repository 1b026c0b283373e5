"""The index leads to every app and tutorial that is there."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from heartgen.widgets import index
from heartgen.widgets.index_page import APPS, LESSONS, PICTURES, REPOSITORY


def addresses() -> list[str]:
    page = next(w.value for w in index().children[2].children)
    return re.findall(r'href="([^"]+)"', page)


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
