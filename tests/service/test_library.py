"""The library: published, found, taken away, withdrawn, exported and imported."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from fastapi.testclient import TestClient
from sqlalchemy import select

import heartgen
from heartgen.errors import InputError
from heartgen.service.archive import TABLE, export, take_in
from heartgen.service.service import Service
from heartgen.service.settings import Settings
from heartgen.service.tables import Audit
from heartgen.service.tokens import NOBODY
from tests.service.helpers import bearer, finish, submit

ABOUT = {"title": "A cup", "condition": "healthy", "sex": "female", "no_names": True}


@pytest.fixture(autouse=True)
def undrawn(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw nothing: that takes long, and others test it."""
    monkeypatch.setattr("heartgen.service.library.SHOWN", ())


@pytest.fixture
def job(client: TestClient, service: Service, mask: Path, result: Path) -> str:
    """A job that is done."""
    identifier = submit(client, mask).json()["id"]
    finish(service, result, identifier)
    return identifier


def publish(client: TestClient, job: str, before: str | None = None, **metadata: object) -> dict:
    """Publish a result."""
    told = {"job": job, "metadata": ABOUT | metadata, "new_version_of": before}
    answer = client.post("/v1/models", json=told)
    assert answer.status_code == 201, answer.text
    return answer.json()


@pytest.mark.slow
def test_model_is_published_found_and_taken_away(
    client: TestClient, job: str, tmp_path: Path
) -> None:
    model = publish(client, job, keywords=["cup", "phantom"])
    publish(client, job, title="Another", condition="DCM")
    found = client.get("/v1/models", params={"q": "PHANTOM cup"}).json()
    assert [each["identifier"] for each in found["models"]] == [model["identifier"]]
    assert client.get("/v1/models", params={"q": "100%"}).json()["total"] == 0
    found = client.get("/v1/models", params={"condition": "DCM"}).json()
    assert found["total"] == 1
    assert found["facets"]["condition"] == {"DCM": 1, "healthy": 1}
    assert found["facets"]["sex"] == {"female": 1}
    files = f"/v1/models/{model['identifier']}/versions/1/files"
    (tmp_path / "mesh.exf").write_bytes(client.get(f"{files}/exf").content)
    assert heartgen.read_mesh(tmp_path / "mesh.exf").n_elements == 72
    report = client.get(f"{files}/report").json()
    assert report["name"] == model["identifier"]
    assert report["mask_source"] is None
    assert model["provenance"]["mask_sha256"] == report["mask_sha256"]
    assert model["identifier"] in model["cite_as"]


def test_versions_follow_each_other_and_can_be_withdrawn(
    client: TestClient, service: Service, job: str
) -> None:
    first = publish(client, job)
    second = publish(client, job, first["identifier"], title="A better cup")
    assert (first["version"], second["version"]) == (1, 2)
    place = f"/v1/models/{first['identifier']}"
    assert client.get(place).json()["title"] == "A better cup"
    assert client.get("/v1/models").json()["total"] == 1
    assert [each["version"] for each in client.get(f"{place}/versions").json()] == [2, 1]
    assert client.delete(f"{place}/versions/2").status_code == 204
    assert client.get(place).json()["version"] == 1
    assert client.get(f"{place}/versions/2").status_code == 404
    with service.database.reading() as session:
        actions = session.scalars(select(Audit.action).order_by(Audit.id)).all()
    assert actions == ["publish", "publish", "withdraw"]


def test_only_its_owner_changes_a_model(guarded: TestClient, mask: Path, result: Path) -> None:
    service = guarded.app.state.service
    mine, other = bearer(service), bearer(service)
    jobs = [submit(guarded, mask, each).json()["id"] for each in (mine, other)]
    finish(service, result, jobs[0])
    told = {"job": jobs[0], "metadata": ABOUT}
    assert guarded.post("/v1/models", json=told, headers=other).status_code == 404
    model = guarded.post("/v1/models", json=told, headers=mine).json()["identifier"]
    told = {"job": jobs[1], "metadata": ABOUT, "new_version_of": model}
    assert guarded.post("/v1/models", json=told, headers=other).status_code == 422
    assert guarded.delete(f"/v1/models/{model}/versions/1", headers=other).status_code == 422
    reader = bearer(service, "library")
    assert guarded.post("/v1/models", json=told, headers=reader).status_code == 403
    assert guarded.get(f"/v1/models/{model}", headers=reader).status_code == 200


@pytest.mark.slow
@pytest.mark.parametrize(
    "metadata",
    [
        {"title": "DOE^JANE"},
        {"title": ""},
        {"license": "mine"},
        {"sex": "7"},
        {"no_names": False},
        {"patient": "Jane"},
        {"keywords": ["a\x00b"]},
    ],
)
def test_metadata_is_refused(client: TestClient, job: str, metadata: dict) -> None:
    told = {"job": job, "metadata": ABOUT | metadata}
    assert client.post("/v1/models", json=told).status_code == 422
    assert client.get("/v1/models").json()["total"] == 0


def test_pages_escape_what_they_show(client: TestClient, job: str) -> None:
    evil = "</script><script>alert(1)</script>"
    model = publish(client, job, title=evil, description=evil, citation=evil)
    for place in ("/library", f"/library/{model['identifier']}"):
        page = client.get(place)
        assert page.status_code == 200
        assert "<script>alert" not in page.text
    linked = client.get(f"/v1/models/{model['identifier']}/versions/1/jsonld").json()
    assert linked["@type"] == "Dataset"
    assert linked["identifier"] == model["identifier"]
    assert linked["license"].startswith("https://creativecommons.org/")


@pytest.mark.slow
def test_library_goes_out_and_in_again(
    client: TestClient, service: Service, job: str, tmp_path: Path
) -> None:
    first = publish(client, job, keywords=["cup"])
    publish(client, job, first["identifier"], title="A better cup")
    path = tmp_path / "library.zip"
    assert export(service.library, path) == 2
    other = Service(Settings(data=tmp_path / "other", free_space=0))
    assert take_in(other.library, path, NOBODY).added == 2
    assert take_in(other.library, path, NOBODY).known == 2
    again = other.library.get(first["identifier"])
    assert again is not None
    assert (again.version, again.title, again.keywords) == (2, "A better cup", [])
    assert [each.latest for each in other.library.versions(first["identifier"])] == [True, False]
    assert other.library.file(again, "exf").read_bytes() == (
        service.library.file(service.library.get(first["identifier"]), "exf").read_bytes()
    )
    other.database.close()


def spoiled(path: Path, target: Path, table=lambda rows: rows, names=lambda name: name) -> Path:
    """An archive with another table, or with files under other names."""
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(target, "w") as out:
        for entry in archive.infolist():
            content = archive.read(entry)
            if entry.filename == TABLE:
                old = pq.read_table(io.BytesIO(content))
                buffer = io.BytesIO()
                rows = table(old.to_pylist())
                pq.write_table(pa.Table.from_pylist(rows, schema=old.schema), buffer)
                content = buffer.getvalue()
            out.writestr(names(entry.filename), content)
    return target


@pytest.mark.slow
@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
@pytest.mark.parametrize(
    "change",
    [
        {"identifier": "../../evil"},
        {"version": -1},
        {"sha256": json.dumps({"../../evil": "0"})},
        {"sha256": "{}"},
        {"sha256": "["},
        {"title": "x" * 9000},
        {"provenance": "3"},
        {"sha256": json.dumps(dict.fromkeys(("mesh.exf", "mesh.vtu", "report.json"), "0" * 64))},
    ],
)
def test_hostile_archive_is_refused(
    client: TestClient, service: Service, job: str, tmp_path: Path, change: dict
) -> None:
    publish(client, job)
    export(service.library, tmp_path / "library.zip")
    bad = spoiled(tmp_path / "library.zip", tmp_path / "bad.zip", lambda rows: [rows[0] | change])
    other = Service(Settings(data=tmp_path / "other", free_space=0))
    with pytest.raises(InputError):
        take_in(other.library, bad, NOBODY)
    assert list((tmp_path / "other" / "library").glob("[!.]*")) == []
    assert not list(tmp_path.glob("**/evil"))
    other.database.close()


@pytest.mark.slow
@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_archive_that_slips_is_not_followed(
    client: TestClient, service: Service, job: str, tmp_path: Path
) -> None:
    publish(client, job)
    export(service.library, tmp_path / "library.zip")
    bad = spoiled(
        tmp_path / "library.zip",
        tmp_path / "bad.zip",
        names=lambda name: name.replace("files/", "../../files/"),
    )
    answer = client.post("/v1/models/archive", files={"archive": ("a.zip", bad.read_bytes())})
    assert answer.status_code == 200  # all of its models are known, so no file is read
    other = Service(Settings(data=tmp_path / "other", free_space=0))
    with pytest.raises(InputError, match="is not in this archive"):
        take_in(other.library, bad, NOBODY)
    answer = client.post("/v1/models/archive", files={"archive": ("a.zip", b"PK\x03\x04" * 99)})
    assert answer.status_code == 422
    other.database.close()
