"""Tables of the database. Times are seconds since 1970; what has a structure of its own is JSON."""

from __future__ import annotations

import time
import uuid
from enum import StrEnum
from typing import Any

from sqlalchemy import JSON, ForeignKey, Index, String, Text, UniqueConstraint
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column


class State(StrEnum):
    """Where a job is; the last three are ends."""

    QUEUED = "queued"
    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"

    @property
    def ended(self) -> bool:
        """Whether nothing more comes."""
        return self not in (State.QUEUED, State.RUNNING)


def new_id() -> str:
    """An identifier that cannot be guessed."""
    return uuid.uuid4().hex


class Base(DeclarativeBase):
    """Of all tables."""

    type_annotation_map = {dict[str, Any]: JSON, list[str]: JSON, State: String(16)}  # noqa: RUF012


class Token(Base):
    """A token, of which only the hash is kept."""

    __tablename__ = "tokens"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(String(200))
    hash: Mapped[str] = mapped_column(String(64))
    scopes: Mapped[list[str]]
    created: Mapped[float] = mapped_column(default=time.time)
    revoked: Mapped[float | None]


class Job(Base):
    """A mask that was submitted, with its options."""

    __tablename__ = "jobs"
    __table_args__ = (
        UniqueConstraint("owner", "idempotency_key"),
        Index("jobs_queue", "state", "created"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True, default=new_id)
    owner: Mapped[str] = mapped_column(String(16), index=True)
    idempotency_key: Mapped[str | None] = mapped_column(String(200))
    fingerprint: Mapped[str] = mapped_column(String(64), index=True)
    title: Mapped[str] = mapped_column(String(200))
    upload: Mapped[str] = mapped_column(String(100))
    upload_sha256: Mapped[str] = mapped_column(String(64), index=True)
    options: Mapped[dict[str, Any]]
    selection: Mapped[dict[str, Any]]
    email: Mapped[str | None] = mapped_column(String(320))
    state: Mapped[str] = mapped_column(String(16), default=State.QUEUED)
    step: Mapped[str | None] = mapped_column(String(40))
    progress: Mapped[float] = mapped_column(default=0.0)
    reason: Mapped[str | None] = mapped_column(Text)
    summary: Mapped[dict[str, Any] | None]
    starts: Mapped[int] = mapped_column(default=0)
    server: Mapped[str | None] = mapped_column(String(32))
    lease: Mapped[float | None]
    created: Mapped[float] = mapped_column(default=time.time)
    started: Mapped[float | None]
    finished: Mapped[float | None]


class Mail(Base):
    """A mail that is to be sent, or was."""

    __tablename__ = "mails"

    id: Mapped[str] = mapped_column(String(32), primary_key=True, default=new_id)
    job: Mapped[str] = mapped_column(ForeignKey("jobs.id", ondelete="CASCADE"), unique=True)
    tries: Mapped[int] = mapped_column(default=0)
    due: Mapped[float] = mapped_column(default=time.time, index=True)
    sent: Mapped[float | None]
    error: Mapped[str | None] = mapped_column(Text)


class Model(Base):
    """A version of a model of the library."""

    __tablename__ = "models"
    __table_args__ = (
        UniqueConstraint("identifier", "version"),
        Index("models_shown", "latest", "published"),
    )

    id: Mapped[str] = mapped_column(String(32), primary_key=True, default=new_id)
    identifier: Mapped[str] = mapped_column(String(20), index=True)
    version: Mapped[int]
    latest: Mapped[bool]
    owner: Mapped[str] = mapped_column(String(16))
    published: Mapped[float] = mapped_column(default=time.time)
    title: Mapped[str] = mapped_column(String(200))
    species: Mapped[str] = mapped_column(String(60), index=True)
    condition: Mapped[str] = mapped_column(String(100), index=True)
    modality: Mapped[str] = mapped_column(String(60), index=True)
    phase: Mapped[str] = mapped_column(String(60), index=True)
    sex: Mapped[str] = mapped_column(String(20), index=True)
    age_band: Mapped[str] = mapped_column(String(20), index=True)
    study: Mapped[str] = mapped_column(String(200), index=True)
    license: Mapped[str] = mapped_column(String(60), index=True)
    citation: Mapped[str] = mapped_column(Text)
    keywords: Mapped[list[str]]
    description: Mapped[str] = mapped_column(Text)
    words: Mapped[str] = mapped_column(Text)
    provenance: Mapped[dict[str, Any]]


class Audit(Base):
    """Who published or deleted what."""

    __tablename__ = "audit"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[float] = mapped_column(default=time.time)
    actor: Mapped[str] = mapped_column(String(16))
    action: Mapped[str] = mapped_column(String(40))
    subject: Mapped[str] = mapped_column(String(64))
    detail: Mapped[dict[str, Any]]
