"""What is not published is kept for a while, and then removed: job, upload, result, renditions."""

from __future__ import annotations

import logging
import time
from pathlib import PurePosixPath
from threading import Event, Thread

from sqlalchemy import delete, select
from sqlalchemy.exc import SQLAlchemyError

from heartgen.errors import HeartgenError
from heartgen.service.service import Service
from heartgen.service.tables import Audit, Job, State

logger = logging.getLogger("heartgen.service")

DAY = 24 * 3600.0
"""Seconds."""

INTERVAL = 3600.0
"""Seconds between two looks."""

AT_ONCE = 500
"""Jobs that are removed in one go."""

ENDS = tuple(state for state in State if state.ended)


def remove_old(service: Service, now: float | None = None) -> int:
    """Remove jobs that ended long ago, and files that no job needs any more.

    Parameters
    ----------
    service : Service
        The parts of the service.
    now : float or None
        Seconds since 1970.

    Returns
    -------
    int
        How many jobs.
    """
    now = time.time() if now is None else now
    before = now - service.settings.retention * DAY
    service.artifacts.sweep(now - DAY)
    old = select(Job).where(Job.state.in_(ENDS), Job.finished < before).limit(AT_ONCE)
    removed = 0
    while True:
        with service.database.writing() as session:
            jobs = session.scalars(old).all()
            session.execute(delete(Job).where(Job.id.in_([job.id for job in jobs])))
            for job in jobs:
                detail = {"owner": job.owner}
                session.add(
                    Audit(actor="retention", action="remove", subject=job.id, detail=detail)
                )
            results, uploads = {j.fingerprint for j in jobs}, {j.upload for j in jobs}
            kept = set(
                session.scalars(select(Job.fingerprint).where(Job.fingerprint.in_(results)))
            ) | set(session.scalars(select(Job.upload).where(Job.upload.in_(uploads))))
        for fingerprint in results - kept:
            service.artifacts.forget(f"results/{fingerprint}")
            service.artifacts.forget(f"renditions/results-{fingerprint}")
        for upload in uploads - kept:
            service.artifacts.forget(str(PurePosixPath(upload).parent))
        removed += len(jobs)
        if len(jobs) < AT_ONCE:
            return removed


class Retention:
    """Removes what is old, from time to time.

    Parameters
    ----------
    service : Service
        The parts of the service.
    """

    def __init__(self, service: Service) -> None:
        self.service = service
        self._ended = Event()
        self._thread = Thread(target=self._run, daemon=True, name="retention")

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def stop(self) -> None:
        """End."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        while not self._ended.is_set():
            try:
                removed = remove_old(self.service)
                if removed:
                    logger.info("%d old jobs removed", removed)
            except (SQLAlchemyError, HeartgenError, OSError) as error:
                logger.warning("old jobs stay for now: %s", type(error).__name__)
            self._ended.wait(INTERVAL)
