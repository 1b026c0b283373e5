"""The app of states, without a browser, on small hearts."""

from __future__ import annotations

import csv
import io

import pytest

pytest.importorskip("pyvista")

from heartgen.formats import write_mesh
from heartgen.samples import beats
from heartgen.widgets import states
from heartgen.widgets.states_page import BEATS
from heartgen.widgets.states_scene import Overlay, states_scene
from heartgen.widgets.states_session import StatesSession

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def page():
    """The page after a sample of coarse hearts was fitted and compared."""
    made = states(None)
    with pytest.MonkeyPatch.context() as patch:
        coarse = {name: beats.beat(name, 3.0) for name in ("lv",)}
        patch.setattr("heartgen.samples.beats.beat", lambda name: coarse[name])
        made.session.load_beat("lv").result()
    finish(made.session)
    yield made.page
    made.session.close()


def finish(session: StatesSession) -> None:
    """Wait for all work."""
    session._worker._pool.submit(lambda: None).result()


def test_beats_are_those_of_the_samples():
    assert {name for _, name in BEATS} == set(beats.BEATS)


def test_sample_is_compared(page):
    session = page.session
    assert session.complaint == session.doing == ""
    assert [state.name for state in session.states] == ["end diastole", "end systole"]
    assert 0.5 < session.compared.comparison.lv_ejection_fraction < 0.65
    assert (page.solid.value, page.around.value) == ("end systole", "end diastole")
    assert "Ejection fraction" in page.result.value
    assert len(page.plots.children) == len(session.compared.bullseyes) == 6
    assert not page.table.disabled


def test_table_has_every_state_and_segment(page):
    rows = list(csv.reader(io.StringIO(page.session.table())))
    assert rows[0] == ["measure", "end diastole", "end systole"]
    assert [row[0] for row in rows[-17:]] == [str(n) for n in range(1, 18)]


def test_page_is_saved(page):
    sent = []
    page.report.hand_over = lambda name, content: sent.append((name, content))
    page._save_page()
    ((name, content),) = sent
    assert name == "states.html"
    assert b"jection fraction" in content


@pytest.mark.parametrize("key", ["", "circumferential"])
def test_scene_has_both_states(page, key):
    large, small = page.session.states
    shown = next((b for b in page.session.compared.bullseyes if b.key == key), None)
    scene = states_scene(Overlay(small.mesh, large.mesh, ("small", "large"), shown))
    inner, outer = scene.mesh.bounds, scene.mask.bounds
    assert outer[0] < inner[0] < inner[1] < outer[1]
    assert abs(scene.mesh.bounds[5]) < 5 < -scene.mesh.bounds[4]  # the base is above
    assert [name for _, name in scene.painted.names] == ["small", "large"]
    assert (scene.painted.scale is None) == (shown is None)


def test_meshes_of_files_are_compared_and_taken_away(page, tmp_path):
    session = StatesSession()
    for state in page.session.states:
        folder = tmp_path / state.name
        folder.mkdir()
        write_mesh(state.mesh, folder / "mesh.vtu")
        session.add_file(folder / "mesh.vtu").result()
    finish(session)
    assert [state.name for state in session.states] == ["mesh", "mesh (2)"]
    before = page.session.compared.comparison.lv_ejection_fraction
    assert session.compared.comparison.lv_ejection_fraction == pytest.approx(before, abs=1e-3)
    session.remove(session.states[0])
    assert session.compared is None
    session.close()
    assert not session.folder.exists()


def test_what_cannot_be_read_is_told(tmp_path):
    made = states(None)
    (tmp_path / "mesh.vtu").write_text("hello")
    made.session.add_file(tmp_path / "mesh.vtu").result()
    assert "mesh.vtu" in made.session.complaint
    assert made.session.complaint.split()[0] in made.page.status.value
    made.session.close()
