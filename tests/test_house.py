"""The rules of the house hold: lint, form, types, spelling, layers, and locks that are in step."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from benchmarks.layers import layers

CHECKS = [
    "ruff check .",
    "ruff format --check .",
    "mypy --strict heartgen",
    "codespell",
    "lint-imports --no-logo",
]


NOT_LOCKED = "bench"
"""Extra with other registration tools to compare with, which no test needs."""


@pytest.mark.slow
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


LOCKS = {
    "requirements.lock": {
        "apps",
        "cohort",
        "course",
        "dev",
        "dicom",
        "docs",
        "fieldml",
        "plot",
        "service",
    },
    "requirements-app.lock": {"apps", "dicom", "plot"},
}
"""The extras that each lock holds: of everything, and of the app alone."""


def pins(file: Path) -> dict[str, str]:
    """The version of each package that a lock names."""
    found = re.findall(r"^([\w.-]+)==([\w.]+)", file.read_text(), re.MULTILINE)
    return {canonicalize_name(name): version for name, version in found}


def test_every_extra_but_one_is_locked(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    assert set(project["optional-dependencies"]) == LOCKS["requirements.lock"] | {NOT_LOCKED}


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_holds_every_declared_requirement(lock: str, repository: Path) -> None:
    settings = tomllib.loads((repository / "pyproject.toml").read_text())
    project = settings["project"]
    declared = [*project["dependencies"], *settings["dependency-groups"]["build"]]
    for extra in LOCKS[lock]:
        declared += project["optional-dependencies"][extra]
    locked = pins(repository / lock)
    assert len(locked) > len(project["dependencies"])
    for requirement in map(Requirement, declared):
        if requirement.name == project["name"]:  # an extra that builds on another
            continue
        pin = locked.get(canonicalize_name(requirement.name))
        assert pin is not None, f"{requirement.name} is not in {lock}: run make lock"
        assert pin in requirement.specifier, f"{requirement} is locked at {pin}: run make lock"


@pytest.mark.parametrize("lock", LOCKS)
def test_lock_names_no_place(lock: str, repository: Path) -> None:
    text = (repository / lock).read_text()
    assert not re.findall(r"^--(?:extra-)?index-url|^--find-links|://| @ ", text, re.MULTILINE)


@pytest.mark.parametrize("file", ["requirements-app.lock", "binder/requirements.txt"])
def test_what_shows_the_app_is_locked_alike(file: str, repository: Path) -> None:
    everything, part = pins(repository / "requirements.lock"), pins(repository / file)
    assert {"voila", "jupyterlab", "anywidget", "pyvista"} <= set(part)
    stale = {name: pin for name, pin in part.items() if everything.get(name) != pin}
    assert not stale, f"{file} is not in step with requirements.lock: run make lock, make binder"


def test_app_is_set_up_without_what_only_developers_need(repository: Path) -> None:
    project = tomllib.loads((repository / "pyproject.toml").read_text())["project"]
    dev = {canonicalize_name(Requirement(r).name) for r in project["optional-dependencies"]["dev"]}
    tools = dev - {project["name"]}
    assert {"pytest", "mypy", "playwright", "mfem"} <= tools
    assert not tools & set(pins(repository / "requirements-app.lock"))


@pytest.mark.slow
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


def modules(repository: Path) -> dict[str, Path]:
    """All modules of the package by name."""
    files = sorted((repository / "heartgen").rglob("*.py"))
    parts = [file.relative_to(repository).with_suffix("").parts for file in files]
    names = [".".join(p[:-1] if p[-1] == "__init__" else p) for p in parts]
    return dict(zip(names, files, strict=True))


def imports_of(node: ast.AST) -> Iterator[str]:
    """What is imported when code runs: inside of functions, too, but not for types alone."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING":
            continue
        if isinstance(child, ast.Import):
            yield from (alias.name for alias in child.names)
        elif isinstance(child, ast.ImportFrom):
            yield from (f"{child.module}.{alias.name}" for alias in child.names)
        else:
            yield from imports_of(child)


def reaching_up(repository: Path) -> set[tuple[str, str]]:
    """Imports that are let reach up, only when a method is called: (module, what it imports).

    They are those that the contract of the layers names; ``heartgen`` itself is the front door.
    """
    settings = tomllib.loads((repository / "pyproject.toml").read_text())
    named = settings["tool"]["importlinter"]["contracts"][0]["ignore_imports"]
    front, *others = (tuple(each.split(" -> ")) for each in named)
    assert front == ("heartgen", "heartgen.**")
    return set(others)


@pytest.mark.slow
def test_no_module_imports_itself_in_a_circle(repository: Path) -> None:
    files, let = modules(repository), reaching_up(repository)
    assert len(let) == 3, "what reaches up is meant to stay this little"
    graph: dict[str, set[str]] = {}
    for module, file in files.items():
        found = imports_of(ast.parse(file.read_text()))
        known = {name if name in files else name.rpartition(".")[0] for name in found}
        graph[module] = {n for n in known & files.keys() - {module} if (module, n) not in let}
    del graph["heartgen"]
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(" imports ".join(reversed(error.args[1])))


LONGEST = 350
"""Lines of a module: past these there is a second idea in it."""

MOST_PARAMETERS = 7
"""Of a function: more of them have a name together. Those of a command are its options."""


def test_modules_are_short(repository: Path) -> None:
    lines = {name: len(file.read_text().splitlines()) for name, file in modules(repository).items()}
    assert not {name: n for name, n in lines.items() if n > LONGEST}


@pytest.mark.slow
def test_functions_take_few_parameters(repository: Path) -> None:
    found = {}
    for module, file in modules(repository).items():
        if module.startswith("heartgen.cli"):
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                a = node.args
                given = [p for p in [*a.posonlyargs, *a.args, *a.kwonlyargs] if p.arg != "self"]
                if len(given) > MOST_PARAMETERS:
                    found[f"{module}.{node.name}"] = [p.arg for p in given]
    assert not found


def test_the_picture_of_the_layers_shows_all_of_them(repository: Path) -> None:
    texts = re.findall(r"<text[^>]*>([^<]+)</text>", (repository / "docs/layers.svg").read_text())
    names = [name for row in layers() for name in row]
    assert set(names) <= set(texts)
    assert sum(text.endswith(" lines") for text in texts) == len(names), (
        "python -m benchmarks.layers"
    )
