from __future__ import annotations

import subprocess
import sys

import pytest

pytest.importorskip("psutil")

pytestmark = pytest.mark.slow


def test_a_batch_that_is_killed_loses_nothing_and_does_nothing_twice(repository):
    """Twice here; ``python -m benchmarks.kills`` does it twenty times."""
    command = [sys.executable, "-m", "benchmarks.kills", "--kills", "2", "--cases", "3"]
    answer = subprocess.run(
        command, cwd=repository, capture_output=True, text=True, check=False, timeout=600
    )
    assert answer.returncode == 0, answer.stdout + answer.stderr
    assert "2 kills, " in answer.stdout
    assert ": 0 lost or done twice" in answer.stdout
