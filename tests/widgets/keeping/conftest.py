"""A place for sessions, and one in which a mesh was made."""

from __future__ import annotations

import signal

import numpy as np
import pytest

from heartgen import samples
from heartgen.widgets.keeping import store as stores
from tests.widgets.keeping.pages import WAITING, left, opened


@pytest.fixture(autouse=True)
def place(tmp_path, monkeypatch):
    """Where sessions are kept."""
    monkeypatch.setenv(stores.PLACE, str(tmp_path / "sessions"))
    return tmp_path / "sessions"


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


@pytest.fixture
def deadly_pipes():
    """A signal as some libraries leave it: to write to a dead process ends whoever writes."""
    before = signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGPIPE, before)
