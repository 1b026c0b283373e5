"""Jobs and their states; every transition is one statement that only applies to the state before.

queued → running → done, failed or cancelled; queued → cancelled, or done where the answer is in the
store; running → queued where a server, a worker or the scheduler was lost.
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from typing import Any

from sqlalchemy import func, literal, or_, select, update
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session, aliased

from heartgen.errors import InputError
from heartgen.service.database import Database
from heartgen.service.tables import Job, Mail, State

LEASE = 15.0
"""Seconds after which the jobs of a server that says nothing are others' to do."""

STEPS_LENGTH = 40
"""Letters of the name of a step that are kept."""

INTERRUPTED = (
    "it was interrupted {} times, by a server, a worker or a scheduler that was lost, and is not "
    "tried again: look at the logs of the service, and submit it again"
)
"""Why a job is given up that never came to an end."""


class Jobs:
    """The jobs in a database.

    Parameters
    ----------
    database : Database
        Where they are.
    """

    def __init__(self, database: Database) -> None:
        self.database = database

    def submit(self, job: Job) -> tuple[Job, bool]:
        """Take in a job, or find the one that was submitted under the same key before.

        Parameters
        ----------
        job : Job
            Not in the database yet.

        Returns
        -------
        job : Job
        new : bool
            Whether it is the one that was given.

        Raises
        ------
        InputError
            If the key was used for something else.
        """
        earlier = self._with_key(job)
        if earlier is None:
            try:
                with self.database.writing() as session:
                    self._answer_at_once(session, job)
                    session.add(job)
                    session.flush()
                    if State(job.state).ended:
                        _write_to(session, job)
                return job, True
            except IntegrityError:  # submitted twice at the same moment
                earlier = self._with_key(job)
                if earlier is None:
                    raise
        if earlier.fingerprint != job.fingerprint:
            raise InputError(
                "this idempotency key was used for another mask or other options: give another key"
            )
        return earlier, False

    def get(self, identifier: str, owner: str | None = None) -> Job | None:
        """A job, if it is there and the owner's.

        Parameters
        ----------
        identifier : str
            Of the job.
        owner : str or None
            None for any.
        """
        with self.database.reading() as session:
            job = session.get(Job, identifier)
        return job if job is not None and owner in (None, job.owner) else None

    def of_owner(self, owner: str, state: str | None, limit: int, offset: int) -> Sequence[Job]:
        """Jobs of an owner, newest first.

        Parameters
        ----------
        owner : str
            Whose.
        state : str or None
            Those in that state alone.
        limit, offset : int
            How many, and after how many.
        """
        wanted = select(Job).where(Job.owner == owner)
        if state is not None:
            wanted = wanted.where(Job.state == state)
        with self.database.reading() as session:
            return session.scalars(
                wanted.order_by(Job.created.desc(), Job.id).limit(limit).offset(offset)
            ).all()

    def place(self, job: Job) -> int | None:
        """Place in the queue, from 1; None of a job that does not wait.

        Parameters
        ----------
        job : Job
            Any.
        """
        if job.state != State.QUEUED:
            return None
        before = select(func.count()).where(Job.state == State.QUEUED, Job.created < job.created)
        with self.database.reading() as session:
            return (session.scalar(before) or 0) + 1

    def waiting(self, owner: str) -> int:
        """How many jobs of an owner wait.

        Parameters
        ----------
        owner : str
            Whose.
        """
        asked = select(func.count()).where(Job.state == State.QUEUED, Job.owner == owner)
        with self.database.reading() as session:
            return session.scalar(asked) or 0

    def counts(self) -> dict[str, int]:
        """How many jobs are in each state."""
        asked = select(Job.state, func.count()).group_by(Job.state)
        with self.database.reading() as session:
            found = {state: number for state, number in session.execute(asked)}
        return {state: found.get(state, 0) for state in State}

    def claim(self, server: str) -> Job | None:
        """Take the job that waits longest and is not being done for somebody else; None if none is.

        Parameters
        ----------
        server : str
            Who takes it.
        """
        running, now = aliased(Job), time.time()
        same = select(running.id).where(
            running.state == State.RUNNING, running.fingerprint == Job.fingerprint
        )
        first = select(Job).where(Job.state == State.QUEUED, ~same.exists())
        with self.database.writing() as session:
            job = session.scalar(
                first.order_by(Job.created, Job.id).limit(1).with_for_update(skip_locked=True)
            )
            if job is None:
                return None
            job.state, job.server, job.lease = State.RUNNING, server, now + LEASE
            job.started, job.starts, job.progress, job.step = now, job.starts + 1, 0.0, None
        return job

    def tell(self, identifier: str, server: str, step: str, progress: float) -> None:
        """Keep how far a job is.

        Parameters
        ----------
        identifier : str
            Of the job.
        server : str
            That has it done.
        step : str
            That runs.
        progress : float
            Share of the step that is done.
        """
        with self.database.writing() as session:
            session.execute(
                update(Job)
                .where(Job.id == identifier, Job.state == State.RUNNING, Job.server == server)
                .values(step=step[:STEPS_LENGTH], progress=progress)
            )

    def finish(
        self, identifier: str, state: State, reason: str | None, summary: dict[str, Any] | None
    ) -> bool:
        """End a job that runs; and those that wait for the same, if it was done.

        Parameters
        ----------
        identifier : str
            Of the job.
        state : State
            The end.
        reason : str or None
            A sentence.
        summary : dict or None
            What came out.

        Returns
        -------
        bool
            Whether it was running.
        """
        end = {"state": state, "reason": reason, "summary": summary, "finished": time.time()}
        with self.database.writing() as session:
            job = session.scalar(
                select(Job)
                .where(Job.id == identifier, Job.state == State.RUNNING)
                .with_for_update()
            )
            if job is None:
                return False
            twins = select(Job).where(Job.state == State.QUEUED, Job.fingerprint == job.fingerprint)
            all_ended = [job]
            if state is State.DONE:
                all_ended += session.scalars(twins.with_for_update()).all()
            for each in all_ended:
                for name, value in end.items():
                    setattr(each, name, value)
                each.progress, each.step, each.lease = float(state is State.DONE), None, None
                _write_to(session, each)
        return True

    def cancel(self, identifier: str) -> bool:
        """End a job that waits or runs; whether it did.

        Parameters
        ----------
        identifier : str
            Of the job.
        """
        with self.database.writing() as session:
            changed: Any = session.execute(
                update(Job)
                .where(Job.id == identifier, Job.state.in_((State.QUEUED, State.RUNNING)))
                .values(state=State.CANCELLED, reason="it was cancelled", finished=time.time())
            )
        return bool(changed.rowcount)

    def renew(self, server: str, identifiers: Iterable[str]) -> set[str]:
        """Go on with jobs; which of them are still this server's to do.

        Parameters
        ----------
        server : str
            Who does them.
        identifiers : iterable of str
            Of jobs.
        """
        mine = (Job.id.in_(identifiers), Job.state == State.RUNNING, Job.server == server)
        with self.database.writing() as session:
            session.execute(update(Job).where(*mine).values(lease=time.time() + LEASE))
            return set(session.scalars(select(Job.id).where(*mine)))

    def put_back(self, server: str, identifiers: Iterable[str]) -> None:
        """Have jobs wait again that a server cannot go on with.

        Parameters
        ----------
        server : str
            That had them.
        identifiers : iterable of str
            Of jobs.
        """
        with self.database.writing() as session:
            session.execute(
                update(Job)
                .where(Job.id.in_(identifiers), Job.state == State.RUNNING, Job.server == server)
                .values(state=State.QUEUED, server=None, lease=None, step=None, progress=0.0)
            )

    def put_back_lost(self, most: int, everyone: bool = False) -> int:
        """Have jobs wait again whose server is lost; end those that were begun too often.

        Parameters
        ----------
        most : int
            Times that a job may be begun.
        everyone : bool
            No server is left: none of them needs to be waited for.

        Returns
        -------
        int
            How many.
        """
        silent = or_(literal(everyone), Job.lease < time.time(), Job.lease.is_(None))
        with self.database.writing() as session:
            lost = session.scalars(
                select(Job)
                .where(Job.state == State.RUNNING, silent)
                .with_for_update(skip_locked=True)
            ).all()
            for job in lost:
                job.server, job.lease, job.step, job.progress = None, None, None, 0.0
                if job.starts < most:
                    job.state = State.QUEUED
                    continue
                job.state, job.finished = State.FAILED, time.time()
                job.reason = INTERRUPTED.format(job.starts)
                _write_to(session, job)
        return len(lost)

    def _with_key(self, job: Job) -> Job | None:
        """The job that its owner submitted under the same key before."""
        if job.idempotency_key is None:
            return None
        same = (Job.owner == job.owner, Job.idempotency_key == job.idempotency_key)
        with self.database.reading() as session:
            return session.scalar(select(Job).where(*same))

    def _answer_at_once(self, session: Session, job: Job) -> None:
        """End a job before it is begun if the same was done before."""
        done = (Job.fingerprint == job.fingerprint, Job.state == State.DONE)
        twin = session.scalar(select(Job).where(*done).limit(1))
        if twin is not None:
            job.state, job.summary, job.progress = State.DONE, twin.summary, 1.0
            job.started = job.finished = time.time()


def _write_to(session: Session, job: Job) -> None:
    """Have a mail sent about a job that has ended, if one is wanted."""
    if job.email:
        session.add(Mail(job=job.id))
