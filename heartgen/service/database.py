"""The database: SQLite in a file, or a PostgreSQL server; brought up to date by Alembic."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.orm import Session, sessionmaker

from heartgen.errors import HeartgenError, InputError

MIGRATIONS = Path(__file__).parent / "migrations"

BUSY = 30
"""Seconds that SQLite waits for another writer."""


class Database:
    """Sessions of a database.

    Parameters
    ----------
    url : str
        As SQLAlchemy takes it.
    """

    def __init__(self, url: str) -> None:
        self.engine = _engine(url)
        self._read = sessionmaker(self.engine, expire_on_commit=False)
        self._write = sessionmaker(
            self.engine.execution_options(writes=True), expire_on_commit=False
        )

    @contextmanager
    def reading(self) -> Iterator[Session]:
        """Lend a session that changes nothing."""
        with self._read() as session:
            yield session

    @contextmanager
    def writing(self) -> Iterator[Session]:
        """Lend a session whose changes are made together at the end of the block, or not at all."""
        with self._write.begin() as session:
            yield session

    @property
    def is_sqlite(self) -> bool:
        """Whether it is the embedded one."""
        return self.engine.dialect.name == "sqlite"

    def close(self) -> None:
        """Let go of all connections."""
        self.engine.dispose()


def upgrade(url: str, revision: str = "head") -> None:
    """Bring a database up to date, or make its tables; what is in it stays.

    Parameters
    ----------
    url : str
        As SQLAlchemy takes it.
    revision : str
        Schema to go to.

    Raises
    ------
    HeartgenError
        If the database does not answer, or is newer than this heartgen.
    """
    from alembic import command
    from alembic.config import Config
    from alembic.util import CommandError

    config = Config()
    config.set_main_option("script_location", str(MIGRATIONS))
    engine = _engine(url)
    try:
        with engine.execution_options(writes=True).begin() as connection:
            config.attributes["connection"] = connection
            command.upgrade(config, revision)
    except CommandError as error:
        raise HeartgenError(
            f"the database cannot be brought up to date ({error}): install the heartgen that wrote "
            "it, or a newer one"
        ) from error
    except SQLAlchemyError as error:
        raise HeartgenError(
            f"the database {make_url(url).render_as_string()} does not answer as one "
            f"({type(error).__name__}): check its address, and that it runs"
        ) from error
    finally:
        engine.dispose()


def _engine(url: str) -> Engine:
    """An engine, with what SQLite needs to be written by several at once."""
    try:
        made = make_url(url)
        if made.get_backend_name() != "sqlite":
            return create_engine(made, pool_pre_ping=True, pool_size=10, max_overflow=40)
        if made.database:
            Path(made.database).parent.mkdir(parents=True, exist_ok=True)
        engine = create_engine(made, connect_args={"timeout": BUSY}, pool_size=10, max_overflow=40)
    except (ArgumentError, NoSuchModuleError, ValueError) as error:
        raise InputError(
            f"the database cannot be addressed like this ({error}): give "
            "postgresql://user:password@host/name"
        ) from None

    @event.listens_for(engine, "connect")
    def connect(connection: Any, _: Any) -> None:
        connection.isolation_level = None  # transactions begin where we say, below
        for pragma in ("journal_mode=WAL", "synchronous=FULL", "foreign_keys=ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # One that reads first and writes later would fail where another has written meanwhile.
        writes = connection.get_execution_options().get("writes")
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine
