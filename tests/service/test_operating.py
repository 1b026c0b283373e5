"""Migrations, retention, mails."""

from __future__ import annotations

import time
from collections.abc import Iterator
from email import message_from_bytes, policy
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from sqlalchemy import MetaData, Table, func, inspect, select

from heartgen.service.database import Database, upgrade
from heartgen.service.mail import Mailer
from heartgen.service.retention import DAY, remove_old
from heartgen.service.service import Service
from heartgen.service.settings import Settings
from heartgen.service.tables import Base, Job, Mail
from tests.service.helpers import finish, free_port, submit


def test_first_schema_is_brought_up_to_date_without_loss(settings: Settings) -> None:
    url = settings.database_url
    upgrade(url, "0001")
    database = Database(url)
    row = {
        "id": "a" * 32,
        "owner": "somebody",
        "fingerprint": "f" * 64,
        "title": "heart",
        "upload": "uploads/0/mask.nii",
        "upload_sha256": "0" * 64,
        "options": {"lod": 2},
        "selection": {"label": []},
        "state": "queued",
        "progress": 0.0,
        "starts": 0,
        "created": 1.0,
    }
    with database.writing() as session:
        old = Table("jobs", MetaData(), autoload_with=session.connection())
        session.execute(old.insert().values(row))
    upgrade(url)
    upgrade(url)
    with database.reading() as session:
        [job] = session.scalars(select(Job))
        assert {name: getattr(job, name) for name in row} == row
        assert job.email is None
    database.close()


def test_migrations_make_the_tables_that_the_program_has(settings: Settings) -> None:
    upgrade(settings.database_url)
    database = Database(settings.database_url)
    found = inspect(database.engine)
    for name, table in Base.metadata.tables.items():
        columns = {each["name"]: each for each in found.get_columns(name)}
        assert set(columns) == set(table.columns.keys())
        for column in table.columns:
            assert columns[column.name]["nullable"] == column.nullable, column
        indexes = {tuple(each["column_names"]) for each in found.get_indexes(name)}
        assert {tuple(each.columns.keys()) for each in table.indexes} <= indexes
    database.close()


def test_what_is_old_is_removed_unless_it_is_needed(
    client: TestClient, service: Service, mask: Path, result: Path
) -> None:
    first = submit(client, mask).json()["id"]
    job = finish(service, result, first)
    second = submit(client, mask, options='{"optimize": false, "lod": 3}').json()["id"]
    assert remove_old(service) == 0
    later = time.time() + (service.settings.retention + 1) * DAY
    assert remove_old(service, later) == 1
    assert client.get(f"/v1/jobs/{first}").status_code == 404
    assert not service.artifacts.result(job.fingerprint).exists()
    assert (service.artifacts.home / job.upload).exists()  # for the one that waits
    client.delete(f"/v1/jobs/{second}")
    assert remove_old(service, later) == 1
    assert not (service.artifacts.home / job.upload).exists()


class Inbox:
    """A real SMTP server that keeps what it gets, after refusing a few."""

    def __init__(self) -> None:
        self.refusals = 0
        self.mails: list[bytes] = []

    async def handle_DATA(self, server, session, envelope) -> str:  # noqa: N802
        if self.refusals:
            self.refusals -= 1
            return "451 not now"
        self.mails.append(envelope.content)
        return "250 OK"


@pytest.fixture
def inbox() -> Iterator[tuple[Inbox, int]]:
    """The server, and its port."""
    controller = pytest.importorskip("aiosmtpd.controller").Controller
    handler, port = Inbox(), free_port()
    server = controller(handler, hostname="127.0.0.1", port=port)
    server.start()
    yield handler, port
    server.stop()


@pytest.mark.slow
def test_result_mail_is_sent_again_until_it_is_taken(
    client: TestClient, service: Service, mask: Path, result: Path, inbox: tuple[Inbox, int]
) -> None:
    handler, port = inbox
    handler.refusals = 1
    service.settings.smtp = Settings(smtp=f"smtp://127.0.0.1:{port}").smtp
    assert submit(client, mask, email="nobody").status_code == 422
    job = submit(client, mask, email="me@example.org", title="Heart <b>\n1").json()["id"]
    finish(service, result, job)
    picture = service.artifacts.home / "renditions"
    [fingerprint] = [each.name for each in service.artifacts.results.iterdir() if each.is_dir()]
    made = picture / f"results-{fingerprint}" / "preview"
    made.mkdir(parents=True)
    (made / "preview.png").write_bytes(b"\x89PNG")
    mailer = Mailer(service, pause=0.1)
    mailer.start()
    end = time.monotonic() + 60
    while not handler.mails and time.monotonic() < end:
        time.sleep(0.1)
    mailer.stop()
    [content] = handler.mails
    mail = message_from_bytes(content, policy=policy.default)
    assert mail["To"] == "me@example.org"
    plain, html = (mail.get_body((kind,)) for kind in ("plain", "html"))
    assert f"/jobs/{job}" in plain.get_content()
    assert "Error, mean" in plain.get_content()
    assert "&lt;b&gt;" in html.get_content()
    assert [each.get_content_type() for each in mail.walk()].count("image/png") == 1
    with service.database.reading() as session:
        [kept] = session.scalars(select(Mail))
        assert session.scalar(select(func.count()).select_from(Mail)) == 1
    assert (kept.tries, kept.error) == (2, None)
