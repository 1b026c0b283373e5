"""What compose.yaml and the example for Kubernetes start is there, and starts without Docker."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from typer.core import TyperGroup
from typer.main import get_command

import heartgen
from heartgen.cli.operating import app
from heartgen.service.security import COOKIE, FORM_KEY
from heartgen.service.service import Service
from heartgen.service.settings import Settings
from tests.service.helpers import Postgres, free_port
from tests.service.running import STARTING, Running

yaml: Any = pytest.importorskip("yaml")

SITE = "HEARTGEN_SITE"
"""Variable for the name that the proxy answers to."""


@pytest.fixture(scope="module")
def compose(repository: Path) -> dict[str, Any]:
    """What is composed."""
    return yaml.safe_load((repository / "compose.yaml").read_text())["services"]


def pods(repository: Path) -> Iterator[dict[str, Any]]:
    """Containers of the example for Kubernetes."""
    for each in yaml.safe_load_all((repository / "deploy" / "kubernetes.yaml").read_text()):
        if each["kind"] == "Deployment":
            yield from each["spec"]["template"]["spec"]["containers"]


def check(command: list[str]) -> None:
    """A command of ours has all flags that are given; one of Dask is what tests start, too."""
    if command[0] == "dask":
        assert command[1] in ("scheduler", "worker")
        return
    assert command[0] == "heartgen"
    group = get_command(app)
    assert isinstance(group, TyperGroup)
    known = {flag for each in group.commands[command[1]].params for flag in each.opts}
    assert {word for word in command[2:] if word.startswith("--")} <= known


def wait_for(ready: Callable[[], bool], log: Path) -> None:
    """Wait until a process is ready."""
    end = time.monotonic() + STARTING
    while not ready():
        assert time.monotonic() < end, log.read_text()
        time.sleep(0.5)


def form_key(page: str) -> str:
    """What a form of a page brings back."""
    found = re.search(rf'name="{FORM_KEY}" value="(\w+)"', page)
    assert found is not None
    return found[1]


def test_commands_and_settings_of_compose_are_ours(compose: dict[str, Any]) -> None:
    assert set(compose) == {"service", "scheduler", "worker", "dashboard", "database", "proxy"}
    for name in ("service", "scheduler", "worker", "dashboard"):
        check(compose[name]["command"])
    names = {f"HEARTGEN_{name.upper()}" for name in Settings.model_fields}
    assert set(compose["service"]["environment"]) <= names


def test_commands_and_settings_of_kubernetes_are_ours(repository: Path) -> None:
    found = list(pods(repository))
    assert len(found) == 3
    names = {f"HEARTGEN_{name.upper()}" for name in Settings.model_fields}
    for each in found:
        check(each["command"])
        assert {variable["name"] for variable in each.get("env", ())} <= names


def test_example_for_kubernetes_fits_its_schemas(repository: Path) -> None:
    schemas: Any = pytest.importorskip("kubernetes_validate")
    text = (repository / "deploy" / "kubernetes.yaml").read_text()
    for each in yaml.safe_load_all(text):
        schemas.validate(each, schemas.latest_version(), strict=True)


def test_image_installs_the_versions_of_the_lock(repository: Path, tmp_path: Path) -> None:
    text = (repository / "Dockerfile").read_text()
    made = re.search(r"sed -E '.*?' requirements.lock", text)
    assert made is not None
    command = ["bash", "-c", made[0]]
    pins = subprocess.run(command, cwd=repository, check=True, capture_output=True, text=True)
    lines = [line for line in pins.stdout.splitlines() if line and not line.strip().startswith("#")]
    assert len(lines) > 100
    assert all(re.match(r"[\w.-]+==[\w.]+( ; .+)?$", line) for line in lines)
    assert 'CMD ["heartgen", "serve"]' in text


@pytest.mark.slow
def test_proxy_understands_its_file(repository: Path, tmp_path: Path) -> None:
    caddy = shutil.which("caddy")
    if caddy is None:
        pytest.skip("Caddy is not installed: apt install caddy")
    command = [caddy, "validate", "--config", "deploy/Caddyfile", "--adapter", "caddyfile"]
    answer = subprocess.run(
        command,
        cwd=repository,
        env={"HOME": str(tmp_path), "PATH": "/usr/bin"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr


@pytest.mark.slow
def test_what_compose_starts_works_together_behind_its_proxy(
    repository: Path,
    compose: dict[str, Any],
    postgres: Postgres,
    mask: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Service, database, scheduler, two workers, dashboard and proxy with TLS, each as composed."""
    caddy = shutil.which("caddy")
    if caddy is None:
        pytest.skip("Caddy is not installed: apt install caddy")
    plain, front, dashboard, admin = (free_port() for _ in range(4))
    site = re.fullmatch(r"\$\{HEARTGEN_SITE:-(.+)\}", compose["proxy"]["environment"][SITE])
    assert site is not None
    url = f"https://{site[1]}:{front}"
    ports = f"http_port {plain}\nhttps_port {front}\nadmin 127.0.0.1:{admin}"
    (tmp_path / "Caddyfile").write_text(
        f"{{\nskip_install_trust\n{ports}\n}}\nimport {repository}/deploy/Caddyfile\n"
    )
    told = {"database": postgres.fresh(), "anonymous": False, "public_url": url}
    assert compose["worker"]["deploy"]["replicas"] == 2
    with Running(tmp_path, 0.05, scheduler=True, workers=2, **told) as running:
        running.environment |= {
            SITE: site[1],
            "HEARTGEN_SERVICE": running.url.partition("//")[2],
            "HEARTGEN_DASHBOARD": f"127.0.0.1:{dashboard}",
            "XDG_CONFIG_HOME": str(tmp_path),
            "XDG_DATA_HOME": str(tmp_path),
        }
        running.apart = {
            "proxy": [caddy, "run", "--config", str(tmp_path / "Caddyfile")],
            "dashboard": [sys.executable, "-c", "from heartgen.cli import main; main()"]
            + [
                {"0.0.0.0": "127.0.0.1", "8888": str(dashboard)}.get(word, word)
                for word in compose["dashboard"]["command"][1:]
            ],
        }
        for name in running.apart:
            running.start(name)
        certificate = tmp_path / "caddy" / "pki" / "authorities" / "local" / "root.crt"
        wait_for(certificate.is_file, tmp_path / "proxy.log")
        monkeypatch.setenv("SSL_CERT_FILE", str(certificate))
        service = Service(Settings(data=tmp_path / "data", database=told["database"]))
        token = service.tokens.create("group", ["jobs", "library"])
        service.database.close()
        client = heartgen.Client(url, token)
        job = client.submit(mask)
        assert client.wait(job, timeout=300, progress=lambda _: None)["summary"]["success"]
        names = [path.name for path in client.download(job, tmp_path / "out")]
        assert names == ["mesh.exf", "mesh.vtu", "report.json"]
        assert heartgen.Client(url)._http.get(f"/v1/jobs/{job}").status_code == 401
        library = httpx.get(f"{url}/library", headers={"Cookie": f"{COOKIE}={token}"})
        assert "0 models" in library.text
        assert library.headers["Content-Security-Policy"]
        form = {"token": token, FORM_KEY: form_key(httpx.get(f"{url}/login").text)}
        cookie = httpx.post(f"{url}/login", data=form).headers["Set-Cookie"]
        assert "Secure" in cookie.split("; ")
        away = httpx.get(f"http://{site[1]}:{plain}/library")
        assert (away.status_code, away.headers["Location"]) == (308, f"https://{site[1]}/library")
        wait_for(
            lambda: client._http.get("/dashboard/").status_code != 502, tmp_path / "dashboard.log"
        )
        page = client._http.get("/dashboard/", follow_redirects=True)
        assert page.status_code == 200
        assert page.url.path.startswith("/dashboard/")
