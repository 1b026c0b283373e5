"""One piece of work: a case, fitted at some levels of detail; the unit that is done or not done."""

from __future__ import annotations

import hashlib
import json
import shutil
import uuid
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from heartgen import pipeline
from heartgen.clock import Progress
from heartgen.cohort.case import Case
from heartgen.cohort.rows import Row, failed_row, row_of
from heartgen.cohort.threads import one_thread
from heartgen.errors import FileError, HeartgenError, sentence
from heartgen.formats import write_text
from heartgen.images.sources import seen_from
from heartgen.options import Options
from heartgen.renamed import former_options, new_row
from heartgen.report import REPORT

if TYPE_CHECKING:
    from heartgen.result import Personalization

ROWS = "rows.json"
"""File of a job's folder that says what was done, and what came out."""

TAKEN = (
    "there is a folder of that name without the results of this case: give the case another name, "
    "move the folder away, or choose another one for the results"
)
"""Why a job is not begun."""

STAGE = ".stage"
"""Folder in which folders of results grow until they are whole."""


class NoPlaceError(FileError):
    """The folder of a job cannot be written: neither can the reason."""


@dataclass(frozen=True)
class Job:
    """A case to be fitted.

    Attributes
    ----------
    name : str
        Of its folder, below that of all jobs; unlike that of any other job.
    case : Case
        The input.
    options : Options
        All but the level of detail.
    levels : tuple of int
        Levels of detail.
    folder : Path or None
        Of all jobs; None if nothing is to be written.
    formats : tuple of str
        Of the meshes that are written, for a job of one level.
    """

    name: str
    case: Case
    options: Options
    levels: tuple[int, ...]
    folder: Path | None = None
    formats: tuple[str, ...] = ()

    @property
    def home(self) -> Path | None:
        """Where its results are, once they are whole."""
        return None if self.folder is None else self.folder / self.name

    def key(self, *, former: bool = False) -> str:
        """The same text for the same work; that of former versions, if `former`.

        Parameters
        ----------
        former : bool
            Whether to name options as former versions did.
        """
        options = {k: v for k, v in asdict(self.options).items() if k != "lod"}
        if former:
            options = former_options(options)
        parts = [self.case.stamp(), options, list(self.levels), list(self.formats)]
        return hashlib.sha256(json.dumps(parts).encode()).hexdigest()


def do(job: Job, progress: Progress = lambda step, done: None) -> list[Row]:
    """Do a job, unless somebody has; whatever goes wrong becomes the reason in its rows.

    Parameters
    ----------
    job : Job
        What to do.
    progress : callable
        Called with the name of the running step and the share of it that is done.

    Returns
    -------
    list of dict
        A row for each level.
    """
    if (done := rows_of(job)) is not None:
        return done
    if _is_taken(job):
        return failed_rows(job, f"{job.home}: {TAKEN}")
    digest = ""
    try:
        with one_thread():
            digest = job.case.digest()
            results = pipeline.personalize_levels(
                job.case.read(job.options.ventricles), job.levels, job.options, progress=progress
            )
            rows = [row_of(job.case, digest, result.report) for result in results]
            return _keep(job, rows, results)
    except NoPlaceError as error:
        return failed_rows(job, str(error), digest)
    except (Exception, SystemExit) as error:  # of one case; the others go on
        return give_up(job, sentence(error), digest)


def give_up(job: Job, reason: str, digest: str = "") -> list[Row]:
    """Leave the reason why there is no mesh.

    Parameters
    ----------
    job : Job
        That failed.
    reason : str
        A sentence.
    digest : str
        SHA-256 of what was read; empty if nothing was.
    """
    rows = failed_rows(job, reason, digest)
    with suppress(
        HeartgenError, OSError
    ):  # a folder that cannot be written: the rows are told all the same
        return _keep(job, rows, ())
    return rows


def failed_rows(job: Job, reason: str, digest: str = "") -> list[Row]:
    """A row for each level that was not fitted.

    Parameters
    ----------
    job : Job
        That failed.
    reason : str
        A sentence.
    digest : str
        SHA-256 of what was read; empty if nothing was.
    """
    each = [replace(job.options, lod=lod) for lod in job.levels]
    return [failed_row(job.case, digest, options, reason) for options in each]


def rows_of(job: Job) -> list[Row] | None:
    """Rows of a job that is done, whatever it was asked to do; None of one that is not.

    Parameters
    ----------
    job : Job
        That may be done.
    """
    found = _record(job)
    return None if found is None else [new_row(row) for row in found["rows"]]


def is_as_asked(job: Job) -> bool:
    """Whether a job that is done was asked for the same as now.

    Parameters
    ----------
    job : Job
        As it is asked for now.
    """
    found = _record(job)
    return found is not None and found["key"] in (job.key(), job.key(former=True))


def _is_taken(job: Job) -> bool:
    """Whether something else is where the folder of a job would be."""
    return job.home is not None and job.home.exists() and _record(job) is None


def _record(job: Job) -> Row | None:
    """What the folder of a job says of it."""
    if job.home is None or not (job.home / ROWS).is_file():
        return None
    try:
        record: Row = json.loads((job.home / ROWS).read_text(encoding="utf-8"))
        known = "key" in record and all("status" in row for row in record["rows"])
        return record if known and record["rows"] else None
    except (OSError, ValueError, LookupError, TypeError):  # not as it was written: not done
        return None


def _keep(job: Job, rows: list[Row], results: Sequence[Personalization]) -> list[Row]:
    """Write the folder of a job: it appears whole, once, and the first one stays."""
    if job.folder is None or job.home is None:
        return rows
    stage = job.folder / STAGE / uuid.uuid4().hex
    try:
        if len(results) == 1 and job.formats:
            _write(results[0], stage, job.formats, job.home)
        write_text(json.dumps({"key": job.key(), "rows": rows}, indent=1) + "\n", stage / ROWS)
        job.home.parent.mkdir(parents=True, exist_ok=True)
        stage.rename(job.home)
    except HeartgenError:
        raise
    except OSError as error:
        if (done := rows_of(job)) is not None:  # a twin was faster, on a worker thought dead
            return done
        raise NoPlaceError(
            f"{job.home}: the results cannot be written there ({error.strerror or error}): choose "
            "a folder with free space that all workers can write to"
        ) from error
    finally:
        shutil.rmtree(stage, ignore_errors=True)
    return rows


def _write(result: Personalization, folder: Path, formats: tuple[str, ...], home: Path) -> None:
    """Write mesh and report, of a mesh that is not valid the report alone, to be moved home."""
    result.write(folder, formats if result.report.quality.valid else ())
    if result.report.mask_source is not None:  # told from there
        source = seen_from(result.report.mask_source, home)
        report = replace(result.report, mask_source=source)
        write_text(report.to_json() + "\n", folder / REPORT)
