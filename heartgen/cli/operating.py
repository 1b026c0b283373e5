"""The commands of who operates a service: `token`, `db` and `library`."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heartgen.cli.outcome import errors_reported
from heartgen.cli.parameters import Command, Debug, Group
from heartgen.cli.service import Data, Database, app, settings_of
from heartgen.errors import InputError, needing

if TYPE_CHECKING:
    from heartgen.service.service import Service

__all__ = ["app"]

token = typer.Typer(cls=Group, no_args_is_help=True, help="Who may use the service.")
db = typer.Typer(cls=Group, no_args_is_help=True, help="The database of the service.")
library = typer.Typer(cls=Group, no_args_is_help=True, help="The library as an archive.")
app.add_typer(token, name="token")
app.add_typer(db, name="db")
app.add_typer(library, name="library")


@contextmanager
def _opened(data: Path | None, database: str | None) -> Iterator[Service]:
    """The parts of the service, beside one that may run."""
    settings = settings_of(data=data, database=database)
    with needing("the service needs", "service"):
        from heartgen.service.service import Service
    service = Service(settings)
    try:
        yield service
    finally:
        service.database.close()


@token.command(cls=Command)
def create(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of whoever gets it.")],
    scope: Annotated[
        list[str] | None,
        typer.Option(
            metavar="jobs|library|publish|admin",
            show_default=False,
            help="What it is for; may be repeated. jobs and library if not given.",
        ),
    ] = None,
    data: Data = None,
    database: Database = None,
    debug: Debug = False,
) -> None:
    """Make a token and print it; it cannot be seen again."""
    with errors_reported(debug), _opened(data, database) as service:
        typer.echo(service.tokens.create(name, scope or ["jobs", "library"]))


@token.command("list", cls=Command)
def list_(data: Data = None, database: Database = None, debug: Debug = False) -> None:
    """List all tokens: identifier, scopes, name."""
    with errors_reported(debug), _opened(data, database) as service:
        for each in service.tokens.all():
            day = time.strftime("%Y-%m-%d", time.gmtime(each.created))
            revoked = "" if each.revoked is None else "  revoked"
            typer.echo(f"{each.id}  {day}  {','.join(each.scopes)}  {each.name}{revoked}")


@token.command(cls=Command)
def revoke(
    identifier: Annotated[str, typer.Argument(metavar="ID", help="As the list tells it.")],
    data: Data = None,
    database: Database = None,
    debug: Debug = False,
) -> None:
    """Take back a token, at once."""
    with errors_reported(debug), _opened(data, database) as service:
        service.tokens.revoke(identifier)


@db.command(cls=Command)
def upgrade(data: Data = None, database: Database = None, debug: Debug = False) -> None:
    """Bring the database up to date; what is in it stays. Serving does it, too."""
    with errors_reported(debug):
        settings = settings_of(data=data, database=database)
        with needing("the service needs", "service"):
            from heartgen.service.database import upgrade as bring_up
        bring_up(settings.database_url)


@library.command("export", cls=Command)
def export_(
    out: Annotated[Path, typer.Argument(metavar="OUT", help="A .zip file.")],
    data: Data = None,
    database: Database = None,
    debug: Debug = False,
) -> None:
    """Write all models, a table (Parquet) and their files, into one archive."""
    with errors_reported(debug), _opened(data, database) as service:
        from heartgen.service.archive import export

        number = export(service.library, out)
        typer.echo(f"{number} models: {out}")


@library.command("import", cls=Command)
def import_(
    archive: Annotated[Path, typer.Argument(metavar="IN", help="As export writes it.")],
    data: Data = None,
    database: Database = None,
    debug: Debug = False,
) -> None:
    """Add the models of an archive that are not here."""
    with errors_reported(debug), _opened(data, database) as service:
        from heartgen.service.archive import take_in
        from heartgen.service.tokens import NOBODY

        if not archive.is_file():
            raise InputError(f"{archive}: There is no such file: check the path.")
        taken = take_in(service.library, archive, NOBODY)
        typer.echo(f"{taken.added} added, {taken.known} known")
