"""The commands for many hearts: `batch`, `sweep` and `report`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from heartgen.cli.comparing import app
from heartgen.cli.option_flags import Choices, takes_options
from heartgen.cli.outcome import check_folder, errors_reported
from heartgen.cli.parameters import (
    EPILOG,
    Command,
    Debug,
    Frame,
    Label,
    Labels,
    RvWall,
)
from heartgen.cohort.workers import TIME_LIMIT
from heartgen.errors import Cancelled, HeartgenError, InputError
from heartgen.options import option_from_text, settings_from_text

if TYPE_CHECKING:
    import pandas as pd


__all__ = ["app"]

Hearts = Annotated[
    Path,
    typer.Argument(
        metavar="FOLDER|TABLE",
        show_default=False,
        help="Folder of masks, or a table (CSV, TSV, Parquet) with a column mask and, if wanted, "
        "case, group, labels, label, rv_wall, frame, and options by name.",
    ),
]
Out = Annotated[
    Path,
    typer.Option(
        "-o",
        "--out",
        metavar="OUT",
        show_default=False,
        help="Folder for results.csv, results.parquet and a folder for each case.",
    ),
]
Settings = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        show_default=False,
        help="An option by its name, as a table has it: quality=2, optimize=no; may be repeated.",
    ),
]
Jobs = Annotated[
    int | None,
    typer.Option(
        metavar="N", min=1, show_default=False, help="Processes; one for each core if not given."
    ),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        show_default=False,
        help="Work on a Dask cluster that runs: tcp://HOST:PORT, or the file of its scheduler.",
    ),
]
Cluster = Annotated[
    str | None,
    typer.Option(
        metavar="CLASS",
        show_default=False,
        help="Start a Dask cluster for the work, such as dask_jobqueue.SLURMCluster, with the "
        "settings of Dask's configuration; --jobs says how many workers.",
    ),
]
TimeLimit = Annotated[
    float,
    typer.Option(
        metavar="MINUTES",
        min=0.01,
        help="After which a mesh that is not done is given up, and the next case begun.",
    ),
]
Redo = Annotated[
    bool,
    typer.Option(
        "--redo", help="Do again what failed, or was done with other options or another mask."
    ),
]


@app.command(cls=Command, epilog=EPILOG)
@takes_options()
def batch(
    hearts: Hearts,
    out: Out,
    *,
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    choices: Choices,
    settings: Settings = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    time_limit: TimeLimit = TIME_LIMIT,
    redo: Redo = False,
    debug: Debug = False,
) -> None:
    """Mesh all hearts of a folder or a table; stopped or killed, the same command goes on.

    Ends with 1 if a case has no mesh; its reason is in the tables.
    """
    with errors_reported(debug), _resumable():
        from heartgen import cohort
        from heartgen.cohort import find_cases
        from heartgen.cohort.summary import by_ventricles
        from heartgen.images.selecting import Selection

        check_folder(out)
        chosen = _single(choices, settings or ())
        cases = find_cases(hearts, Selection(tuple(label or ()), labels, rv_wall, frame))
        workers = cohort.Workers(jobs, scheduler, cluster, time_limit)
        with _bar("meshing") as progress:
            table = cohort.batch(
                cases, out, workers=workers, redo=redo, progress=progress, **chosen
            )
        _show(by_ventricles(table), out)


@app.command(cls=Command, epilog=EPILOG)
def sweep(
    hearts: Hearts,
    out: Out,
    lod: Annotated[
        str, typer.Option(metavar="N,N...", help="Levels of detail; they share their work.")
    ] = "1,2,3,4,5",
    elements: Annotated[
        str, typer.Option(metavar="RxCxL,...", help="Elements, or several of them.")
    ] = "auto",
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            metavar="NAME=VALUE,...",
            show_default=False,
            help="Values of any other option, such as quality=0.5,1,2; may be repeated.",
        ),
    ] = None,
    jobs: Jobs = None,
    scheduler: Scheduler = None,
    cluster: Cluster = None,
    time_limit: TimeLimit = TIME_LIMIT,
    redo: Redo = False,
    debug: Debug = False,
) -> None:
    """Compare levels of detail, elements and any other options, for one heart or many.

    Writes the tables and tradeoff.png: error against quality.
    """
    with errors_reported(debug), _resumable():
        from heartgen import cohort
        from heartgen.cohort import find_cases
        from heartgen.cohort.summary import by_options
        from heartgen.images.selecting import Selection

        check_folder(out)
        choices: dict[str, Any] = settings_from_text(
            [f"lod={lod}", f"elements={elements}", *(settings or ())]
        )
        cases = find_cases(hearts, Selection(tuple(label or ()), labels, rv_wall, frame))
        workers = cohort.Workers(jobs, scheduler, cluster, time_limit)
        with _bar("fitting") as progress:
            table = cohort.sweep(
                cases, out=out, workers=workers, redo=redo, progress=progress, **choices
            )
        varied = [name for name, values in choices.items() if len(values) > 1]
        _draw_tradeoff(table, varied, out)
        _show(by_options(table, varied), out)


@app.command(cls=Command)
def report(
    out: Annotated[
        Path, typer.Argument(metavar="OUT", show_default=False, help="Folder of a batch.")
    ],
    debug: Debug = False,
) -> None:
    """Make a page of a batch: figures, best and worst cases in 3-D, failures and why."""
    with errors_reported(debug):
        from heartgen import cohort

        typer.echo(f"Open {cohort.write_report(out)} in a browser.")


def _single(choices: Choices, settings: Iterable[str]) -> dict[str, Any]:
    """Options with one value each, from flags and settings."""
    chosen = {name: option_from_text(name, text) for name, text in choices.items()}
    for name, values in settings_from_text(settings).items():
        if len(values) > 1:
            raise InputError(f"{name} has several values: heartgen sweep compares them")
        if name in chosen:
            raise InputError(f"option {name!r} is given twice: give it once")
        chosen[name] = values[0]
    return chosen


@contextmanager
def _resumable() -> Iterator[None]:
    """Say how to go on after an interruption."""
    try:
        yield
    except KeyboardInterrupt:
        raise Cancelled("cancelled: what is done stays, and the same command goes on") from None


@contextmanager
def _bar(what: str) -> Iterator[Any]:
    """Show how many cases are done, how many of them failed, and how long it will take."""
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from heartgen.cli.outcome import errors
    from heartgen.cohort.store import succeeded

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[failed]} failed"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=errors) as bars:
        task = bars.add_task(what, total=None, failed=0)
        failed = 0

        def show(done: int, total: int, rows: list[dict[str, Any]]) -> None:
            nonlocal failed
            failed += not all(succeeded(row) for row in rows)
            bars.update(task, completed=done, total=total, failed=failed)

        try:
            yield show
        except BaseException:
            bars.update(task, visible=bars.tasks[task].total is not None)  # or it never began
            raise


def _show(table: pd.DataFrame, out: Path) -> None:
    """Show what came out, and end with an error if a case has no mesh."""
    from heartgen.cli.tables import show_summaries
    from heartgen.cohort.store import TABLE
    from heartgen.cohort.summary import reasons, summarize

    show_summaries(summarize(table))
    for ending in (".csv", ".parquet"):
        typer.echo(out / f"{TABLE}{ending}")
    failed = reasons(table)
    if failed:
        case, reason = failed[0]
        raise HeartgenError(
            f"{len(failed)} of {len(table)} have no mesh, {case} because: {reason} (the column "
            f"status of {TABLE}.csv says why for each)"
        )


def _draw_tradeoff(table: pd.DataFrame, varied: list[str], out: Path) -> None:
    """Draw error against quality."""
    from heartgen.files import replacing
    from heartgen.viewing.tradeoff import draw_sweep

    path = out / "tradeoff.png"
    with replacing(path) as temporary:
        draw_sweep(table, varied).savefig(temporary)
    typer.echo(path)
