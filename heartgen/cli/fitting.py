"""The commands that make a mesh of one heart: `fit` and `demo`.

What takes long to import is imported inside the commands, so that ``heartgen --help`` is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from heartgen.cli.application import app, personalized
from heartgen.cli.earlier import check_results
from heartgen.cli.option_flags import Choices, takes_options
from heartgen.cli.outcome import check_folder, errors, errors_reported, written_together
from heartgen.cli.parameters import (
    EPILOG,
    Command,
    Debug,
    Frame,
    Label,
    Labels,
    MaskPath,
    Overwrite,
    RvWall,
    Views,
)
from heartgen.errors import HeartgenError
from heartgen.options import Options, options_from_text

if TYPE_CHECKING:
    from heartgen.result import Personalization

__all__ = ["app"]


@app.command(cls=Command, epilog=EPILOG)
@takes_options()
def fit(
    mask: MaskPath,
    out: Annotated[
        Path,
        typer.Option(
            "-o",
            "--out",
            metavar="OUT",
            show_default=False,
            help="Folder for mesh.exf, mesh.vtu and report.json.",
        ),
    ],
    *,
    view: Views = None,
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    choices: Choices,
    fields: Annotated[
        str,
        typer.Option(
            metavar="all|none|NAMES",
            help="Fields written with the mesh: coordinates, aha, fibers, angles, thickness, "
            "curvature.",
        ),
    ] = "all",
    fiber_angles: Annotated[
        str | None,
        typer.Option(
            metavar="ANGLES",
            show_default=False,
            help="Degrees at endo- and epicardium, such as helix=60/-60,right=90/-25, which are "
            "taken if not given; also transverse and sheet, which are 0/0.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Fit a mesh to a mask and write it with its report.

    Ends with 0 only if the mesh is valid; if it is not, nothing is written.
    """
    with errors_reported(debug):
        from heartgen.fields import rule_from_text
        from heartgen.images.selecting import Selection

        check_folder(out)
        options = options_from_text(choices)
        chosen = _fields(fields)
        rule = None if fiber_angles is None else rule_from_text(fiber_angles)
        selection = Selection(tuple(label or ()), labels, rv_wall, frame)
        heart = selection.read(mask, options.ventricles)
        check_results(out, heart, overwrite)
        views = [selection.read(path, options.ventricles, view=True) for path in view or ()]
        result = personalized([heart, *views], options)
        with written_together(out) as folder:
            result.write(folder, fields=chosen, rule=rule)


@app.command(cls=Command)
def demo(
    out: Annotated[
        Path, typer.Option("-o", "--out", metavar="OUT", help="Folder for all that is made.")
    ] = Path("out/demo"),
    sample: Annotated[str, typer.Option(metavar="NAME", help="Which sample heart.")] = "lifelike",
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Mesh a sample heart, and make a page that shows the result."""
    with errors_reported(debug):
        from heartgen import samples
        from heartgen.images.writing import write_mask

        check_folder(out)
        heart = samples.load(sample)
        check_results(out, heart.mask, overwrite)
        errors.print(heart.description, style="dim", markup=False, soft_wrap=True)
        result = personalized([heart.mask], Options())
        with written_together(out) as folder:
            write_mask(heart.mask, folder / "mask.nii.gz")
            result.write(folder)
            lacking = _write_page(result, folder / "index.html")
        if lacking:
            errors.print(f"There is no page: {lacking}", markup=False, soft_wrap=True)
            typer.echo(f"The mesh is in {out}.")
        else:
            typer.echo(f"Open {out / 'index.html'} in a browser.")


def _write_page(result: Personalization, path: Path) -> str:
    """Write the page that shows a result; what it lacks, of an installation without pictures."""
    try:
        from heartgen.viewing import view_html

        with errors.status("making the page"):
            view_html(result, path)
    except HeartgenError as error:
        if not isinstance(error.__cause__, ModuleNotFoundError):
            raise
        return str(error)
    return ""


def _fields(text: str) -> tuple[str, ...]:
    """Names of fields; all or none of them by one word."""
    from heartgen.fields import FIELDS
    from heartgen.fields.catalog import check_names

    words = {"all": tuple(FIELDS), "none": ()}
    return words[text] if text in words else check_names(text.split(","))
