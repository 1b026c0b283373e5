"""A session beside a service: fits come back as runs, models of its library are opened."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("fastapi")
pytest.importorskip("distributed")
pytest.importorskip("ipywidgets")

import heartgen
from heartgen import samples
from heartgen.anatomy import analyze
from heartgen.images.mask import LEFT_BLOOD, RIGHT_BLOOD
from heartgen.images.schemes import KEPT
from heartgen.images.writing import write_image
from heartgen.mesh.jacobian import volume
from heartgen.options import STEPS
from heartgen.widgets.mesh_scene import SceneView, mesh_scene
from heartgen.widgets.panels.service import ServicePanel
from heartgen.widgets.panels.view import NO_STAGES, ViewPanel
from heartgen.widgets.remote import Address, Remote, drawn
from heartgen.widgets.session import Session
from tests.service.helpers import free_port
from tests.service.running import Running


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A service with real fits."""
    with Running(tmp_path_factory.mktemp("running")) as service:
        yield service


@pytest.mark.slow
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
    view = ViewPanel(session)
    assert view.stage.disabled
    assert set(view.stage.tooltips) == {NO_STAGES}
    assert not view.color.disabled
    assert mesh_scene(session.shown, SceneView(**view._wanted())).mesh.n_points > 0

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


def labeled_stack(path: Path) -> Path:
    """A label map of both ventricles in slices of 12 mm, with a speck."""
    heart = samples.biv(3.0).mask
    voxels = np.moveaxis(np.indices(heart.voxels.shape), 0, -1).reshape(-1, 3)
    surfaces, at = analyze(heart).surfaces, heart.to_world(voxels)
    left, right = (
        surfaces[name].sample(at)[0].reshape(heart.voxels.shape) < 0
        for name in ("lv_endo", "rv_endo")
    )
    labels = np.select([heart.voxels, left, right], [1, 2, 3]).astype(np.uint8)
    labels[1, 1, 4] = 1
    write_image(labels[:, :, ::4], heart.affine * [1, 1, 4, 1], path)
    return path


@pytest.mark.slow
def test_label_map_comes_back_as_if_it_had_been_fitted_here(
    session: Session, running: Running, tmp_path: Path
):
    session.load_file(labeled_stack(tmp_path / "labels.nii.gz"), KEPT.name).result()
    mask = session.case.mask
    assert set(np.unique(mask.blood)) == {0, LEFT_BLOOD, RIGHT_BLOOD}
    session.choices.optimize = False
    remote = Remote(session)
    remote.send(Address(running.url)).result()
    remote.close()
    assert session.runs[-1].phase == "done", session.runs[-1].error
    there, bare = session.shown.result, replace(mask, blood=None)
    here, without = (heartgen.personalize(each, optimize=False, lod=1) for each in (mask, bare))
    assert "separate pieces" in str(here.report.findings)
    same = {"seconds": {}, "versions": {}}
    assert replace(there.report, **same) == replace(here.report, **same)
    middle = np.full((1, 3), 0.5)  # of each element
    np.testing.assert_allclose(there.mesh.evaluate(middle), here.mesh.evaluate(middle), atol=1e-9)
    assert without.report.accuracy != here.report.accuracy  # else nothing was asked here


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
