"""What the dispatcher does with what workers say; no cluster is started."""

from __future__ import annotations

import errno
import json
import os
import shutil
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from heartgen.service.dispatcher import Dispatcher
from heartgen.service.service import Service
from heartgen.service.tables import State
from tests.service.helpers import submit


@pytest.fixture
def dispatcher(client: TestClient) -> Dispatcher:
    """As the server has it."""
    return client.app.state.dispatcher


@pytest.fixture
def claimed(client: TestClient, service: Service, dispatcher: Dispatcher, mask: Path):
    """A job that it has taken."""
    submit(client, mask)
    job = service.jobs.claim(dispatcher.name)
    assert job is not None
    return job


def test_result_that_a_lost_server_left_is_not_made_again(
    service: Service, dispatcher: Dispatcher, claimed, result: Path
) -> None:
    shutil.copytree(result, service.artifacts.result(claimed.fingerprint))
    dispatcher._begin(None, claimed)  # type: ignore[arg-type]  # nobody is asked
    assert service.jobs.get(claimed.id).state == State.DONE


def test_full_disk_has_the_job_wait(
    service: Service, dispatcher: Dispatcher, claimed, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(service.artifacts, "free", 10**9)
    folder, reason = service.artifacts.result(claimed.fingerprint), os.strerror(errno.ENOSPC)
    folder.mkdir()
    rows = [{"status": f"failed: mesh.vtu: The file cannot be written ({reason}): choose another"}]
    (folder / "rows.json").write_text(json.dumps({"key": "", "rows": rows}))
    dispatcher._begin(None, claimed)  # type: ignore[arg-type]  # the worker has left its reason
    assert service.jobs.get(claimed.id).state == State.QUEUED
    assert not dispatcher._has_room()
    assert not service.artifacts.result(claimed.fingerprint).exists()  # it is done again


def test_failure_is_told_and_does_not_answer_for_it_later(
    client: TestClient, service: Service, dispatcher: Dispatcher, claimed, mask: Path, result: Path
) -> None:
    shutil.copytree(result, service.artifacts.result(claimed.fingerprint))
    dispatcher._keep(claimed, [{"status": "failed: it has no cavity"}])
    told = service.jobs.get(claimed.id)
    assert (told.state, told.reason) == (State.FAILED, "it has no cavity")
    assert not service.artifacts.is_done(claimed.fingerprint)
    assert submit(client, mask).json()["state"] == "queued"


def test_options_that_are_no_more_end_the_job_and_not_the_service(
    service: Service, dispatcher: Dispatcher, claimed
) -> None:
    claimed.options = {"former": 1}
    dispatcher._begin(None, claimed)  # type: ignore[arg-type]  # nobody is asked
    told = service.jobs.get(claimed.id)
    assert told.state == State.FAILED
    assert "former" in told.reason


def test_jobs_wait_again_when_the_server_is_started(
    client: TestClient, service: Service, dispatcher: Dispatcher, claimed
) -> None:
    assert service.jobs.put_back_lost(9) == 0
    assert service.jobs.put_back_lost(9, everyone=True) == 1
    assert client.get(f"/v1/jobs/{claimed.id}").json()["state"] == "queued"
