"""The commands `inspect`, `options` and `dashboard`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.table import Table
from rich.text import Text

from heartgen.cli.fitting import app
from heartgen.cli.option_flags import Choices, takes_options
from heartgen.cli.outcome import check_picture, errors_reported
from heartgen.cli.parameters import (
    EPILOG,
    Command,
    Debug,
    Frame,
    Label,
    Labels,
    MaskPath,
    RvWall,
)
from heartgen.options import ANALYZED, OPTIONS, as_text, options_from_text
from heartgen.options.option import explanation

__all__ = ["app"]

DPI = 150
"""Of the picture of `inspect`, dots per inch: 1800 pixels across."""


@app.command(cls=Command, epilog=EPILOG)
@takes_options(ANALYZED)
def inspect(
    mask: MaskPath,
    picture: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="PICTURE", help="Picture of three slices."),
    ] = Path("inspect.png"),
    *,
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    choices: Choices,
    debug: Debug = False,
) -> None:
    """Show what is in a mask: what the checks found, what the shape analysis sees."""
    with errors_reported(debug):
        from heartgen.anatomy import analyze_under
        from heartgen.cli.tables import console, show_anatomy, show_image
        from heartgen.files import replacing
        from heartgen.images.selecting import Selection
        from heartgen.viewing import draw_slices

        check_picture(picture)
        options = options_from_text(choices)
        selection = Selection(tuple(label or ()), labels, rv_wall, frame)
        image = selection.read(mask, options.ventricles)
        show_image(image)
        anatomy = analyze_under(image, options)
        show_anatomy(anatomy)
        with replacing(picture) as temporary:
            draw_slices(image, anatomy).savefig(temporary, dpi=DPI)
        console.print(f"Picture: {picture}", markup=False, highlight=False, soft_wrap=True)


@app.command(cls=Command, epilog=EPILOG)
def options(
    schema: Annotated[
        bool, typer.Option("--json", help="As a JSON schema, for programs and forms.")
    ] = False,
    markdown: Annotated[
        bool, typer.Option("--markdown", help="As the page docs/options.md.")
    ] = False,
) -> None:
    """Tell all options of a fit: values, unit, default, and what each does."""
    from heartgen.options.reference import options_markdown, options_schema

    if schema:
        typer.echo(json.dumps(options_schema(), indent=2))
    elif markdown:
        typer.echo(options_markdown(), nl=False)
    else:
        _show_options()


def _show_options() -> None:
    """Show a table of all options."""
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in ("option", "values", "default", ""):
        table.add_column(head, no_wrap=head in ("option", "default"))
    for each in OPTIONS.values():
        cells = each.name, each.choice, as_text(each.default), explanation(each)
        table.add_row(*map(Text, cells))
    Console().print(table)
