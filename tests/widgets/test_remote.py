"""A session beside a service: fits come back as runs, models of its library are opened."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("fastapi")
pytest.importorskip("distributed")
pytest.importorskip("ipywidgets")

import heartgen
from heartgen import samples
from heartgen.mesh.jacobian import volume
from heartgen.options import STEPS
from heartgen.widgets.panels.service import ServicePanel
from heartgen.widgets.remote import Address, Remote, drawn
from heartgen.widgets.session import Session
from tests.service.helpers import free_port
from tests.service.running import Running


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A service with real fits."""
    with Running(tmp_path_factory.mktemp("running")) as service:
        yield service


def test_mask_drawn_from_a_mesh_holds_its_volume():
    mesh = heartgen.personalize(samples.ideal_cup(4.0).mask, optimize=False).mesh
    mask = drawn(mesh, "cup")
    whole = mask.voxels.sum() * np.prod(mask.spacing)
    assert whole == pytest.approx(volume(mesh), rel=0.01)
    assert not any(mask.voxels.take(end, axis).any() for axis in range(3) for end in (0, -1))


def test_service_that_is_not_there_is_a_sentence(session: Session, monkeypatch):
    monkeypatch.setattr("heartgen.client.TRIES", 1)
    panel = ServicePanel(session)
    panel.url.value = "somewhere"
    session.load_sample("lifelike").result()
    panel.send.click()
    assert "is no address: give one" in panel.note.value
    assert session.runs == []
    nowhere = Address(f"http://127.0.0.1:{free_port()}")
    panel.remote.search(nowhere).result()
    assert "no service answers there" in panel.note.value
    panel.remote.send(nowhere).result()
    assert session.runs[-1].phase == "failed"
    assert "no service answers there" in session.states["run"].reason
    assert panel.send.disabled is False
    panel.remote.close()


@pytest.mark.slow
def test_heart_is_fitted_by_a_service_and_opened_from_its_library(
    session: Session, running: Running
):
    address, remote = Address(running.url), Remote(session)
    session.load_sample("lifelike").result()
    session.choices.optimize = False
    session.choices.lod = 2
    steps: list[str] = []
    future = remote.send(address)
    session.runs[-1].observe(lambda change: steps.append(session.runs[-1].step), "shares")
    future.result()
    (run,) = session.runs
    assert run.phase == "done", run.error
    assert run.shares == dict.fromkeys(STEPS, 1.0)
    assert set(steps) <= set(STEPS)
    result = session.shown.result
    assert (result.options.optimize, result.options.lod) == (False, 2)
    here = heartgen.personalize(session.case.mask, optimize=False, lod=2)
    assert result.report.mask_sha256 == here.report.mask_sha256
    assert volume(result.mesh) == pytest.approx(volume(here.mesh), rel=1e-9)
    assert result.report.accuracy.mean == pytest.approx(here.report.accuracy.mean, rel=1e-6)
    assert session.states["export"].phase == "ready"

    client = heartgen.Client(running.url)
    job = client._http.get("/v1/jobs").json()[0]["id"]
    about = {"title": "A heart", "condition": "healthy", "species": "human", "no_names": True}
    model = client.publish(job, **about)["identifier"]
    remote.search(address, "heart").result()
    assert [each["identifier"] for each in remote.models] == [model]
    assert remote.found == "1 model"
    remote.open(address, model).result()
    assert remote.complaint == ""
    assert session.shown.run == 2
    assert session.case.name == model
    assert session.shown.result.report.accuracy == result.report.accuracy
    remote.search(address, "zebra").result()
    assert (remote.models, remote.found) == ([], "0 models")
    remote.close()


@pytest.mark.slow
def test_fit_that_is_cancelled_here_is_cancelled_there(session: Session, running: Running):
    remote = Remote(session)
    session.load_sample("lifelike").result()
    session.choices.quality = 1.5
    future = remote.send(Address(running.url))
    session.runs[-1].cancel()
    future.result()
    assert session.runs[-1].phase == "cancelled"
    jobs = heartgen.Client(running.url)._http.get("/v1/jobs").json()
    assert all(job["state"] in ("done", "cancelled") for job in jobs)
    remote.close()
