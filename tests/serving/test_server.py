"""`heartgen dashboard` shows the page, and refuses everything else of Jupyter's server."""

from __future__ import annotations

import contextlib
import json
import signal
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request

import psutil
import pytest

pytest.importorskip("voila")

from heartgen.serving.server import INDEX, Address, arguments, notebooks, served_folder

PORT = 18_913
USUAL_PORT = 8888
"""Jupyter's."""
WORD = "open-sesame"


@pytest.fixture(scope="module")
def server():
    """The dashboard on a port of its own."""
    command = [sys.executable, "-c", "from heartgen.cli import main; main()", "dashboard"]
    command += ["--no-browser", "--port", str(PORT), "--token", WORD]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    end = time.monotonic() + 60
    while ask("api", timeout=2) is None:
        assert process.poll() is None, "the server ended"
        assert time.monotonic() < end, "the server does not answer"
        time.sleep(0.2)
    yield process
    process.send_signal(signal.SIGTERM)
    process.wait(30)


def ask(path, word=WORD, method="GET", timeout=20):
    """Status of an answer, or None if there is none."""
    data = None if method == "GET" else json.dumps({}).encode()
    request = urllib.request.Request(f"http://127.0.0.1:{PORT}/{path}", data, method=method)
    if word:
        request.add_header("Authorization", f"token {word}")
    try:
        with urllib.request.urlopen(request, timeout=timeout) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code
    except OSError:
        return None


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "method"),
    [
        ("api/contents", "GET"),
        ("api/contents/new.ipynb", "PUT"),
        ("api/kernels", "GET"),
        ("api/kernels", "POST"),
        ("api/sessions", "GET"),
        ("files/dashboard.ipynb", "GET"),
        ("nbconvert/html/dashboard.ipynb", "GET"),
        ("proxy/22/", "GET"),
        ("proxy/absolute/22/", "GET"),
        (f"proxy/{PORT}/api", "GET"),
        ("proxy/example.org:80/", "GET"),
    ],
)
def test_visitors_get_at_nothing_but_the_page(server, path, method):
    assert ask(path, method=method) in (403, 404)


def test_without_the_word_there_is_no_page(server):
    request = urllib.request.Request(f"http://127.0.0.1:{PORT}/voila/render/dashboard.ipynb")
    with urllib.request.urlopen(request, timeout=20) as answer:
        assert "/login" in answer.url


def test_page_may_load_nothing_from_elsewhere(server):
    request = urllib.request.Request(f"http://127.0.0.1:{PORT}/login")
    with urllib.request.urlopen(request, timeout=20) as answer:
        policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'self'" in policy
    assert "http" not in policy


def options(place, tmp_path):
    return dict(a.removeprefix("--").split("=", 1) for a in arguments(place, tmp_path) if "=" in a)


def test_a_word_is_asked_for_where_others_reach_the_page(tmp_path):
    assert options(Address(), tmp_path)["IdentityProvider.token"] == ""
    words = [options(Address("0.0.0.0"), tmp_path)["IdentityProvider.token"] for _ in range(2)]
    assert all(len(word) >= 24 for word in words)
    assert words[0] != words[1]


def test_browsers_run_no_code(tmp_path):
    allowed = options(Address(), tmp_path)["MappingKernelManager.allowed_message_types"]
    assert "comm_msg" in allowed
    assert "execute_request" not in allowed


def test_only_the_notebook_is_served_and_it_goes_away():
    with served_folder() as folder:
        assert [path.name for path in (folder / "served").iterdir()] == ["dashboard.ipynb"]
    assert not folder.exists()


def test_all_apps_are_served_with_the_index():
    with served_folder(INDEX) as folder:
        served = {path.name for path in (folder / "served").iterdir()}
    assert served == {path.name for path in notebooks().glob("*.ipynb")}
    assert {"index.ipynb", "dashboard.ipynb", "tradeoff.ipynb", "states.ipynb"} == served


def test_no_process_of_the_server_takes_all_memory(server):
    resource = pytest.importorskip("resource")
    if not hasattr(resource, "prlimit"):
        pytest.skip("limits of another process are seen on Linux alone")
    soft, _ = resource.prlimit(server.pid, resource.RLIMIT_DATA)
    assert 0 < soft < psutil.virtual_memory().total


@pytest.mark.slow
def test_address_that_is_printed_is_the_one_that_answers():
    """Also where the usual port is taken."""
    with socket.socket() as taken:
        with contextlib.suppress(OSError):  # taken already
            taken.bind(("127.0.0.1", USUAL_PORT))
            taken.listen()
        command = [sys.executable, "-c", "from heartgen.cli import main; main()", "dashboard"]
        process = subprocess.Popen(
            [*command, "--no-browser"], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        try:
            told = next(line for line in process.stderr if line.startswith("heartgen dashboard: "))
            address = told.split()[2]
            assert f":{USUAL_PORT}/" not in address
            with urllib.request.urlopen(f"{address}api", timeout=60) as answer:
                assert "version" in json.load(answer)
        finally:
            process.send_signal(signal.SIGTERM)
            process.communicate(timeout=60)
