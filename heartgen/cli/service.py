"""The commands for the service: `serve`, and `submit` to one."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from heartgen.cli.cohort import Scheduler, app
from heartgen.cli.option_flags import Choices, takes_options
from heartgen.cli.outcome import check_folder, errors_reported
from heartgen.cli.parameters import EPILOG, Command, Debug, Frame, Label, Labels, RvWall
from heartgen.errors import needing
from heartgen.options import options_from_text

__all__ = ["app"]

SERVING = "Settings that are not given are those of variables HEARTGEN_...: docs/service.md."

Data = Annotated[
    Path | None,
    typer.Option(
        metavar="FOLDER",
        show_default=False,
        help="Folder of database, uploads and results; heartgen-data if not given.",
    ),
]
Database = Annotated[
    str | None,
    typer.Option(
        metavar="URL",
        show_default=False,
        help="Address of PostgreSQL, as docs/service.md shows; an SQLite file in the folder "
        "if not given.",
    ),
]
Url = Annotated[str, typer.Option(metavar="URL", envvar="HEARTGEN_URL", help="Of the service.")]
TokenText = Annotated[
    str | None,
    typer.Option(
        "--token",
        metavar="TOKEN",
        envvar="HEARTGEN_TOKEN",
        show_default=False,
        help="That whoever operates the service gave you.",
    ),
]


def settings_of(**given: Any) -> Any:
    """Settings of the service: those that are given, and those of the environment.

    Parameters
    ----------
    **given : object
        None for those that are not given.
    """
    with needing("the service needs", "service"):
        from pydantic import ValidationError

        from heartgen.service.settings import Settings
    from heartgen.errors import InputError

    try:
        return Settings(**{name: value for name, value in given.items() if value is not None})
    except ValidationError as error:
        first = error.errors(include_input=False)[0]
        raise InputError(
            f"setting {'.'.join(map(str, first['loc']))} cannot be used: {first['msg']}"
        ) from None


@app.command(cls=Command, epilog=SERVING)
def serve(
    data: Data = None,
    database: Database = None,
    scheduler: Scheduler = None,
    workers: Annotated[
        int | None,
        typer.Option(
            metavar="N",
            min=1,
            show_default=False,
            help="Processes; one for each core if not given.",
        ),
    ] = None,
    host: Annotated[
        str | None,
        typer.Option(
            metavar="HOST", show_default=False, help="Address to serve on; 0.0.0.0 for all."
        ),
    ] = None,
    port: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=1, max=65535, show_default=False, help="8000 if not given."
        ),
    ] = None,
    public_url: Annotated[
        str | None,
        typer.Option(
            metavar="URL", show_default=False, help="As users see the service, behind a proxy."
        ),
    ] = None,
    anonymous: Annotated[
        bool | None,
        typer.Option(
            "--anonymous/--no-anonymous",
            show_default=False,
            help="Whether requests need no token; on if this machine alone can reach it.",
        ),
    ] = None,
    smtp: Annotated[
        str | None,
        typer.Option(
            metavar="URL",
            show_default=False,
            help="Mail server that sends word of results, as docs/service.md shows.",
        ),
    ] = None,
    debug: Debug = False,
) -> None:
    """Serve the service: submit from anywhere, keep everything, find it again."""
    with errors_reported(debug):
        settings = settings_of(
            data=data,
            database=database,
            scheduler=scheduler,
            workers=workers,
            host=host,
            port=port,
            public_url=public_url,
            anonymous=anonymous,
            smtp=smtp,
        )
        with needing("the service needs", "service"):
            from heartgen.service.server import serve as run
        run(settings)


@app.command(cls=Command, epilog=EPILOG)
@takes_options()
def submit(
    mask: Annotated[
        Path, typer.Argument(metavar="MASK", show_default=False, help="Mask or label map, a file.")
    ],
    *,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--out",
            metavar="OUT",
            show_default=False,
            help="Wait, and put the result into this folder.",
        ),
    ] = None,
    url: Url = "http://127.0.0.1:8000",
    token: TokenText = None,
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    choices: Choices,
    title: Annotated[
        str | None,
        typer.Option(metavar="TEXT", show_default=False, help="For your list of jobs."),
    ] = None,
    email: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", show_default=False, help="Where to tell of the result."),
    ] = None,
    debug: Debug = False,
) -> None:
    """Submit a mask to a service; print the job, or wait for its result."""
    with errors_reported(debug):
        from heartgen import Client

        if out is not None:
            check_folder(out)
        options = options_from_text(choices)
        selection = {"label": label, "labels": labels, "rv_wall": rv_wall, "frame": frame}
        client = Client(url, token)
        job = client.submit(
            mask,
            selection=selection,
            title=title,
            email=email,
            **{name: getattr(options, name) for name in choices},
        )
        if out is None:
            typer.echo(job)
            return
        told = client.wait(job)
        typer.echo(told["summary"]["status"], err=True)
        for path in client.download(job, out):
            typer.echo(path)
