"""The rules of the house hold: lint, form, types, spelling, layers, and a lock that is in step."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

CHECKS = [
    "ruff check .",
    "ruff format --check .",
    "mypy --strict heartgen",
    "codespell",
    "lint-imports --no-logo",
]


NOT_LOCKED = "bench"
"""Extra with other registration tools to compare with, which no test needs."""


@pytest.mark.parametrize("check", CHECKS)
def test_check_passes(check: str, repository: Path) -> None:
    tool, *arguments = check.split()
    answer = subprocess.run(
        [Path(sys.executable).with_name(tool), *arguments],
        cwd=repository,
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, f"{check}\n{answer.stdout}{answer.stderr}"


@pytest.mark.parametrize("check", CHECKS)
def test_make_check_runs_the_same(check: str, repository: Path) -> None:
    assert f"\t$(BIN)/{check}\n" in (repository / "Makefile").read_text()


def test_lock_holds_every_declared_requirement(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    declared = list(project["dependencies"])
    for name, extra in project["optional-dependencies"].items():
        declared += extra if name != NOT_LOCKED else []
    lock = (repository / "requirements.lock").read_text()
    pins = {
        canonicalize_name(name): version
        for name, version in re.findall(r"^([\w.-]+)==([\w.]+)", lock, re.MULTILINE)
    }
    for requirement in map(Requirement, declared):
        if requirement.name == project["name"]:  # an extra that builds on another
            continue
        pin = pins.get(canonicalize_name(requirement.name))
        assert pin is not None, f"{requirement.name} is not in requirements.lock: run make lock"
        assert pin in requirement.specifier, f"{requirement} is locked at {pin}: run make lock"


def test_lock_names_no_place(repository: Path) -> None:
    lock = (repository / "requirements.lock").read_text()
    assert not re.findall(r"^--(?:extra-)?index-url|^--find-links|://| @ ", lock, re.MULTILINE)


def test_binder_installs_what_is_locked(repository: Path) -> None:
    lock = (repository / "requirements.lock").read_text()
    pins = dict(re.findall(r"^([\w.-]+)==([\w.]+)", lock, re.MULTILINE))
    wanted = (repository / "binder" / "requirements.txt").read_text()
    binder = dict(re.findall(r"^([\w.-]+)==([\w.]+)", wanted, re.MULTILINE))
    assert {"voila", "jupyterlab", "jupyter-server-proxy", "pyvista"} <= set(binder)
    stale = {name: pin for name, pin in binder.items() if pins.get(name) != pin}
    assert not stale, "binder/requirements.txt is not in step with the lock: run make binder"


def test_every_benchmark_can_be_imported(repository: Path) -> None:
    files = sorted(p.relative_to(repository) for p in (repository / "benchmarks").rglob("*.py"))
    modules = [".".join(p.with_suffix("").parts) for p in files if not p.stem.startswith("__")]
    answer = subprocess.run(
        [sys.executable, "-c", f"import {', '.join(modules)}"],
        cwd=repository,
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
