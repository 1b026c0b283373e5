"""Lessons are lessons: a goal, captions, exercises that are checked, a way on, and no outputs."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

FOLDER = Path(__file__).resolve().parents[1] / "notebooks"
LESSONS = sorted(FOLDER.glob("[0-9]*.ipynb"))


def cells(path: Path, kind: str) -> list[dict[str, Any]]:
    """The cells of a notebook of one kind."""
    notebook = json.loads(path.read_text(encoding="utf-8"))
    return [cell for cell in notebook["cells"] if cell["cell_type"] == kind]


def text(path: Path, kind: str) -> str:
    """All that these cells say."""
    return "\n\n".join("".join(cell["source"]) for cell in cells(path, kind))


def test_lessons_are_numbered_in_a_row() -> None:
    assert [path.name[:2] for path in LESSONS] == [f"{n:02}" for n in range(1, 13)]


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.ipynb")), ids=lambda path: path.stem)
def test_notebooks_hold_no_outputs(path: Path) -> None:
    for cell in cells(path, "code"):
        assert cell["outputs"] == []
        assert cell["execution_count"] is None


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_a_lesson_has_its_parts(path: Path) -> None:
    words, code = text(path, "markdown"), text(path, "code")
    assert "**You will be able to**" in words
    assert "$$" in words
    assert len(re.findall(r"^\*Figure \d+\. ", words, re.MULTILINE)) >= 2
    hidden = [
        cell for cell in cells(path, "code") if "hide-input" in cell["metadata"].get("tags", ())
    ]
    assert 2 <= len(hidden) <= 3
    assert (
        code.count("Exercise(") == len(hidden) == len(re.findall(r"^answer = \.\.\.$", code, re.M))
    )
    assert path == LESSONS[-1] or f"]({LESSONS[LESSONS.index(path) + 1].name})" in words


@pytest.mark.parametrize("path", LESSONS, ids=lambda path: path.stem)
def test_links_between_notebooks_lead_somewhere(path: Path) -> None:
    linked = re.findall(r"\]\(([^)#]+\.ipynb)\)", text(path, "markdown"))
    assert linked
    assert all((FOLDER / name).is_file() for name in linked)


@pytest.mark.parametrize(("folder", "wider"), [("notebooks", 1), ("", 1), ("apps", 0)])
def test_voila_gives_lessons_margins_and_leaves_apps_alone(folder: str, wider: int) -> None:
    config = pytest.importorskip("traitlets.config").Config()
    exec(
        compile((FOLDER.parent / "binder" / "voila.py").read_text("utf-8"), "voila.py", "exec"),
        {"get_config": lambda: config},
    )
    page = pytest.importorskip("nbformat").v4.new_notebook()
    config.VoilaConfiguration.prelaunch_hook(None, notebook=page, cwd=folder)
    assert ["max-width" in cell.source for cell in page.cells] == [True] * wider
