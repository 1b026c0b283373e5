"""The service on an embedded database and on a PostgreSQL server, which is started here."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest

pytest.importorskip("fastapi")
pytest.importorskip("sqlalchemy")
pytest.importorskip("alembic")
pytest.importorskip("limits")

from fastapi.testclient import TestClient

import heartgen
from heartgen import samples
from heartgen.images.writing import write_mask
from heartgen.service import security
from heartgen.service.app import make_app
from heartgen.service.service import Service
from heartgen.service.settings import Settings
from tests.service.helpers import HOME, Postgres

SPACING = 4.0
"""mm; coarse, so that a fit takes a second."""


@pytest.fixture(scope="session")
def postgres() -> Iterator[Postgres]:
    """A server that runs."""
    if not list(Path("/usr/lib/postgresql").glob("*/bin/initdb")) and not shutil.which("initdb"):
        pytest.skip("PostgreSQL is not installed: apt install postgresql")
    server = Postgres()
    server.start()
    yield server
    server.remove()


@pytest.fixture(params=["sqlite", "postgresql"])
def database(request: pytest.FixtureRequest) -> str | None:
    """Address of an empty database; None for the embedded one."""
    if request.param == "sqlite":
        return None
    return str(request.getfixturevalue("postgres").fresh())


@pytest.fixture
def settings(database: str | None, tmp_path: Path) -> Settings:
    """Of a service on this machine."""
    return Settings(data=tmp_path / "data", database=database, free_space=0)


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    """Requests without a token; nothing runs beside them."""
    security._limiter.storage.reset()
    app = make_app(settings)
    yield TestClient(app, base_url=HOME, raise_server_exceptions=False)
    app.state.service.database.close()


@pytest.fixture
def service(client: TestClient) -> Service:
    """The parts behind the requests."""
    return client.app.state.service


@pytest.fixture
def guarded(settings: Settings) -> Iterator[TestClient]:
    """Requests that need a token."""
    security._limiter.storage.reset()
    app = make_app(settings.model_copy(update={"anonymous": False}))
    yield TestClient(app, base_url=HOME, raise_server_exceptions=False)
    app.state.service.database.close()


@pytest.fixture(scope="session")
def mask(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A file with a small heart."""
    path = tmp_path_factory.mktemp("mask") / "heart.nii.gz"
    write_mask(samples.ideal_cup(SPACING).mask, path)
    return path


@pytest.fixture(scope="session")
def result(tmp_path_factory: pytest.TempPathFactory, mask: Path) -> Path:
    """Folder of the result for it, as a worker leaves it."""
    folder = tmp_path_factory.mktemp("result")
    heartgen.personalize(mask, optimize=False).write(folder)
    row = {"status": "success"}
    (folder / "rows.json").write_text(json.dumps({"key": "", "rows": [row]}))
    return folder
