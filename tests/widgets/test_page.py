from __future__ import annotations

import html
import json
from collections.abc import Iterator
from pathlib import Path

import ipywidgets as widgets
import pytest

from heartgen.assessment import QUALITY_THRESHOLD
from heartgen.errors import InputError
from heartgen.images.schemes import SCHEMES
from heartgen.samples import names
from heartgen.widgets import dashboard
from heartgen.widgets.hints import hints
from heartgen.widgets.input_case import sample_choices
from heartgen.widgets.panels import source
from heartgen.widgets.tradeoff_plot import THRESHOLD
from heartgen.widgets.transfer import PIECE, Pulse, Upload, safe_name

APPS = ["dashboard.ipynb", "index.ipynb", "states.ipynb", "tradeoff.ipynb"]


def tree(widget: widgets.Widget) -> Iterator[widgets.Widget]:
    yield widget
    for child in getattr(widget, "children", ()):
        yield from tree(child)


@pytest.fixture
def page():
    widget = dashboard(None)
    yield widget
    widget.session.close()


def test_every_control_has_a_name_and_explains_itself(page):
    kinds = (widgets.Button, widgets.Dropdown, widgets.Checkbox, widgets.ToggleButtons)
    kinds += (widgets.IntSlider, widgets.FloatSlider, widgets.BoundedIntText, widgets.Text)
    controls = [w for w in tree(page) if isinstance(w, kinds)]
    assert len(controls) > 25
    for control in controls:
        assert control.description, control
        own = getattr(control, "tooltip", None) or getattr(control, "tooltips", None)
        hint = [hints().hints.get(name) for name in control._dom_classes]
        assert own or any(hint), control.description


@pytest.mark.slow
def test_panels_draw_a_whole_run(page):
    session = page.session
    session.load_sample("lifelike").result()
    session.start().result()
    assert page.page.panels["view"].widget.layout.display == ""
    judge, take = page.page.panels["assess"], page.page.panels["export"]
    page.page.turn_to("assess")
    assert "success" in judge.card.value
    assert bytes(judge.figure.value).startswith(b"\x89PNG")
    assert [p["id"] for p in judge.tradeoff.points] == [1]
    assert not take.download.disabled
    assert "heartgen.personalize(mask, lod=1)" in take.code.value
    view = page.page.panels["view"]
    assert not view.stage.disabled
    assert "Show the mesh: warped" in view.stage.tooltips
    assert page.page.panels["input"].widget.layout.display == "none"


@pytest.mark.slow
def test_first_sample_is_loaded_once_the_page_is_shown():
    widget = dashboard("lifelike")
    session, keeper = widget.session, widget.page.back.keeper
    assert session.case is None
    keeper._handle_custom_msg({"kind": "hello", "mine": "", "left": []}, [])
    session._pool.submit(lambda: None).result()
    assert session.case is not None
    assert widget.page.source.sample.value == "lifelike"
    session.close()


def test_unknown_sample_is_refused():
    with pytest.raises(InputError, match="no sample 'nonsense'"):
        dashboard("nonsense")


@pytest.mark.slow
def test_slices_move(page):
    page.session.load_sample("lifelike").result()
    panel = page.page.panels["input"]
    before = panel.images[2].picture
    panel.sliders[2].value -= 15
    assert panel.images[2].picture != before
    assert panel.titles[2].value == f"Short axis · z = {round(panel.sliders[2].value)} mm"


def test_names_of_files_cannot_break_the_page(page, tmp_path):
    path = tmp_path / "<script>alert(1)<script>.nii.gz"
    path.write_text("hello")
    page.session.load_file(path).result()
    shown = [widget.value for widget in tree(page) if isinstance(widget, widgets.HTML)]
    assert any("&lt;script" in value for value in shown)  # it is told, ...
    assert not any("<script" in value for value in shown)  # ... and does nothing


def test_a_frame_is_asked_for_of_files_alone(page, tmp_path):
    panel = page.page.source
    assert panel.frame.layout.display == "none"
    panel._arrived(tmp_path / "cine.nii")
    assert panel.frame.layout.display == ""
    panel.sample.value = "lifelike"
    assert panel.frame.layout.display == "none"


def test_every_sample_is_offered():
    assert {name for _, name in sample_choices()} == set(names())


def test_every_scheme_of_labels_is_offered():
    assert {*SCHEMES, "auto"} < {name for _, name in source.SCHEMES}


def test_threshold_is_that_of_the_assessment():
    assert THRESHOLD == QUALITY_THRESHOLD


@pytest.mark.parametrize("name", APPS)
def test_apps_are_thin_and_hold_no_outputs(repository: Path, name: str):
    notebook = json.loads((repository / "apps" / name).read_text(encoding="utf-8"))
    cells = [cell for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
    code = "".join(line for cell in cells for line in cell["source"])
    assert "def " not in code  # the code lives in the package
    assert len(code.splitlines()) < 50


def test_every_app_is_looked_at(repository: Path):
    assert sorted(path.name for path in (repository / "apps").glob("*.ipynb")) == APPS


def test_signs_of_life_are_answered():
    pulse, sent = Pulse(), Told()
    pulse.send = sent.append
    pulse._handle_custom_msg({"kind": "ask"}, [])
    assert sent == [{"kind": "here"}]


@pytest.mark.slow
def test_python_that_is_copied_is_the_one_that_is_shown(page):
    page.session.load_sample("lifelike").result()
    page.session.start().result()
    take = page.page.panels["export"]
    assert take.copy.text.startswith("import heartgen")
    assert take.copy.text.splitlines()[-1] in html.unescape(take.code.value)


class Told(list):
    """Collects what an upload says."""


@pytest.fixture
def upload(tmp_path):
    arrived, refused = Told(), Told()
    widget = Upload(tmp_path, 3 * PIECE, arrived.append, refused.append)
    widget.sent = Told()
    widget.send = lambda message, buffers=None: widget.sent.append(message)
    widget.arrived, widget.refused = arrived, refused
    return widget


def send(widget, content, name="heart.nii", size=None):
    widget._hear(
        None, {"kind": "begin", "name": name, "size": len(content) if size is None else size}, []
    )
    while widget.sent and widget.sent[-1]["kind"] == "next":
        at = widget.sent[-1]["offset"]
        widget._hear(None, {"kind": "piece"}, [memoryview(content[at : at + PIECE])])


def test_upload_in_pieces_arrives_whole(upload):
    content = bytes(range(256)) * (2 * PIECE // 256) + b"end"
    send(upload, content)
    assert upload.arrived[0].read_bytes() == content
    assert upload.arrived[0].name == "heart.nii"
    assert upload.refused == []


def test_too_large_a_file_is_refused_before_it_is_sent(upload):
    send(upload, b"", size=3 * PIECE + 1)
    assert upload.arrived == []
    assert "more than the 6 MB" in upload.refused[0]


def test_more_than_announced_is_refused(upload, tmp_path):
    send(upload, b"abc", size=2)
    assert "longer than announced" in upload.refused[0]
    assert upload.arrived == []


def test_only_the_last_upload_is_kept(upload, tmp_path):
    send(upload, b"one")
    send(upload, b"two")
    assert [f.read_bytes() for f in tmp_path.rglob("*.nii")] == [b"two"]


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("../../etc/passwd", "passwd"),
        ("C:\\hearts\\a.nii", "a.nii"),
        (".hidden", "hidden"),
        ("", "upload"),
        ("x" * 500 + ".nii.gz", "x" * 113 + ".nii.gz"),
    ],
)
def test_names_stay_in_their_folder(name, safe):
    assert safe_name(name) == safe


@pytest.mark.slow
def test_the_sample_is_that_of_the_heart_that_is_shown(page):
    session, source = page.session, page.page.source
    session.choices.optimize = False
    source.sample.value = "lifelike"
    session._pool.submit(lambda: None).result()
    session.start().result()
    source.sample.value = "ideal"
    session._pool.submit(lambda: None).result()
    session.show(session.outcomes[-1])
    assert source.sample.value == "lifelike"
    source.sample.value = "ideal"  # so that another can be chosen again
    session._pool.submit(lambda: None).result()
    assert session.case.origin == {"sample": "ideal"}
