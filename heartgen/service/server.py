"""`heartgen serve`: the service on one port, until it is told to end."""

from __future__ import annotations

import logging
import sys
import tempfile

import uvicorn
from filelock import FileLock, Timeout

from heartgen.errors import HeartgenError, InputError
from heartgen.service.app import make_app
from heartgen.service.artifacts import Artifacts
from heartgen.service.operating import log_as_json
from heartgen.service.settings import Settings

PATIENCE = 10
"""Seconds that requests have to end when the service does."""

LOCK = "service.lock"
"""File of the data folder that says that a server uses it."""


def serve(settings: Settings) -> None:
    """Serve until interrupted.

    Parameters
    ----------
    settings : Settings
        Of the operator.

    Raises
    ------
    HeartgenError
        If the data folder is taken, or the database does not answer.
    """
    if settings.anonymous and not settings.is_local:
        raise InputError(
            "others can reach this address, so that requests need tokens: leave --anonymous out"
        )
    log_as_json()
    artifacts = Artifacts(settings.data, settings.free_space)
    lock = FileLock(artifacts.home / LOCK)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise HeartgenError(
            f"{settings.data}: another service uses this folder: end it, or choose another folder"
        ) from None
    with lock:
        artifacts.clean()
        # What is uploaded is spooled on the disk of the data, not in a /tmp that is small.
        tempfile.tempdir = str(artifacts.home / "incoming")
        app = make_app(settings)
        print(f"heartgen serve: {settings.url}   (Ctrl-C ends it)", file=sys.stderr)
        uvicorn.run(
            app,
            host=settings.host,
            port=settings.port,
            access_log=False,
            log_level=logging.WARNING,
            timeout_graceful_shutdown=PATIENCE,
            proxy_headers=settings.public_url is not None,
            server_header=False,
        )
