"""A session that is written down as it goes, and brought back from what is written."""

from __future__ import annotations

import os
import shutil
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from heartgen.errors import Cancelled
from heartgen.options import OPTIONS
from heartgen.widgets.input_case import InputCase, with_paths
from heartgen.widgets.keeping.fits import Arrived, Fitter
from heartgen.widgets.keeping.jobs import Job
from heartgen.widgets.keeping.past import OTHERS, Past, PastReader, job_of, measured_name
from heartgen.widgets.keeping.store import Store

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.options import Options
    from heartgen.result import Personalization
    from heartgen.widgets.runs import Make, Progress, Run
    from heartgen.widgets.session import Session

WRITTEN = (
    "case",
    "origin",
    "awaited",
    "hearts",
    "queue",
    "runs",
    "outcomes",
    "shown",
    "taken",
    "states",
)
"""Attributes of a session at whose changes it is written down."""


class Keeping:
    """Writes a session down, has its runs fitted apart, and brings it back.

    Parameters
    ----------
    store : Store
        Folder of the session.
    """

    def __init__(self, store: Store) -> None:
        self.store = store
        self.fitter, self.others = Fitter(), Fitter(background=True)
        self._numbers: dict[InputCase, int] = {}
        self._reader = PastReader(store, self.fit)
        self._session: Session | None = None
        self._lock = threading.Lock()
        self._written = self._silent = False

    def watch(self, session: Session) -> None:
        """Write the session down at every change.

        Parameters
        ----------
        session : Session
            The visitor's work.
        """
        self._session = session
        session.observe(self._write, list(WRITTEN))
        session.choices.observe(self._write)

    def close(self) -> None:
        """Leave the session."""
        self._session = None
        self.fitter.close()
        self.others.close()
        self.store.close()

    def keep_case(self, case: InputCase) -> None:
        """Write an input down.

        Parameters
        ----------
        case : InputCase
            That was read.
        """
        about = {
            "code": case.code,
            "sha256": case.sha256,
            "description": case.description,
            "origin": self._told_origin(case.origin),
        }
        with self._lock:
            if case not in self._numbers:
                self._numbers[case] = self.store.keep_case(case.mask, about, case.views)

    def keep_anatomy(self, case: InputCase, options: Options, anatomy: Anatomy) -> None:
        """Write down what was measured in an input.

        Parameters
        ----------
        case : InputCase
            That was written down.
        options : Options
            Under which it was measured.
        anatomy : Anatomy
            What was measured.
        """
        self.keep_case(case)
        name = measured_name(options)
        self.store.keep_anatomy(self._numbers[case], name, case.mask, anatomy)

    def fit(
        self, run: Run, anatomy: Anatomy | None, progress: Progress
    ) -> Sequence[Personalization]:
        """Fit the meshes of a run in a process of its own, or wait for one that is at it.

        Parameters
        ----------
        run : Run
            With input, options and levels.
        anatomy : Anatomy or None
            The input's, if it is measured already; otherwise None.
        progress : callable
            Told how far it is.
        """
        self._check_mine()
        job = job_of(self.store, run)
        run.anatomy = self._write_job(job, run, run.levels, anatomy)
        known = (run.case.mask, run.anatomy)
        return self.fitter.results(job, known, progress, lambda: self.store.mine)

    def fit_others(
        self, run: Run, levels: tuple[int, ...], progress: Progress, arrived: Arrived
    ) -> None:
        """Fit other levels of a run when the machine has nothing else to do.

        Parameters
        ----------
        run : Run
            That is done.
        levels : tuple of int
            Levels of detail, of which those are fitted that are not there.
        progress : callable
            Told how far it is.
        arrived : callable
            Called with each result as soon as it is there.
        """
        self._check_mine()
        job = job_of(self.store, run, OTHERS)
        known = (run.case.mask, self._write_job(job, run, levels, run.anatomy))
        self.others.results(job, known, progress, lambda: self.store.mine, arrived)

    def kept(self, make: Make) -> Make:
        """Another way to make results, whose results are written down.

        Parameters
        ----------
        make : callable
            As of `Run`.
        """

        def made(run: Run, anatomy: Anatomy | None, progress: Progress) -> Sequence[Any]:
            results = make(run, anatomy, progress)
            self.keep_results(run, results)
            return results

        return made

    def keep_results(self, run: Run, results: Sequence[Personalization]) -> None:
        """Write down results that came from elsewhere.

        Parameters
        ----------
        run : Run
            Whose they are.
        results : sequence of Personalization
            One for each level.
        """
        self.keep_case(run.case)
        job = job_of(self.store, run)
        job.write(self.store.mask_file(self._numbers[run.case]), None, run.options, run.levels)
        for result in results:
            job.keep(result, (run.case.mask, None))
        job.end()

    def forget(self, run: Run) -> None:
        """Remove what is written of a run.

        Parameters
        ----------
        run : Run
            That is deleted.
        """
        for job in (job_of(self.store, run), job_of(self.store, run, OTHERS)):
            shutil.rmtree(job.folder, ignore_errors=True)

    def past(self, store: Store) -> Past:
        """What a session was when it was left; from now on it is this one's.

        Parameters
        ----------
        store : Store
            Folder of the session.
        """
        store.claim()
        return PastReader(store, self.fit).read()

    def move(self, store: Store, past: Past) -> None:
        """Go on in another folder; the one before goes if nothing was done in it.

        Parameters
        ----------
        store : Store
            Folder of the session.
        past : Past
            What is in it.
        """
        before, self.store = self.store, store
        self._reader = PastReader(store, self.fit)
        self._numbers = dict(past.numbers)
        self._written = True
        if before.read() is None or not before.lasting:
            before.remove()

    @contextmanager
    def silent(self) -> Iterator[None]:
        """Write the session down after all changes, if they could be made: half of it is none."""
        self._silent = True
        yield
        self._silent = False
        self._write(None)

    def _write_job(
        self, job: Job, run: Run, levels: tuple[int, ...], anatomy: Anatomy | None
    ) -> Anatomy | None:
        """Write the job, unless it is there; the anatomy that it begins with."""
        self.keep_case(run.case)
        number, name = self._numbers[run.case], measured_name(run.options)
        mask, file = self.store.mask_file(number), self.store.anatomy_file(number, name)
        if not job.is_of(mask, run.options):  # as one of whoever had the session before may be
            shutil.rmtree(job.folder, ignore_errors=True)
            if anatomy is not None:
                self.keep_anatomy(run.case, run.options, anatomy)
            job.write(mask, file if file.is_file() else None, run.options, levels)
            self._reuse(job, run, levels)
        else:
            job.widen(levels)
        if job.told["anatomy"] is None:
            return None
        return anatomy or self._reader.input(number, name, run.case.mask)[1]

    def _check_mine(self) -> None:
        """Begin nothing in a session that goes on elsewhere."""
        if not self.store.mine:
            raise Cancelled("the session goes on elsewhere")

    def _reuse(self, job: Job, run: Run, levels: tuple[int, ...]) -> None:
        """Take over meshes of earlier runs that were fitted to the same under the same options."""
        session = self._session
        for level in levels:
            outcome = session.fitted(level, run.options, run.case) if session else None
            if outcome is None or outcome.source is None:
                continue
            for part in ("", OTHERS):
                other = job_of(self.store, outcome.source, part)
                if other.kept((level,)) and other.begins_as(job):
                    job.take_over(other, level)
        if job.kept(levels) == levels:
            job.end()

    def _told_origin(self, origin: Mapping[str, str]) -> dict[str, str]:
        """Where an input comes from, as it is written: its file as seen from the session."""
        return with_paths(origin, lambda path: os.path.relpath(path, self.store.folder))

    def _write(self, _: Any) -> None:
        """Write down how the session stands."""
        session = self._session
        if session is None or self._silent:
            return
        shown = session.shown
        runs = [run for run in session.runs if run.case in self._numbers]
        if not (session.case or session.origin or session.queue or runs or self._written):
            return  # nothing was done yet: nobody is to come back to that
        state = {
            "case": self._numbers.get(session.case) if session.case else None,
            "origin": self._told_origin(session.origin),
            "awaited": session.awaited and not session.complaint,
            "hearts": [self._told_origin(origin) for origin in session.hearts],
            "queue": [
                {"origin": self._told_origin(each.origin), "options": asdict(each.options)}
                for each in session.queue
            ],
            "choices": {name: getattr(session.choices, name) for name in OPTIONS},
            "runs": [self._told(run) for run in runs],
            "shown": None if shown is None else [shown.run, shown.lod],
            "taken": session.taken,
        }
        try:
            self.store.write(state)
        except OSError as error:
            session.unkept = (
                f"what you do now is not kept on the server ({error.strerror or error}): save the "
                "session, or download what you need"
            )
        else:
            self._written, session.unkept = True, ""

    def _told(self, run: Run) -> dict[str, Any]:
        """A run in plain values."""
        return {
            "number": run.number,
            "name": run.name,
            "case": self._numbers[run.case],
            "options": asdict(run.options),
            "levels": run.levels,
            "phase": run.phase,
            "seconds": run.seconds,
            "error": run.error,
            "reused": run.reused,
            "here": run.make == self.fit,
        }
