"""Folders of sessions: found by their keys alone, and removed when nobody comes back."""

from __future__ import annotations

import os
import time

import pytest

from heartgen import samples
from heartgen.widgets.keeping import store as stores
from heartgen.widgets.keeping.session import Keeping
from heartgen.widgets.session import Session


def test_inputs_of_two_kernels_never_share_a_folder(place, small):
    store, mask = stores.begun(), samples.lifelike_lv(3.0).mask
    beside = stores.Store(store.folder)
    assert [s.keep_case(mask, {}) for s in (store, beside, store)] == [1, 2, 3]


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
