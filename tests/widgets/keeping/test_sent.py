"""Sessions that are saved, sent and opened, also hostile ones."""

from __future__ import annotations

import json
import time
import zipfile

import numpy as np
import pytest

from heartgen.errors import InputError
from heartgen.options import Options
from heartgen.widgets.keeping import store as stores
from heartgen.widgets.keeping.archive import ENDING, _check_code, open_saved, saved
from heartgen.widgets.keeping.session import Keeping
from heartgen.widgets.runs import Waiting
from tests.widgets.keeping.pages import left, opened, settled


@pytest.mark.slow
def test_a_session_is_saved_and_opened_again(ran, monkeypatch, tmp_path):
    root, key, dofs = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    content = saved(stores.found(key))
    assert key.encode() not in content
    path = tmp_path / f"heart{ENDING}"
    path.write_bytes(content)
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "elsewhere"))
    page = opened("lifelike")
    page.source._arrived(path)
    settled(page.session)
    assert page.session.complaint == ""
    np.testing.assert_array_equal(page.session.shown.result.mesh.dofs, dofs)
    assert page.session.runs[0].name == "the first"
    page.session.close()


def test_a_session_with_code_of_others_is_refused(ran, monkeypatch, tmp_path):
    root, key, _ = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    (tmp_path / "s").write_bytes(saved(stores.found(key)))
    with zipfile.ZipFile(tmp_path / "s") as archive, zipfile.ZipFile(tmp_path / "t", "w") as bad:
        for name in archive.namelist():
            data = archive.read(name)
            if name.endswith("about.json"):
                about = json.loads(data) | {"code": "__import__('os').system('ls')"}
                data = json.dumps(about).encode()
            bad.writestr(name, data)
        bad.writestr("../../outside.json", "{}")
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "elsewhere"))
    with pytest.raises(InputError, match="code that heartgen did not write"):
        open_saved(tmp_path / "t", stores.begun())
    assert not list(tmp_path.rglob("outside.json"))
    (tmp_path / "u.heartgen").write_text("no zip")
    with pytest.raises(InputError, match="no session"):
        open_saved(tmp_path / "u.heartgen", stores.begun())


EVIL = (
    "heartgen.read_mask.__globals__.get('__builtins__').get('eval')('1+41')",
    "heartgen.read_mask(heartgen.read_mask('x'))",
    "heartgen.os.system('ls')",
    "open('x')",
    "heartgen.read_mask",
    "[",
)


GOOD = (
    "heartgen.samples.load('biv').mask",
    "[heartgen.read_labels('a.nii', {'lv_myocardium': [2]}, frame='ES'), heartgen.read_mask('b')]",
    "heartgen.Client('http://a').download_model('1', 'model').mask",
)


def test_code_of_a_session_reads_images_and_does_nothing_else():
    for code in GOOD:
        _check_code(code, "s.heartgen")
    for code in EVIL:
        with pytest.raises(InputError, match="did not write"):
            _check_code(code, "s.heartgen")


def test_a_session_that_was_sent_reads_no_files_but_its_own(place, small, tmp_path):
    elsewhere = tmp_path / "upload-operator"
    elsewhere.mkdir()
    (elsewhere / "p.nii").write_text("secret")
    store = stores.begun()
    origin = {"file": str(elsewhere / "p.nii"), "scheme": "binary", "frame": ""}
    waiting = {"origin": origin, "options": {}}
    told_ = {"case": None, "origin": origin, "awaited": True, "queue": [waiting], "choices": {}}
    store.write(told_ | {"hearts": [origin], "runs": [], "shown": None, "taken": ""})
    keeping = Keeping(stores.begun())
    past = keeping.past(stores.found(store.key))
    assert (past.origin, past.hearts, past.queue) == ({}, (), ())
    store.claim()
    store.write(told_ | {"case": "../../other", "runs": [], "shown": None, "taken": ""})
    with pytest.raises(InputError, match="damaged"):
        keeping.past(stores.found(store.key))


@pytest.mark.slow
def test_what_waits_is_not_written_into_a_session_that_was_opened(ran, monkeypatch, tmp_path):
    root, key, dofs = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    (tmp_path / "s.heartgen").write_bytes(saved(stores.found(key)))
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "here"))
    page = opened("lifelike")
    session = page.session
    session._fits.submit(time.sleep, 1.5)  # so that the run is still to be begun
    session.start()
    session.queue = [Waiting({"file": "x", "scheme": "binary", "frame": ""}, Options())]
    page.source._arrived(tmp_path / "s.heartgen")
    settled(session)
    assert session.queue == []
    assert len(session.runs) == 1
    np.testing.assert_array_equal(session.shown.result.mesh.dofs, dofs)
    left(page)
    again = opened(mine=page.back.store.key)
    np.testing.assert_array_equal(again.session.shown.result.mesh.dofs, dofs)
    left(again)
