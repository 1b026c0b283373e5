"""Has jobs done by a Dask cluster, whatever becomes of it, of the database or of other servers."""

from __future__ import annotations

import errno
import logging
import os
import time
import uuid
from contextlib import suppress
from threading import Event, Lock, Thread
from typing import Any

from distributed import Client, Future
from distributed.scheduler import KilledWorker
from sqlalchemy.exc import SQLAlchemyError

from heartgen.cohort.case import Case
from heartgen.cohort.cluster import DEATH, connected
from heartgen.cohort.job import Job as Work
from heartgen.cohort.job import rows_of
from heartgen.cohort.rows import FAILED, Row
from heartgen.cohort.workers import Workers
from heartgen.errors import HeartgenError, sentence
from heartgen.images.selecting import Selection
from heartgen.options import chosen
from heartgen.service.artifacts import Artifacts
from heartgen.service.jobs import LEASE, Jobs
from heartgen.service.settings import MB, Settings
from heartgen.service.tables import Job, State
from heartgen.service.work import TOPIC, Order, work

logger = logging.getLogger("heartgen.service")

FORMATS = ("exf", "vtu")
"""Of each result; others are made when they are asked for."""

TICK = 0.1
"""Seconds between two looks."""

RENEWAL = LEASE / 5
"""Seconds between two words of ours that we are still there."""

AGAIN = 2.0
"""Seconds after which a scheduler that does not answer is asked again."""

MANY = 10**6
"""Jobs that are still to come."""

MINUTE = 60.0
"""Seconds."""

NO_ROOM = tuple(map(os.strerror, (errno.ENOSPC, errno.EDQUOT)))
"""What reasons say that are of the disk and not of the job."""

RESULT = 20 * MB
"""Bytes that a result takes at most, nearly always."""


class Dispatcher:
    """Takes jobs from the queue, has them done, and keeps how they end.

    Parameters
    ----------
    jobs : Jobs
        The queue.
    artifacts : Artifacts
        Where uploads are, and results come.
    settings : Settings
        Of the service.
    """

    def __init__(self, jobs: Jobs, artifacts: Artifacts, settings: Settings) -> None:
        self.jobs, self.artifacts, self.settings = jobs, artifacts, settings
        self.name = uuid.uuid4().hex
        self.ready = False
        self._ended, self._lock = Event(), Lock()
        self._futures: dict[str, tuple[Job, Future[Any]]] = {}
        self._told: dict[str, tuple[str, float]] = {}
        self._slots = 0
        self._renew_at = 0.0
        self._thread = Thread(target=self._run, daemon=True, name="dispatcher")

    def start(self) -> None:
        """Begin; with the jobs that ran when the server before us ended."""
        self.jobs.put_back_lost(self.settings.starts, everyone=True)
        self._thread.start()

    def stop(self) -> None:
        """End; what runs waits for the next server."""
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        """Be connected to a cluster, again and again."""
        workers = Workers(
            jobs=None if self.settings.scheduler else self.settings.workers,
            scheduler=self.settings.scheduler,
            time_limit=self.settings.time_limit,
        )
        while not self._ended.is_set():
            try:
                with connected(workers, MANY) as client:
                    client.subscribe_topic(TOPIC, self._hear)
                    self.ready = True
                    while not self._ended.is_set() and client.status in ("running", "connecting"):
                        self._look(client)
                        self._ended.wait(TICK)
            except (HeartgenError, OSError, RuntimeError) as error:
                logger.warning("no cluster: %s", sentence(error))
            finally:
                self.ready = False
                self._give_back()
            self._ended.wait(AGAIN)

    def _look(self, client: Client) -> None:
        """One round; a database that is gone is asked again in the next."""
        try:
            self._renew(client)
            self._keep_progress()
            for identifier, (job, future) in list(self._futures.items()):
                if future.status != "pending":
                    self._end(identifier, job, future)
            while len(self._futures) < self._slots and self._has_room():
                claimed = self.jobs.claim(self.name)
                if claimed is None:
                    break
                self._begin(client, claimed)
        except SQLAlchemyError as error:
            logger.warning("the database does not answer: %s", type(error).__name__)
            self._ended.wait(AGAIN)

    def _renew(self, client: Client) -> None:
        """Say that we are there; drop what was cancelled; take over what others left."""
        if time.monotonic() < self._renew_at:
            return
        self._renew_at = time.monotonic() + min(RENEWAL, 1.0)
        self._slots = sum(client.nthreads().values())
        mine = self.jobs.renew(self.name, list(self._futures))
        for identifier in set(self._futures) - mine:
            self._drop(identifier)
        self.jobs.put_back_lost(self.settings.starts)

    def _begin(self, client: Client, job: Job) -> None:
        """Have a job done, unless it is."""
        try:
            order = self._order(job)
        except (HeartgenError, TypeError, LookupError) as error:  # of another version, perhaps
            self.jobs.finish(job.id, State.FAILED, sentence(error), None)
            return
        rows = rows_of(order.job)
        if rows is not None:  # by a worker whose server was lost
            self._keep(job, rows)
            return
        logger.info("begun", extra={"job": job.id, "starts": job.starts})
        future = client.submit(work, order, key=("heartgen", job.id, uuid.uuid4().hex), pure=False)
        self._futures[job.id] = (job, future)

    def _order(self, job: Job) -> Order:
        """What a worker is to do."""
        selection = Selection(**{**job.selection, "label": tuple(job.selection["label"])})
        options = chosen(None, job.options)
        case = Case(job.fingerprint, self.artifacts.home / job.upload, selection=selection)
        work = Work(job.fingerprint, case, options, (options.lod,), self.artifacts.results, FORMATS)
        limit = MINUTE * self.settings.time_limit
        return Order(job.id, work, limit, self.artifacts.stop_mark(job.id, job.starts))

    def _end(self, identifier: str, job: Job, future: Future[Any]) -> None:
        """Keep how a job ended, or have it wait again."""
        if future.status == "finished":
            self._keep(job, future.result())
        elif future.status == "error":
            error = future.exception()
            reason = DEATH if isinstance(error, KilledWorker) else sentence(error)
            self.jobs.finish(identifier, State.FAILED, reason, None)
            logger.warning("failed: %s", reason, extra={"job": identifier})
        else:  # lost with the scheduler
            self.jobs.put_back(self.name, [identifier])
        del self._futures[identifier]

    def _keep(self, job: Job, rows: list[Row]) -> None:
        """Keep what a worker says; of a failure, nothing is left that would answer for it later."""
        status = str(rows[0]["status"])
        if not status.startswith(FAILED) and self.artifacts.is_done(job.fingerprint):
            summary = self.artifacts.summary(job.fingerprint)
            self.jobs.finish(job.id, State.DONE, None, summary)
            logger.info("done", extra={"job": job.id})
            return
        self.artifacts.forget(f"results/{job.fingerprint}")
        if any(words in status for words in NO_ROOM):
            self.jobs.put_back(self.name, [job.id])  # it waits until there is room
            logger.warning("the disk is full", extra={"job": job.id})
            return
        self.jobs.finish(job.id, State.FAILED, status.removeprefix(FAILED), None)
        logger.warning("failed: %s", status, extra={"job": job.id})

    def _has_room(self) -> bool:
        """Whether a result finds room on the disk."""
        try:
            self.artifacts.check_space(RESULT)
        except HeartgenError:
            return False
        return True

    def _drop(self, identifier: str) -> None:
        """End a job that is no longer ours to do."""
        job, future = self._futures.pop(identifier)
        with suppress(OSError):  # of a full disk: it is done in vain
            self.artifacts.stop_mark(identifier, job.starts).touch()
        future.cancel()

    def _give_back(self) -> None:
        """Have all jobs wait for whoever comes next."""
        taken, self._futures = list(self._futures), {}
        try:
            self.jobs.put_back(self.name, taken)
        except SQLAlchemyError:  # their lease will end
            logger.warning("%d jobs were left behind", len(taken))

    def _hear(self, event: Any) -> None:
        """Progress of a job, on the thread of the client."""
        message = event[1]
        with self._lock:
            self._told[message["job"]] = (message["step"], message["progress"])

    def _keep_progress(self) -> None:
        """Keep what was told since the last look."""
        with self._lock:
            told, self._told = self._told, {}
        for identifier, (step, progress) in told.items():
            if identifier in self._futures:
                self.jobs.tell(identifier, self.name, step, progress)
