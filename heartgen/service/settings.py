"""What an operator may set, by flags of `heartgen serve` or variables ``HEARTGEN_...``."""

from __future__ import annotations

import secrets
from pathlib import Path
from urllib.parse import urlsplit

from pydantic import Field, SecretStr
from pydantic_settings import BaseSettings, SettingsConfigDict

LOCAL = ("localhost", "127.0.0.1", "::1")
"""Hosts that only this machine reaches."""

MB = 1024 * 1024
"""Bytes."""

DATABASE = "service.sqlite3"
"""File of the embedded database, in the data folder."""

SECRET = "secret"
"""File of the key that signs what forms bring back, in the data folder."""


class Settings(BaseSettings):
    """Settings of the service; each has a default with which it runs on one machine."""

    model_config = SettingsConfigDict(env_prefix="HEARTGEN_", extra="ignore")

    data: Path = Field(Path("heartgen-data"), description="Folder of database, uploads, results.")
    database: str | None = Field(None, description="postgresql://...; SQLite in `data` if None.")
    host: str = Field("127.0.0.1", description="Address to listen on.")
    port: int = Field(8000, ge=0, le=65535)
    public_url: str | None = Field(None, description="As users see it, behind a proxy.")
    scheduler: str | None = Field(None, description="tcp://... of a Dask cluster that runs.")
    workers: int | None = Field(None, ge=1, description="Processes of an own cluster.")
    time_limit: float = Field(30.0, gt=0, description="Minutes that a fit may take.")
    anonymous: bool | None = Field(None, description="Whether requests need no token.")
    upload_limit: int = Field(400, ge=1, description="MB of the largest upload.")
    queue_limit: int = Field(1000, ge=1, description="Jobs that a token may have waiting.")
    rate_limit: int = Field(1200, ge=1, description="Requests of a token in a minute.")
    wait_limit: float = Field(600.0, gt=0, description="Seconds that /v1/personalize waits.")
    retention: float = Field(30.0, gt=0, description="Days that unpublished results are kept.")
    free_space: int = Field(500, ge=0, description="MB of disk that are left free.")
    starts: int = Field(20, ge=1, description="Times that an interrupted job is started.")
    smtp: SecretStr | None = Field(None, description="smtp://user:password@host:587, or smtps://")
    mail_from: str = "heartgen@localhost"
    mail_tries: int = Field(8, ge=1, description="Times that a mail is tried.")

    @property
    def database_url(self) -> str:
        """Address of the database, with the driver that we use."""
        if self.database is None:
            return f"sqlite+pysqlite:///{self.data.absolute() / DATABASE}"
        scheme, _, rest = self.database.partition("://")
        psycopg = scheme in ("postgres", "postgresql")
        return f"postgresql+psycopg://{rest}" if psycopg else self.database

    @property
    def is_local(self) -> bool:
        """Whether only this machine reaches the service, as far as we know."""
        behind = None if self.public_url is None else urlsplit(self.public_url).hostname
        return self.host in LOCAL and behind in (None, *LOCAL)

    @property
    def takes_anonymous(self) -> bool:
        """Whether requests need no token."""
        return self.is_local if self.anonymous is None else self.anonymous

    @property
    def url(self) -> str:
        """Where users find the service, without a slash at the end."""
        return (self.public_url or f"http://{self.host}:{self.port}").rstrip("/")

    def secret(self) -> bytes:
        """Key that signs what forms bring back; made once."""
        path = self.data / SECRET
        self.data.mkdir(parents=True, exist_ok=True)
        try:
            with path.open("x", encoding="ascii") as file:
                path.chmod(0o600)
                file.write(secrets.token_hex(32))
        except FileExistsError:
            pass
        return path.read_bytes()
