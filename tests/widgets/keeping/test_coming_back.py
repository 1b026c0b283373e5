"""Sessions that are left and found again, without a browser."""

from __future__ import annotations

import shutil
import time

import numpy as np
import pytest

from heartgen.widgets import dashboard
from heartgen.widgets.keeping import store as stores
from tests.widgets.keeping.pages import WAITING, left, opened, settled, told


@pytest.mark.slow
def test_a_session_is_found_by_its_key_alone(ran, monkeypatch):
    root, key, dofs = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    page = opened("lifelike", mine=key)
    session = page.session
    assert page.back.store.key == key
    np.testing.assert_array_equal(session.shown.result.mesh.dofs, dofs)
    assert session.shown.title == "1 · the first · LoD 1"
    assert session.choices.quality == 1.5
    assert session.anatomy is session.shown.result.anatomy
    assert page.source.sample.value == "lifelike"
    assert session.states["run"].phase == "done"
    assert not page.back._beat() or page.back.store.mine
    other = opened("lifelike", mine="x" * 32)
    assert other.session.shown is None
    other.session.close()
    second = opened("lifelike", mine=key)
    assert second.session.shown is not None
    assert not page.back._beat()  # it goes on elsewhere
    session.choices.lod = 4  # and this one writes no more
    assert second.back.store.read()["choices"]["lod"] == 1


@pytest.mark.slow
def test_what_was_left_comes_back_in_a_new_tab_unless_a_link_asks_for_more(ran, monkeypatch):
    root, key, _ = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    beside = opened("lifelike")  # a sample is nothing to come back for
    left(beside)
    page = opened("lifelike", left=[beside.back.store.key, "x" * 32, key])
    assert page.back.store.key == key
    monkeypatch.setenv("QUERY_STRING", "sample=biv&lod=2&token=secret")
    linked = opened("lifelike", left=[key])
    assert linked.back.store.key != key
    assert linked.session.choices.lod == 2
    assert linked.session.case.origin == {"sample": "biv"}
    linked.session.close()


@pytest.mark.slow
def test_an_upload_comes_back(coarse_file):
    page = opened()
    path = coarse_file(page.session.folder)
    page.session.load_file(path, "binary", "").result(WAITING)
    left(page)
    again = opened("lifelike", mine=page.back.store.key)
    assert again.session.case.name == path.name
    assert again.session.anatomy is not None
    assert str(path.parent) not in str(again.session.case.mask.source)
    assert again.source._uploaded == path


@pytest.mark.slow
def test_a_link_is_followed_where_another_session_was_and_only_once(ran, monkeypatch):
    root, key, _ = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    monkeypatch.setenv("QUERY_STRING", "sample=biv")
    linked = opened("lifelike", mine=key)
    assert linked.session.case.origin == {"sample": "biv"}
    linked.session.close()
    again = opened("lifelike", mine=key, again=True)
    assert again.back.store.key == key
    again.session.close()


@pytest.mark.slow
def test_a_page_that_is_left_while_its_session_comes_back_has_lost_nothing(ran, monkeypatch):
    root, key, _ = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    widget = dashboard("lifelike")
    page, said = widget.page, []
    monkeypatch.setattr(page.back.keeper, "send", lambda message: said.append(message))
    page.session._pool.submit(time.sleep, 0.5)
    before = page.back.store
    told(page, mine=key)
    assert said == []  # the browser still knows the key of before
    assert before.read() is None  # an empty session is nothing to come back to
    settled(page.session)
    assert said == [{"kind": "key", "key": key}]
    assert not before.folder.exists()
    page.session.close()


def copied(ran, folder, monkeypatch):
    """Key of the session in which a mesh was made, in a copy of all sessions."""
    root, key, _ = ran
    shutil.copytree(root, folder)
    monkeypatch.setenv(stores.PLACE, str(folder))
    return key


@pytest.mark.slow
def test_a_session_that_is_damaged_is_told_and_the_page_begins(ran, tmp_path, monkeypatch):
    key = copied(ran, tmp_path / "damaged", monkeypatch)
    (tmp_path / "damaged" / key / "session.json").write_text("{")
    page = opened("lifelike", mine=key)
    assert "damaged" in page.session.complaint
    page.session.close()


@pytest.mark.slow
def test_a_mesh_that_is_damaged_costs_no_more_than_itself(ran, tmp_path, monkeypatch):
    key = copied(ran, tmp_path / "damaged", monkeypatch)
    (tmp_path / "damaged" / key / "jobs" / "1" / "lod-1.pack").write_bytes(b"PK")
    page = opened("lifelike", mine=key)
    assert page.session.case.name
    assert page.session.runs[0].phase == "failed"
    assert "damaged" in page.session.runs[0].error
    page.session.close()


@pytest.mark.slow
def test_what_cannot_be_written_is_told(small, monkeypatch):
    page = opened("lifelike")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(stores, "pack", full)
    page.session.load_sample("ideal").result(WAITING)
    assert "No space left" in page.session.complaint
    monkeypatch.setattr(stores, "write_json", full)
    page.session.choices.quality = 2.0
    assert "No space left" in page.keep.unkept.value
    monkeypatch.undo()
    page.session.choices.quality = 3.0
    assert page.keep.unkept.value == ""
    left(page)


@pytest.mark.slow
def test_a_process_that_dies_before_it_begins_is_given_up(small, monkeypatch, deadly_pipes):
    monkeypatch.setattr("sys.executable", "/bin/false")
    page = opened("lifelike")
    page.session.start().result(WAITING)
    assert "died each time" in page.session.runs[0].error
    left(page)


@pytest.mark.slow
def test_an_upload_that_was_being_read_is_read_again(coarse_file):
    page = opened()
    path = coarse_file(page.session.folder)
    page.session._pool.submit(time.sleep, 0.5)
    page.session.load_file(path, "binary", "")
    left(page)
    again = opened("lifelike", mine=page.back.store.key)
    settled(again.session)
    assert again.session.case.name == path.name


@pytest.mark.slow
def test_several_hearts_are_offered_again(coarse_file):
    page = opened()
    one = coarse_file(page.session.folder / "hearts")
    two = one.rename(one.with_name("two.nii.gz"))
    coarse_file(one.parent)
    page.source._arrived(one.parent)
    settled(page.session)
    page.source.several.which.value = str(two)
    settled(page.session)
    page.source.scheme.value = "auto"  # of all of them, and the one that is looked at is read anew
    settled(page.session)
    left(page)
    again = opened(mine=page.back.store.key)
    settled(again.session)
    several = again.source.several
    assert [name for name, _ in several.which.options] == ["coarse.nii.gz", "two.nii.gz"]
    assert {heart["scheme"] for heart in again.session.hearts} == {"auto"}
    assert several.which.value == str(two)
    assert several.widget.layout.display == ""


@pytest.mark.slow
def test_a_run_goes_on_without_its_kernel(small):
    page = opened("lifelike")
    page.session.ahead = False
    page.session.start((1, 2))
    job = page.session.keeping.store.job("1")
    while not job.there or job.worker is None:
        time.sleep(0.05)
    worker = job.worker
    left(page)
    again = opened("lifelike", mine=page.back.store.key)
    session = again.session
    settled(session)
    assert [run.phase for run in session.runs] == ["done"], session.runs[0].error
    assert [outcome.lod for outcome in session.outcomes] == [1, 2]
    assert job.tries == 1
    worker.wait(WAITING)  # nobody has more for it


@pytest.mark.slow
def test_a_run_whose_process_dies_is_begun_again_and_a_cancelled_one_is_not(small):
    page = opened("lifelike")
    session = page.session
    session.ahead = False
    future = session.start()
    job = session.keeping.store.job("1")
    while not job.there or job.worker is None:
        time.sleep(0.05)
    job.worker.kill()
    future.result(WAITING)
    assert session.runs[0].phase == "done", session.runs[0].error
    assert job.tries == 2
    future = session.start((1, 2, 3))
    assert session.runs[1].reused == ("shape analysis", "level 1")
    session.runs[1].cancel()
    future.result(WAITING)
    assert session.keeping.store.job("2").ended != ""


@pytest.mark.slow
def test_other_levels_are_fitted_after_a_run_and_shown_when_they_are_chosen(small):
    page = opened("lifelike")
    session = page.session
    session.choices.optimize = False
    session.start().result(WAITING)
    assert session.ahead_of == "2, 3, 4, 5"
    end = time.monotonic() + WAITING
    while len(session.outcomes) < 5 and time.monotonic() < end:
        time.sleep(0.1)
    assert sorted(o.lod for o in session.outcomes) == [1, 2, 3, 4, 5]
    session.choices.lod = 3
    assert session.shown.lod == 3
    session.start().result(WAITING)
    assert session.runs[1].reused == ("shape analysis", "level 3")
    np.testing.assert_array_equal(
        session.shown.result.mesh.dofs, session.fitted(3).result.mesh.dofs
    )
    left(page)
    again = opened("lifelike", mine=page.back.store.key)
    assert sorted(o.lod for o in again.session.outcomes) == [1, 2, 3, 3, 4, 5]


@pytest.mark.slow
def test_a_session_that_comes_back_in_part_stays_on_the_disk_as_it_was(ran, monkeypatch):
    root, key, _ = ran
    monkeypatch.setenv(stores.PLACE, str(root))
    before = (root / key / stores.STATE).read_text()
    page = opened()
    page.session.observe(lambda change: 1 / 0, ["runs"])
    keeping, store = page.session.keeping, stores.found(key)
    past = keeping.past(store)
    keeping.move(store, past)
    with pytest.raises(ZeroDivisionError):
        past.restore(page.session)
    assert (root / key / stores.STATE).read_text() == before
    page.session.keeping = None


@pytest.mark.slow
def test_a_level_that_is_chosen_while_another_heart_is_read_does_not_bring_the_former_back(ran):
    page = opened("lifelike")
    session = page.session
    session.ahead = False
    session.choices.optimize = False
    session.start((1, 2)).result(WAITING)
    session._pool.submit(time.sleep, 0.5)
    reading = session.load_sample("ideal")
    session.choices.lod = 2
    reading.result(WAITING)
    assert session.case.code.endswith("('ideal').mask")
    left(page)


def test_a_tab_that_lost_its_session_does_not_forget_it_for_others(ran, monkeypatch):
    page = opened("lifelike")
    store = stores.found(page.back.store.key)
    store.claim()
    page.back.begin_anew()
    assert store.folder.is_dir()
    page.session.close()
