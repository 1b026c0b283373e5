"""Failures on the way: the folder stays as it was."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import pytest

from heartgen import pipeline, result
from heartgen.errors import Cancelled

PATIENCE = 120
"""Seconds after which a process that should have ended is given up."""


@pytest.mark.slow
@pytest.mark.parametrize("debug", [False, True])
def test_error_in_heartgen_itself_asks_for_a_report(run, mask_file, tmp_path, monkeypatch, debug):
    def fail(*_, **__):
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(pipeline, "register", fail)
    outcome = run("fit", mask_file, "-o", tmp_path / "out", *(["--debug"] * debug))
    assert outcome.exit_code == 70
    assert "ZeroDivisionError: division by zero" in outcome.stderr
    assert "report" in outcome.stderr
    assert ("Traceback" in outcome.stderr) == debug
    assert not (tmp_path / "out").exists()
    assert "registration: stopped" in outcome.stderr
    assert "optimization" not in outcome.stderr  # which never began


@pytest.mark.slow
@pytest.mark.parametrize(
    ("failure", "code"), [(KeyboardInterrupt, 130), (Cancelled, 130), (OSError, 1), (KeyError, 70)]
)
def test_failure_between_two_files_leaves_the_folder_as_it_was(
    run, names, files, fitted, mask_file, tmp_path, monkeypatch, failure, code
):
    before = {name: (fitted[1] / name).read_bytes() for name in files}
    for name, content in before.items():
        (tmp_path / name).write_bytes(content[::-1])

    def fail(*_):
        raise failure

    monkeypatch.setattr(result, "write_text", fail)  # the report comes after the meshes
    outcome = run("fit", mask_file, "-o", tmp_path, "--overwrite")
    assert outcome.exit_code == code
    assert "Traceback" not in outcome.output
    assert names(tmp_path) == files
    assert all((tmp_path / name).read_bytes() == before[name][::-1] for name in files)


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there")
def test_interrupt_during_registration_writes_nothing(names, mask_file, tmp_path):
    """A process that registers again and again, so that the signal cannot come too late."""
    code = (
        "import sys\n"
        "from heartgen import pipeline\n"
        "from heartgen.cli import main\n"
        "register = pipeline.register\n"
        "def again(*arguments):\n"
        "    while True:\n"
        "        register(*arguments)\n"
        "        print('registering', flush=True)\n"
        "pipeline.register = again\n"
        "main()\n"
    )
    out = tmp_path / "out"
    with subprocess.Popen(
        [sys.executable, "-c", code, "fit", str(mask_file), "-o", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout.readline() == "registering\n"
        process.send_signal(signal.SIGINT)
        _, answer = process.communicate(timeout=PATIENCE)
    assert process.returncode == 130
    assert "cancelled, nothing written" in answer
    assert "Traceback" not in answer
    assert names(tmp_path) == []
