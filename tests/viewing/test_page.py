from __future__ import annotations

import base64
import io
import json
import re
import zipfile
from dataclasses import replace
from html.parser import HTMLParser

import pytest

from heartgen.errors import HeartgenError
from heartgen.viewing.card import number, sections, verdict

pytest.importorskip("trame_vtk")

from heartgen.viewing import view_html

pytestmark = pytest.mark.slow


class Reader(HTMLParser):
    """Collects what a page shows, and what it would load."""

    def __init__(self, text):
        super().__init__()
        self.words, self.loads, self.tags, self.frame = [], [], set(), ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        for name, value in attrs:
            if name in {"src", "href", "data", "poster", "action"}:
                self.loads.append(value)
            elif name == "srcdoc":
                self.frame = value

    def handle_data(self, data):
        self.words.append(data.strip())


@pytest.fixture(scope="module")
def text(result, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "index.html"
    assert view_html(result, path) == path
    return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(text):
    return Reader(text)


def test_page_and_viewer_load_nothing(page):
    inner = Reader(page.frame)
    assert page.loads == []
    assert [link for link in inner.loads if not link.startswith("data:")] == []
    assert "script" not in page.tags
    assert "script" in inner.tags


def test_report_is_on_the_page(page, result):
    for section in sections(result.report):
        assert section.title in page.words
        for name, value in section.rows:
            assert name in page.words
            assert value in page.words
    assert verdict(result.report).text in page.words
    assert f"{number(result.report.accuracy.mean)} mm" in page.words


def test_scene_holds_mesh_edges_and_mask(page):
    packed = base64.b64decode(re.search(r'base64Str = "([^"]+)"', page.frame)[1])
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        scene = json.loads(archive.read("index.json"))
    renderer = scene["scene"]["dependencies"][0]
    kinds = [child["type"] for child in renderer["dependencies"]]
    assert sum("Actor" in kind for kind in kinds) == 3
    assert scene["scene"]["extra"]["camera"] in [child["id"] for child in renderer["dependencies"]]
    assert all(entry["content"] for entry in scene["hashes"].values())


def test_names_cannot_break_the_page(result, tmp_path):
    name = "<script>alert('$scene')</script> & \"more\""
    odd = replace(result, report=replace(result.report, name=name))
    view_html(odd, tmp_path / "index.html")
    page = Reader((tmp_path / "index.html").read_text(encoding="utf-8"))
    assert name in page.words
    assert "script" not in page.tags


def test_folder_that_cannot_be_is_refused(result, tmp_path):
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(HeartgenError, match="cannot be written"):
        view_html(result, tmp_path / "file" / "index.html")
