"""A service as it is deployed: server, Dask scheduler, workers, each a process to be killed."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx

from tests.service.helpers import free_port

STARTING = 240.0
"""Seconds; a busy machine needs them."""

REPOSITORY = Path(__file__).resolve().parents[2]


class Running:
    """The processes.

    Parameters
    ----------
    folder : Path
        Of the data, and of logs.
    light : float or None
        Seconds that a light fit takes; None for real ones.
    scheduler : bool
        Start a scheduler and workers of their own; otherwise the server has them.
    workers : int
        How many.
    **settings : object
        Variables ``HEARTGEN_...``.
    """

    def __init__(
        self,
        folder: Path,
        light: float | None = None,
        *,
        scheduler: bool = False,
        workers: int = 1,
        **settings: Any,
    ) -> None:
        self.folder, self.light, self.workers = folder, light, workers
        self.port, self.scheduler = free_port(), free_port() if scheduler else None
        self.url = f"http://127.0.0.1:{self.port}"
        told = {
            "data": folder / "data",
            "port": self.port,
            "free_space": 0,
            "rate_limit": 10**6,
            **settings,
        }
        if scheduler:
            told["scheduler"] = f"tcp://127.0.0.1:{self.scheduler}"
        else:
            told["workers"] = workers
        self.environment = os.environ | {
            f"HEARTGEN_{name.upper()}": str(value) for name, value in told.items()
        }
        paths = [str(REPOSITORY), os.environ.get("PYTHONPATH", "")]
        self.environment["PYTHONPATH"] = os.pathsep.join(filter(None, paths))
        self.apart: dict[str, list[str]] = {}  # command lines of what else is started
        self.processes: dict[str, subprocess.Popen[bytes]] = {}

    def command(self, name: str) -> list[str]:
        """The command line of a process."""
        if name in self.apart:
            return self.apart[name]
        address = f"tcp://127.0.0.1:{self.scheduler}"
        if name == "server":
            serve = "from heartgen.cli import main; main()"
            if self.light is None:
                return [sys.executable, "-c", serve, "serve"]
            return [sys.executable, "-m", "tests.service.light", str(self.light), "serve"]
        dask = [sys.executable, "-m", "distributed.cli.dask_" + name.partition("-")[0]]
        if name == "scheduler":
            return [*dask, "--port", str(self.scheduler), "--host", "127.0.0.1", "--no-dashboard"]
        return [*dask, address, "--nthreads", "1", "--no-dashboard", "--no-nanny"]

    def start(self, name: str) -> None:
        """Start a process, unless it runs."""
        running = self.processes.get(name)
        if running is not None and running.poll() is None:
            return
        with (self.folder / f"{name}.log").open("ab") as log:
            self.processes[name] = subprocess.Popen(
                self.command(name), cwd=self.folder, env=self.environment, stdout=log, stderr=log
            )

    def kill(self, name: str) -> None:
        """End a process as a power cut does."""
        self.processes[name].kill()
        self.processes[name].wait()

    @property
    def names(self) -> list[str]:
        """Of all processes."""
        apart = ["scheduler", *(f"worker-{n}" for n in range(self.workers))]
        return ["server", *(apart if self.scheduler else [])]

    def wait(self) -> None:
        """Wait until the server answers."""
        end = time.monotonic() + STARTING
        while time.monotonic() < end:
            self.start("server")
            try:
                httpx.get(f"{self.url}/healthz", timeout=30)
                return
            except httpx.HTTPError:
                time.sleep(0.2)
        raise AssertionError((self.folder / "server.log").read_text())

    def __enter__(self) -> Running:
        for name in reversed(self.names):
            self.start(name)
        try:
            self.wait()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        for process in self.processes.values():
            process.terminate()
        for process in self.processes.values():
            try:
                process.wait(30)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
