"""The library: models that were published, their versions, and how they are found."""

from __future__ import annotations

import json
import secrets
import shutil
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from sqlalchemy import Select, func, select, update
from sqlalchemy.orm import Session

from heartgen.errors import HeartgenError, InputError
from heartgen.files import replacing
from heartgen.report import REPORT
from heartgen.service.artifacts import Artifacts
from heartgen.service.database import Database
from heartgen.service.metadata import FACETS, Found, Metadata, model_out, words_of
from heartgen.service.renditions import KEPT, Renditions
from heartgen.service.tables import Audit, Job, Model, State, new_id
from heartgen.service.tokens import Caller

ALPHABET = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
"""Base 32 of Crockford: no letters that are mistaken for others."""

LETTERS = 10
"""Of an identifier: 50 bits."""

SHOWN = ("preview", "view")
"""Renditions that need the mask, which is not published: they are made before."""

MOST_VALUES = 50
"""Of a facet that are told."""


class Library:
    """The models in a database, and their files.

    Parameters
    ----------
    database : Database
        Where models are.
    artifacts : Artifacts
        Where files are.
    renditions : Renditions
        Who makes formats.
    url : str
        Of the service.
    """

    def __init__(
        self, database: Database, artifacts: Artifacts, renditions: Renditions, url: str
    ) -> None:
        self.database, self.artifacts, self.renditions = database, artifacts, renditions
        self.url = url

    def publish(
        self, job: Job, metadata: Metadata, caller: Caller, identifier: str | None = None
    ) -> Model:
        """Publish the result of a job.

        Parameters
        ----------
        job : Job
            That is done, of whoever asks.
        metadata : Metadata
            What is said of the model.
        caller : Caller
            Who asks.
        identifier : str or None
            Of the model of which this is a new version; None for a new model.

        Raises
        ------
        InputError
            If there is no result, or no such model of the caller's.
        """
        if job.state != State.DONE or not self.artifacts.is_done(job.fingerprint):
            raise InputError("only a job that is done, and whose result is kept, can be published")
        self.check_owner(identifier, caller)
        row, name = new_id(), identifier or new_identifier()
        result = self.artifacts.result(job.fingerprint)
        self.artifacts.make(f"library/{row}", lambda stage: self._copy(job, result, stage, name))
        model = Model(
            id=row,
            identifier=name,
            owner=caller.owner,
            **metadata.model_dump(exclude={"no_names"}),
            words=words_of(metadata, name),
            provenance=_provenance(job, result),
        )
        try:
            with self.database.writing() as session:
                last = session.scalar(
                    select(func.max(Model.version)).where(Model.identifier == name)
                )
                model.version = (last or 0) + 1
                add(session, model)
                _note(session, caller, "publish", model)
        except BaseException:
            self.artifacts.forget(f"library/{row}")
            raise
        return model

    def check_owner(self, identifier: str | None, caller: Caller) -> None:
        """Refuse to change a model of somebody else.

        Parameters
        ----------
        identifier : str or None
            Of the model; None for a new one.
        caller : Caller
            Who asks.
        """
        if identifier is None:
            return
        model = self.get(identifier)
        if model is None or (model.owner != caller.owner and "admin" not in caller.scopes):
            raise InputError(f"there is no model {identifier} of yours: publish a new one")

    def get(self, identifier: str, version: int | None = None) -> Model | None:
        """A model, if it is there.

        Parameters
        ----------
        identifier : str
            Of the model.
        version : int or None
            None for the latest.
        """
        wanted = select(Model).where(Model.identifier == identifier)
        which = Model.latest if version is None else Model.version == version
        with self.database.reading() as session:
            return session.scalar(wanted.where(which))

    def versions(self, identifier: str) -> Sequence[Model]:
        """All versions of a model, latest first.

        Parameters
        ----------
        identifier : str
            Of the model.
        """
        wanted = select(Model).where(Model.identifier == identifier)
        with self.database.reading() as session:
            return session.scalars(wanted.order_by(Model.version.desc())).all()

    def search(
        self, words: str = "", facets: Mapping[str, str] = {}, limit: int = 20, offset: int = 0
    ) -> Found:
        """Find models, latest versions only, newest first.

        Parameters
        ----------
        words : str
            All of them have to be there, in whatever is said of a model.
        facets : mapping of str to str
            Values, by names of `FACETS`.
        limit, offset : int
            How many, and after how many.
        """
        given = {name: v for name, v in facets.items() if v and name in FACETS}
        # One pass over the words of all models; what is left of them is counted here.
        columns = [getattr(Model, name) for name in FACETS]
        with self.database.reading() as session:
            rows = session.execute(_with_words(select(*columns), words)).all()
            counts, total = _counted(rows, given)
            models = session.scalars(
                _with_words(select(Model), words)
                .where(*(getattr(Model, name) == value for name, value in given.items()))
                .order_by(Model.published.desc(), Model.id)
                .limit(limit)
                .offset(offset)
            ).all()
        return Found(
            total=total, facets=counts, models=[model_out(each, self.url) for each in models]
        )

    def withdraw(self, model: Model, caller: Caller) -> None:
        """Remove a version of a model; the one before becomes the latest.

        Parameters
        ----------
        model : Model
            A version.
        caller : Caller
            Who asks.
        """
        self.check_owner(model.identifier, caller)
        with self.database.writing() as session:
            known = session.get(Model, model.id)
            if known is None:
                return
            session.delete(known)
            session.flush()
            _note(session, caller, "withdraw", model)
            before = session.scalar(
                select(Model)
                .where(Model.identifier == model.identifier)
                .order_by(Model.version.desc())
                .limit(1)
            )
            if before is not None:
                before.latest = True
        self.artifacts.forget(f"library/{model.id}")

    def file(self, model: Model, name: str) -> Path:
        """A file of a model.

        Parameters
        ----------
        model : Model
            A version.
        name : str
            Of `heartgen.service.renditions.NAMES`.
        """
        if name in SHOWN and not (self.artifacts.home / "library" / model.id / name).is_dir():
            raise InputError(f"this model has no {name}")
        return self.renditions.file(f"library/{model.id}", name)

    def _copy(self, job: Job, result: Path, stage: Path, identifier: str) -> None:
        """Put what is published of a result in a folder: nothing that tells of the upload."""
        for name in KEPT:
            if name != REPORT:
                shutil.copyfile(result / name, stage / name)
        report = json.loads((result / REPORT).read_text(encoding="utf-8"))
        with replacing(stage / REPORT) as path:
            told = report | {"name": identifier, "mask_source": None}
            path.write_text(json.dumps(told, indent=1) + "\n", encoding="utf-8")
        for name in SHOWN:
            try:
                file = self.renditions.file(f"results/{job.fingerprint}", name)
            except HeartgenError:  # nothing draws here: the model is published without
                continue
            (stage / name).mkdir()
            shutil.copyfile(file, stage / name / file.name)


def new_identifier() -> str:
    """A stable identifier for a model."""
    return "HG-" + "".join(secrets.choice(ALPHABET) for _ in range(LETTERS))


def add(session: Session, model: Model) -> None:
    """Add a version, which becomes the latest if none is later.

    Parameters
    ----------
    session : Session
        That writes.
    model : Model
        With its version.
    """
    same = Model.identifier == model.identifier
    later = session.scalar(select(func.count()).where(same, Model.version > model.version))
    model.latest = not later
    if model.latest:
        session.execute(update(Model).where(same).values(latest=False))
    session.add(model)


def _with_words(wanted: Select[Any], words: str) -> Select[Any]:
    """Only the latest versions that have these words."""
    wanted = wanted.where(Model.latest)
    for word in words.lower().split():
        wanted = wanted.where(Model.words.contains(word, autoescape=True))
    return wanted


def _counted(
    rows: Iterable[Sequence[str]], given: Mapping[str, str]
) -> tuple[dict[str, dict[str, int]], int]:
    """How many there are under each value of each facet, were that alone free; and in all."""
    counts: dict[str, Counter[str]] = {name: Counter() for name in FACETS}
    wanted = [(n, given[name]) for n, name in enumerate(FACETS) if name in given]
    total = 0
    for row in rows:
        missed = [n for n, value in wanted if row[n] != value]
        if not missed:
            total += 1
            for name, value in zip(FACETS, row, strict=True):
                counts[name][value] += 1
        elif len(missed) == 1:
            counts[FACETS[missed[0]]][row[missed[0]]] += 1
    shown = {name: each.most_common(MOST_VALUES) for name, each in counts.items()}
    return {name: {v: n for v, n in each if v} for name, each in shown.items()}, total


def _provenance(job: Job, result: Path) -> dict[str, Any]:
    """Where a model comes from, and how good it is."""
    report = json.loads((result / REPORT).read_text(encoding="utf-8"))
    return {
        "mask_sha256": report["mask_sha256"],
        "options": job.options,
        "versions": report["versions"],
        "accuracy": report["accuracy"],
        "quality": report["quality"],
        "fairness": report["fairness"],
        "success": report["success"],
    }


def _note(session: Session, caller: Caller, action: str, model: Model) -> None:
    """Write into the audit log."""
    detail = {"version": model.version, "title": model.title}
    session.add(Audit(actor=caller.owner, action=action, subject=model.identifier, detail=detail))
