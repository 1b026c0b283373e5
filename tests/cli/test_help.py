"""`heartgen --version` and `--help`."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest
from typer.main import get_command
from typer.testing import CliRunner

import heartgen
from heartgen.cli.operating import app
from heartgen.images.schemes import SCHEMES


def test_version_is_that_of_the_package(run):
    outcome = run("--version")
    assert outcome.exit_code == 0
    assert outcome.stdout == f"heartgen {heartgen.__version__}\n"


def test_every_scheme_of_labels_is_named(run):
    told = " ".join(run("inspect", "--help").stdout.replace("│", " ").split())
    for name in (*SCHEMES, "auto"):
        assert f"{name}," in told


@pytest.mark.slow
def test_help_names_the_commands_and_loads_nothing_heavy():
    code = (
        "import atexit, json, sys\n"
        "from heartgen.cli import main\n"
        "atexit.register(lambda: print(json.dumps(sorted(sys.modules)), file=sys.stderr))\n"
        "main()\n"
    )
    answer = subprocess.run(
        [sys.executable, "-c", code, "--help"], capture_output=True, text=True, check=True
    )
    for command in ("fit", "inspect", "demo", "convert", "compare"):
        assert command in answer.stdout
    loaded = {name.partition(".")[0] for name in json.loads(answer.stderr)}
    assert not loaded & {"SimpleITK", "matplotlib", "numba", "numpy", "pyvista", "scipy", "skimage"}


def commands(group, *names):
    """Words of every command, also of those under another."""
    for name, command in group.commands.items():
        yield (*names, name)
        if hasattr(command, "commands"):
            yield from commands(command, *names, name)


@pytest.mark.parametrize("width", [80, 100])
@pytest.mark.parametrize("words", list(commands(get_command(app))), ids=" ".join)
def test_help_cuts_nothing_off_and_shows_no_type_of_a_flag(words, width):
    told = CliRunner().invoke(app, [*words, "--help"], env={"COLUMNS": str(width)}).stdout
    assert max(map(len, told.splitlines())) <= width
    assert "--help" in told
    assert "…" not in told
    assert "bool" not in told
