"""What tests of the service do again and again: submit, work, and start servers."""

from __future__ import annotations

import os
import pwd
import shutil
import socket
import subprocess
import tempfile
import uuid
from pathlib import Path
from typing import Any

from fastapi.testclient import TestClient

from heartgen.service.service import Service
from heartgen.service.tables import Job, State

HOME = "http://127.0.0.1:8000"
"""Where requests of tests go."""


def free_port() -> int:
    """A port that nobody listens on."""
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return int(listener.getsockname()[1])


class Postgres:
    """A PostgreSQL server of the tests' own."""

    def __init__(self) -> None:
        found = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
        self.bin = found[-1] if found else Path(shutil.which("initdb") or "").parent
        # The server refuses to run for root.
        self.user = "postgres" if os.getuid() == 0 else pwd.getpwuid(os.getuid()).pw_name
        # Not below pytest's folders: each pytest that starts closes them to other users.
        self.folder, self.port = Path(tempfile.mkdtemp(prefix="heartgen-pg-")), free_port()
        if os.getuid() == 0:
            shutil.chown(self.folder, self.user)
        self.run("initdb", "-D", self.data, "-A", "trust", "-U", "postgres", "--no-sync")

    @property
    def data(self) -> str:
        return str(self.folder / "data")

    def run(self, tool: str, *arguments: str) -> None:
        """Run a tool of PostgreSQL as its user."""
        user = {"user": self.user} if os.getuid() == 0 else {}
        subprocess.run(
            [str(self.bin / tool), *arguments],
            check=True,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=self.folder,
            **user,
        )

    def start(self) -> None:
        options = f"-p {self.port} -k {self.folder} -h 127.0.0.1 -c fsync=off"
        self.run("pg_ctl", "-D", self.data, "-w", "-o", options, "-l", f"{self.data}/log", "start")

    def stop(self) -> None:
        self.run("pg_ctl", "-D", self.data, "-w", "-m", "immediate", "stop")

    def remove(self) -> None:
        """Stop, and leave nothing."""
        self.stop()
        shutil.rmtree(self.folder)

    def fresh(self) -> str:
        """Address of an empty database."""
        import psycopg

        name = f"t{uuid.uuid4().hex}"
        where = f"host=127.0.0.1 port={self.port} user=postgres dbname=postgres"
        with psycopg.connect(where, autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        return f"postgresql://postgres@127.0.0.1:{self.port}/{name}"


def bearer(service: Service, *scopes: str) -> dict[str, str]:
    """Header with a new token."""
    token = service.tokens.create("test", scopes or ["jobs", "library", "publish"])
    return {"Authorization": f"Bearer {token}"}


def submit(client: TestClient, mask: Path, headers: Any = None, **data: Any) -> Any:
    """Answer to a submission."""
    files = {"mask": ("heart.nii.gz", mask.read_bytes())}
    data = {"options": '{"optimize": false}'} | data
    return client.post("/v1/jobs", files=files, data=data, headers=headers)


def finish(service: Service, result: Path, identifier: str) -> Job:
    """Do as if a worker had done a job."""
    claimed = service.jobs.claim("test")
    assert claimed is not None
    assert claimed.id == identifier
    shutil.copytree(result, service.artifacts.result(claimed.fingerprint))
    summary = service.artifacts.summary(claimed.fingerprint)
    assert service.jobs.finish(identifier, State.DONE, None, summary)
    job = service.jobs.get(identifier)
    assert job is not None
    return job
