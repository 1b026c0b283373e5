"""What compose.yaml and the example for Kubernetes start is there, and starts without Docker."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from typer.core import TyperGroup
from typer.main import get_command

from heartgen.cli.operating import app
from heartgen.service.settings import Settings

yaml: Any = pytest.importorskip("yaml")


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
