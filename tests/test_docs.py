"""What the documentation shows is so: the lines of its pages run, and they name what there is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import heartgen
from heartgen import samples
from heartgen.formats import FORMATS

DOCS = Path(__file__).resolve().parents[1] / "docs"
PAGES = sorted(p for p in (DOCS / "how-to").glob("*.md") if "```python" in p.read_text("utf-8"))


@pytest.fixture(scope="module")
def result() -> heartgen.Personalization:
    """A mesh to load."""
    return heartgen.personalize(samples.ideal_cup(4.0).mask, elements=(1, 6, 3), optimize=False)


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_lines_of_a_page_run(
    page: Path,
    result: heartgen.Personalization,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    blocks = re.findall(
        r"^```python\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    for reader in re.findall(r"^(?:import|from) ([\w.]+)", "\n".join(blocks), re.MULTILINE):
        pytest.importorskip(reader)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "out").mkdir()
    known = {"result": result, "heartgen": heartgen}
    for block in blocks:
        exec(compile(block, page.name, "exec"), known)


def test_every_solver_has_a_page() -> None:
    solvers = {"febio", "opencarp", "abaqus", "fenicsx", "cheart", "opencmiss", "cmgui", "mfem"}
    assert solvers <= {page.stem for page in PAGES}


def test_the_table_of_formats_has_all_of_them() -> None:
    page = (DOCS / "formats.md").read_text("utf-8")
    told = dict(
        re.findall(r"^\| `([\w-]+)` \| .*? \| (exact|resampled|surfaces alone) \|", page, re.M)
    )
    assert set(told) == set(FORMATS)
    assert all((told[name] == "exact") == each.exact for name, each in FORMATS.items())


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.stem)
def test_links_and_pictures_are_there(page: Path) -> None:
    text = page.read_text("utf-8")
    for link in re.findall(r"\]\(([^)#:\s]+\.(?:md|png|gif|ipynb))(?:#[\w-]+)?\)", text):
        folder, _, name = link.partition("/")
        if folder == "course":
            assert (DOCS.parent / "notebooks" / name).is_file(), link
        elif folder != "api":
            assert (page.parent / link).is_file(), link
