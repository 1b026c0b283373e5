"""Sessions that are left and found again, without a browser."""

from __future__ import annotations

import json
import os
import signal
import time
import zipfile

import numpy as np
import pytest

from heartgen import samples
from heartgen.errors import HeartgenError, InputError
from heartgen.options import Options
from heartgen.widgets import dashboard
from heartgen.widgets.keeping import store as stores
from heartgen.widgets.keeping.archive import ENDING, _check_code, open_saved, saved
from heartgen.widgets.keeping.packing import pack, unpack
from heartgen.widgets.keeping.session import Keeping
from heartgen.widgets.links import Link, query_of
from heartgen.widgets.runs import Waiting
from heartgen.widgets.session import Session

WAITING = 300


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """Where sessions are kept."""
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "sessions"))
    return tmp_path / "sessions"


def told(page, **message):
    """What the browser says."""
    page.back.keeper._handle_custom_msg({"kind": "hello", "mine": "", "left": [], **message}, [])


def opened(sample=None, **message):
    """A page that is on the screen, its input read and measured."""
    widget = dashboard(sample)
    told(widget.page, **message)
    settled(widget.session)
    return widget.page


def settled(session):
    """Wait until everything that was begun is done."""
    session._pool.submit(lambda: None).result(WAITING)
    session._fits.submit(lambda: None).result(WAITING)


def left(page):
    """The kernel ends, with whatever it does."""
    page.others.close()
    page.session.close()


@pytest.fixture(scope="module")
def ran(small, tmp_path_factory):
    """Folder of all sessions, and key of one in which a mesh was made; nothing may change it."""
    root = tmp_path_factory.mktemp("kept")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(stores.PLACE, str(root))
        page = opened("lifelike")
        page.session.ahead = False
        page.session.choices.quality = 1.5
        page.session.start().result(WAITING)
        assert page.session.shown is not None, page.session.runs[-1].error
        page.session.rename(page.session.runs[0], "the first")
        dofs = page.session.shown.result.mesh.dofs
        left(page)
    return root, page.back.store.key, dofs


@pytest.mark.slow
def test_what_is_packed_is_the_same_and_shares_what_was_shared(finished, tmp_path):
    result = finished.shown.result
    known = (result.mask, result.anatomy)
    pack(known, tmp_path / "known")
    pack(result, tmp_path / "result", known)
    again_known = unpack(tmp_path / "known")
    again = unpack(tmp_path / "result", again_known)
    assert again.anatomy is again_known[1]
    assert again.template.topology is again.mesh.topology
    assert again.report == result.report
    assert again.options == result.options
    np.testing.assert_array_equal(again.mesh.dofs, result.mesh.dofs)
    assert again.deformations[0].least_determinant() == result.deformations[0].least_determinant()
    assert (tmp_path / "result").stat().st_size < (tmp_path / "known").stat().st_size


def test_a_packed_file_makes_nothing_but_what_is_listed(tmp_path):
    with pytest.raises(TypeError, match="cannot be packed"):
        pack(Link(), tmp_path / "link")
    with zipfile.ZipFile(tmp_path / "evil", "w") as archive:
        archive.writestr("graph.json", json.dumps({"class": "Popen", "fields": {"args": "ls"}}))
    with pytest.raises(InputError, match="no file of a heartgen session"):
        unpack(tmp_path / "evil")
    with zipfile.ZipFile(tmp_path / "pickle", "w") as archive:
        with archive.open("0.npy", "w") as member:
            np.save(member, np.array([{}], dtype=object), allow_pickle=True)
        archive.writestr("graph.json", json.dumps({"array": 0}))
    with pytest.raises(InputError, match="no file of a heartgen session"):
        unpack(tmp_path / "pickle")


@pytest.mark.slow
def test_a_stack_is_packed_with_its_slices(tmp_path):
    from heartgen.anatomy import analyze

    mask = samples.load("stack").mask
    anatomy = analyze(mask)
    pack((mask, anatomy), tmp_path / "stack")
    again = unpack(tmp_path / "stack")[1]
    np.testing.assert_array_equal(again.slices.heights, anatomy.slices.heights)


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


@pytest.mark.slow
def test_a_session_that_is_damaged_is_told_and_the_page_begins(ran, tmp_path, monkeypatch):
    import shutil

    root, key, _ = ran
    shutil.copytree(root, tmp_path / "damaged")
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "damaged"))
    (tmp_path / "damaged" / key / "session.json").write_text("{")
    page = opened("lifelike", mine=key)
    assert "damaged" in page.session.complaint
    page.session.close()


@pytest.mark.slow
def test_a_mesh_that_is_damaged_costs_no_more_than_itself(ran, tmp_path, monkeypatch):
    import shutil

    root, key, _ = ran
    shutil.copytree(root, tmp_path / "damaged")
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "damaged"))
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


@pytest.fixture
def deadly_pipes():
    """A signal as some libraries leave it: to write to a dead process ends whoever writes."""
    before = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGPIPE, before)


@pytest.mark.slow
def test_a_process_that_dies_before_it_begins_is_given_up(small, monkeypatch, deadly_pipes):
    monkeypatch.setattr("sys.executable", "/bin/false")
    page = opened("lifelike")
    page.session.start().result(WAITING)
    assert "died each time" in page.session.runs[0].error
    left(page)


def test_inputs_of_two_kernels_never_share_a_folder(place, small):
    store, mask = stores.begun(), samples.lifelike_lv(3.0).mask
    beside = stores.Store(store.folder)
    assert [s.keep_case(mask, {}) for s in (store, beside, store)] == [1, 2, 3]


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


def test_links_carry_what_is_chosen():
    options = Options(lod=3, elements=(1, 8, 4), truncate=5.0, optimize=False)
    link = Link.read(query_of("biv", options, True))
    assert (link.sample, link.run) == ("biv", True)
    assert link.choices == {"lod": 3, "elements": (1, 8, 4), "truncate": 5.0, "optimize": False}
    assert Link.read("token=abc&theme=light").empty
    with pytest.raises(HeartgenError, match="nonsense"):
        Link.read("sample=nonsense")


def test_sessions_that_were_left_long_ago_go(place):
    old, new, large = (stores.begun() for _ in range(3))
    for store in (old, new, large):
        store.write({"case": None})
    (large.folder / "uploads").mkdir()
    (large.folder / "uploads" / "image").write_bytes(bytes(1000))
    past = time.time() - stores.KEPT_SECONDS - 100
    os.utime(old.folder / stores.HELD, (past, past))
    hour = time.time() - 3600
    os.utime(large.folder / stores.HELD, (hour, hour))
    stores.clean(place)
    assert [stores.found(store.key) is not None for store in (old, new, large)] == [0, 1, 1]
    stores.clean(place, most=500)
    assert [stores.found(store.key) is not None for store in (old, new, large)] == [0, 1, 0]
    assert new.folder.stat().st_mode & 0o077 == 0


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


def test_a_tab_that_lost_its_session_does_not_forget_it_for_others(ran, monkeypatch):
    page = opened("lifelike")
    store = stores.found(page.back.store.key)
    store.claim()
    page.back.begin_anew()
    assert store.folder.is_dir()
    page.session.close()


def test_a_heart_that_is_read_too_late_does_not_bring_a_forgotten_session_back(place, small):
    store = stores.begun()
    store.remove()
    with pytest.raises(FileNotFoundError):
        store.keep_case(samples.lifelike_lv(3.0).mask, {})
    assert not store.folder.exists()


def test_sessions_that_go_meanwhile_harm_no_new_one(place, monkeypatch):
    stores.begun()
    monkeypatch.setattr(stores, "clean", lambda root: (_ for _ in ()).throw(OSError("gone")))
    assert stores.begun().folder.is_dir()


def test_keys_lead_nowhere_else(place):
    stores.begun()
    for key in ("..", "../..", "", ".", "x" * 33, "a/../" + "x" * 27):
        assert stores.found(key) is None


def test_without_a_server_that_keeps_them_sessions_end_with_their_kernel(monkeypatch):
    monkeypatch.delenv(stores.PLACE)
    store = stores.begun()
    session = Session(keeping=Keeping(store))
    assert stores.found(store.key) is None
    session.close()
    assert not store.folder.exists()


@pytest.fixture
def coarse_file():
    """What puts a heart that is quickly measured where uploads are."""
    nibabel = pytest.importorskip("nibabel")
    mask = samples.lifelike_lv(3.0).mask
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ mask.affine

    def make(folder):
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "coarse.nii.gz"
        nibabel.save(nibabel.Nifti1Image(mask.voxels.astype(np.uint8), ras), path)
        return path

    return make
