"""Requests about jobs: what is taken, what is refused, and who sees it."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from heartgen.service.app import make_app
from heartgen.service.service import Service
from heartgen.service.settings import Settings
from tests.service.helpers import HOME, bearer, finish, submit


@pytest.mark.slow
def test_job_is_submitted_followed_and_its_result_taken(
    client: TestClient, service: Service, mask: Path, result: Path
) -> None:
    answer = submit(client, mask, title="my heart")
    assert answer.status_code == 202
    job = answer.json()
    assert (job["state"], job["place"], job["title"]) == ("queued", 1, "my heart")
    assert client.get(f"/v1/jobs/{job['id']}/results").status_code == 409
    finish(service, result, job["id"])
    told = client.get(answer.headers["location"]).json()
    assert (told["state"], told["progress"]) == ("done", 1.0)
    assert told["summary"]["error_mean"] < 1
    archive = client.get(f"/v1/jobs/{job['id']}/results")
    with zipfile.ZipFile(io.BytesIO(archive.content)) as files:
        assert set(files.namelist()) == {"mesh.exf", "mesh.vtu", "report.json"}
    part = client.get(f"/v1/jobs/{job['id']}/results/exf", headers={"Range": "bytes=0-19"})
    assert part.status_code == 206
    assert part.content == (result / "mesh.exf").read_bytes()[:20]
    events = client.get(f"/v1/jobs/{job['id']}/events").text
    assert '"state":"done"' in events.replace(" ", "")
    assert [each["id"] for each in client.get("/v1/jobs").json()] == [job["id"]]


@pytest.mark.slow
def test_same_mask_and_options_are_answered_from_the_store(
    client: TestClient, service: Service, mask: Path, result: Path
) -> None:
    finish(service, result, submit(client, mask).json()["id"])
    again = submit(client, mask).json()
    assert again["state"] == "done"
    other = submit(client, mask, options='{"optimize": false, "lod": 2}').json()
    assert other["state"] == "queued"


def test_idempotency_key_gives_the_same_job(client: TestClient, mask: Path) -> None:
    key = {"Idempotency-Key": "today"}
    first, second = (submit(client, mask, key).json() for _ in range(2))
    assert first["id"] == second["id"]
    other = submit(client, mask, key, options='{"lod": 2}')
    assert other.status_code == 422
    assert "idempotency key" in other.json()["detail"]


def test_cancelled_job_stays_cancelled(client: TestClient, service: Service, mask: Path) -> None:
    job = submit(client, mask).json()["id"]
    assert client.delete(f"/v1/jobs/{job}").json()["state"] == "cancelled"
    assert client.delete(f"/v1/jobs/{job}").json()["state"] == "cancelled"
    assert service.jobs.claim("s") is None
    assert "cancelled" in client.get(f"/v1/jobs/{job}/results").json()["detail"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("data", "said"),
    [
        ({"options": '{"lod": 9}'}, "level of detail 9 does not exist"),
        ({"options": '{"lods": 1}'}, "did you mean 'lod'"),
        ({"options": "[1]"}, "not a JSON object"),
        ({"options": "{" * 5000}, "not a JSON object"),
        ({"labels": "lv_myocardium="}, "are not roles"),
        ({"rv_wall": "thick"}, "not a number"),
        ({"title": "a\x00b"}, "control characters"),
        ({"email": "somebody@example.org"}, "sends no mail"),
    ],
)
def test_what_cannot_be_done_is_refused_in_a_sentence(
    client: TestClient, service: Service, mask: Path, data: dict[str, str], said: str
) -> None:
    answer = submit(client, mask, **data)
    assert answer.status_code == 422
    assert said in answer.json()["detail"]
    assert service.jobs.counts()["queued"] == 0


def zip_of(names: list[str]) -> bytes:
    """An archive with files of these names."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name in names:
            archive.writestr(name, b"")
    return buffer.getvalue()


HOSTILE = {
    "zip slip": ("x.zip", lambda: zip_of(["../../evil"])),
    "zip of many": ("x.zip", lambda: zip_of([f"{n}" for n in range(100_000)])),
    "zip as image": ("x.nii.gz", lambda: zip_of(["../evil"])),
    "path": ("../../../etc/evil", lambda: b"x" * 400),
    "backslashes": ("..\\..\\evil.exe", lambda: b"x" * 400),
    "empty": ("x.nii", lambda: b""),
    "page": ("x.nii", lambda: b"<script>alert(1)</script>" * 40),
    "no name": ("x", lambda: b"\x00" * 1000),
}


@pytest.mark.parametrize("name", HOSTILE)
@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_hostile_upload_is_refused_and_leaves_nothing(
    client: TestClient, service: Service, tmp_path: Path, name: str
) -> None:
    file, content = HOSTILE[name]
    answer = client.post("/v1/jobs", files={"mask": (file, content())})
    assert answer.status_code == 422
    assert len(answer.json()["detail"]) > 20
    assert service.jobs.counts()["queued"] == 0
    left = [p for p in tmp_path.rglob("*") if p.is_file() and p.parent != service.artifacts.home]
    assert left == []


def test_name_of_a_file_is_never_a_path(
    client: TestClient, service: Service, mask: Path, tmp_path: Path
) -> None:
    name = "../../../tmp/evil\x01.nii.gz"
    answer = client.post("/v1/jobs", files={"mask": (name, mask.read_bytes())})
    assert answer.status_code == 202
    files = [p.name for p in tmp_path.rglob("*.nii.gz")]
    assert files == ["mask.nii.gz"]


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
@pytest.mark.parametrize("announced", [True, False])
def test_upload_is_ended_where_it_is_too_large(settings: Settings, announced: bool) -> None:
    client = TestClient(make_app(settings.model_copy(update={"upload_limit": 2})), base_url=HOME)
    sent = 0

    def endless() -> Iterator[bytes]:
        nonlocal sent
        yield b'--x\r\nContent-Disposition: form-data; name="mask"; filename="a.nii"\r\n\r\n'
        for _ in range(8):
            sent += 1024**2
            yield b"\0" * 1024**2

    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    if announced:
        headers |= {"Content-Length": str(10**9)}
    content = b"" if announced else endless()
    answer = client.post("/v1/jobs", content=content, headers=headers)
    assert answer.status_code == 413
    assert "3 MB that are taken here" in answer.json()["detail"]


def test_only_the_owner_sees_a_job(guarded: TestClient, mask: Path) -> None:
    service = guarded.app.state.service
    mine, other = bearer(service), bearer(service)
    job = submit(guarded, mask, mine).json()["id"]
    for place in ("", "/results", "/results/exf", "/events"):
        answer = guarded.get(f"/v1/jobs/{job}{place}", headers=other)
        if place != "/events":
            assert answer.status_code == 404
    assert guarded.delete(f"/v1/jobs/{job}", headers=other).status_code == 404
    assert guarded.get("/v1/jobs", headers=other).json() == []
    assert guarded.get(f"/v1/jobs/{job}", headers=mine).status_code == 200


def test_tokens_are_for_something_and_can_be_taken_back(guarded: TestClient, mask: Path) -> None:
    service = guarded.app.state.service
    assert submit(guarded, mask).status_code == 401
    reader = bearer(service, "library")
    assert submit(guarded, mask, reader).status_code == 403
    assert guarded.get("/v1/models", headers=reader).status_code == 200
    assert guarded.get("/metrics", headers=reader).status_code == 403
    token = reader["Authorization"].split()[1]
    assert token not in json.dumps([each.hash for each in service.tokens.all()])
    service.tokens.revoke(token.split("_")[1])
    assert guarded.get("/v1/models", headers=reader).status_code == 401
    for wrong in ("", "x", token + "x", "hg_\u00e9_x", "hg_" + "a" * 9000):
        header = {"Authorization": f"Bearer {wrong}".encode("latin-1", "replace")}
        assert guarded.get("/v1/jobs", headers=header).status_code == 401


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_guessing_and_flooding_are_slowed_down(guarded: TestClient) -> None:
    codes = [
        guarded.get("/v1/jobs", headers={"Authorization": "Bearer hg_1_2"}).status_code
        for _ in range(32)
    ]
    assert codes[0] == 401
    assert codes[-1] == 429


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_a_token_asks_so_often_and_no_more(guarded: TestClient) -> None:
    guarded.app.state.service.settings.rate_limit = 3
    header = bearer(guarded.app.state.service)
    codes = [guarded.get("/v1/jobs", headers=header).status_code for _ in range(4)]
    assert codes == [200, 200, 200, 429]


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_page_of_another_site_cannot_submit(client: TestClient, mask: Path) -> None:
    for header in ({"Sec-Fetch-Site": "cross-site"}, {"Origin": "http://evil.example"}):
        assert submit(client, mask, header).status_code == 403
    assert client.get("/v1/jobs", headers={"Host": "evil.example"}).status_code == 400
    files = {"mask": ("heart.nii.gz", mask.read_bytes())}
    assert client.post("/submit", files=files).status_code == 403


@pytest.mark.parametrize("database", ["sqlite"], indirect=True)
def test_answers_have_security_headers(client: TestClient) -> None:
    for place in ("/", "/library", "/v1/jobs", "/v1/jobs/unknown", "/static/service.css"):
        headers = client.get(place).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert "default-src 'self'" in headers["content-security-policy"]


def test_health_and_metrics_are_told(client: TestClient, mask: Path) -> None:
    submit(client, mask)
    health = client.get("/healthz")
    assert health.status_code == 503
    assert health.json() == {"database": True, "disk": True, "workers": False}
    metrics = client.get("/metrics").text
    assert 'heartgen_jobs{state="queued"} 1.0' in metrics
    assert 'route="/v1/jobs"' in metrics


def test_full_disk_is_told_and_nothing_is_half_kept(
    client: TestClient, service: Service, mask: Path
) -> None:
    service.artifacts.free = 10**9
    answer = submit(client, mask)
    assert answer.status_code == 503
    assert "disk of the service is full" in answer.json()["detail"]
    service.artifacts.free = 0
    assert submit(client, mask).status_code == 202
