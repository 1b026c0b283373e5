"""The commands for a mask, and for the dashboard: read the options, run, show, write.

What takes long to import is imported inside the commands, so that ``heartgen --help`` is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from heartgen import __version__
from heartgen.cli.earlier import check_results
from heartgen.cli.outcome import (
    check_folder,
    check_picture,
    errors,
    errors_reported,
    written_together,
)
from heartgen.cli.parameters import (
    EPILOG,
    Debug,
    Frame,
    Label,
    Labels,
    Level,
    MaskPath,
    NoBrowser,
    Overwrite,
    RvWall,
    SeptalDirection,
    SliceAlignment,
    TakesFormerFlags,
    Truncate,
    Ventricles,
    Views,
)
from heartgen.errors import MeshError

if TYPE_CHECKING:
    from heartgen.images import Mask
    from heartgen.options import Options
    from heartgen.result import Personalization

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    cls=TakesFormerFlags,
    help="From a binary mask of the myocardium to a personalized cubic Hermite mesh.",
    epilog=EPILOG,
)

DPI = 150
"""Of the picture of `inspect`, dots per inch: 1800 pixels across."""


@app.command(epilog=EPILOG)
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
    lod: Level = 1,
    elements: Annotated[
        str | None,
        typer.Option(
            metavar="RxCxL",
            show_default=False,
            help="Elements, radial x circumferential x longitudinal; 1x12x6 for a left ventricle "
            "and 2x12x8 for both if not given.",
        ),
    ] = None,
    ventricles: Ventricles = "auto",
    truncate: Truncate = "auto",
    base: Annotated[
        str,
        typer.Option(
            metavar="rim|plane",
            help="Basal surface where valves rise: smooth along the rim, or a plane below it.",
        ),
    ] = "rim",
    view: Views = None,
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    apex: Annotated[
        str,
        typer.Option(
            metavar="collapsed|hole|patch",
            help="Elements that collapse in a pole, an apical hole, or a square patch of elements.",
        ),
    ] = "collapsed",
    hole_radius: Annotated[
        float | None,
        typer.Option(
            metavar="MM",
            show_default=False,
            help="Radius of the apical hole on the endocardium; a quarter of the cavity's if not "
            "given.",
        ),
    ] = None,
    insertion: Annotated[
        str,
        typer.Option(
            metavar="rounded|squared",
            help="The line on which the right ventricle meets the left one follows the anatomy "
            "around the right apex, or stays square.",
        ),
    ] = "rounded",
    transmural_lines: Annotated[
        str,
        typer.Option(
            metavar="straight|curved",
            help="Lines of the mesh across the wall: curved ones make better elements; surfaces "
            "stay.",
        ),
    ] = "straight",
    no_grading: Annotated[
        bool,
        typer.Option(
            "--no-grading",
            help="Depth in the wall proportional to the transmural coordinate, not graded for "
            "even elements.",
        ),
    ] = False,
    basis: Annotated[
        str,
        typer.Option(
            metavar="hermite|lagrange",
            help="Cubic basis of the mesh: smooth between elements, or values at Lagrange nodes.",
        ),
    ] = "hermite",
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
            help="Degrees at endo- and epicardium, helix=60/-60,right=90/-25,transverse=0/0,"
            "sheet=0/0 if not given.",
        ),
    ] = None,
    septal_direction: SeptalDirection = None,
    slice_alignment: SliceAlignment = "auto",
    quality: Annotated[
        float,
        typer.Option(
            metavar="FACTOR",
            help="Weight of element quality against accuracy; 1 is the default of the level.",
        ),
    ] = 1.0,
    min_jacobian_ratio: Annotated[
        float,
        typer.Option(
            metavar="RATIO",
            help="Jacobian ratio that every element should reach; the report says if one does not.",
        ),
    ] = 0.0,
    no_enhance: Annotated[
        bool, typer.Option("--no-enhance", help="Leave out the step that straightens elements.")
    ] = False,
    no_optimize: Annotated[
        bool,
        typer.Option("--no-optimize", help="Stop after the four steps of Lamata et al. (2014)."),
    ] = False,
    overwrite: Overwrite = False,
    debug: Debug = False,
) -> None:
    """Fit a mesh to a mask and write it with its report.

    Ends with 0 only if the mesh is valid; if it is not, nothing is written.
    """
    with errors_reported(debug):
        from heartgen.fields import rule_from_text
        from heartgen.images.selecting import Selection
        from heartgen.options import Options, direction_from_text, elements_from_text

        check_folder(out)
        options = Options(
            lod=lod,
            elements=None if elements is None else elements_from_text(elements),
            ventricles=cast("Any", ventricles),  # Options refuses words it does not know
            truncate=_truncation(truncate),
            base=cast("Any", base),
            enhance=not no_enhance,
            optimize=not no_optimize,
            quality=quality,
            min_jacobian_ratio=min_jacobian_ratio,
            transmural_grading=not no_grading,
            apex=cast("Any", apex),
            hole_radius=hole_radius,
            insertion=cast("Any", insertion),
            transmural_lines=cast("Any", transmural_lines),
            basis=cast("Any", basis),
            slice_alignment=cast("Any", slice_alignment),
            septal_direction=None
            if septal_direction is None
            else direction_from_text(septal_direction),
        )
        chosen = _fields(fields)
        rule = None if fiber_angles is None else rule_from_text(fiber_angles)
        selection = Selection(tuple(label or ()), labels, rv_wall, frame)
        heart = selection.read(mask, ventricles)
        check_results(out, heart, overwrite)
        views = [selection.read(path, ventricles, view=True) for path in view or ()]
        result = _personalized([heart, *views], options)
        with written_together(out) as folder:
            result.write(folder, fields=chosen, rule=rule)


@app.command(epilog=EPILOG)
def inspect(
    mask: MaskPath,
    picture: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="PICTURE", help="Picture of three slices."),
    ] = Path("inspect.png"),
    ventricles: Ventricles = "auto",
    truncate: Truncate = "auto",
    label: Label = None,
    labels: Labels = None,
    rv_wall: RvWall = None,
    frame: Frame = None,
    debug: Debug = False,
) -> None:
    """Show what is in a mask: what the checks found, what the shape analysis sees."""
    with errors_reported(debug):
        from heartgen.anatomy import analyze_under
        from heartgen.cli.tables import console, show_anatomy, show_image
        from heartgen.files import replacing
        from heartgen.images.selecting import Selection
        from heartgen.options import Options
        from heartgen.viewing import draw_slices

        check_picture(picture)
        options = Options(truncate=_truncation(truncate), ventricles=cast("Any", ventricles))
        image = Selection(tuple(label or ()), labels, rv_wall, frame).read(mask, ventricles)
        show_image(image)
        anatomy = analyze_under(image, options)
        show_anatomy(anatomy)
        with replacing(picture) as temporary:
            draw_slices(image, anatomy).savefig(temporary, dpi=DPI)
        console.print(f"Picture: {picture}", markup=False, highlight=False, soft_wrap=True)


@app.command()
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
        from heartgen.options import Options
        from heartgen.viewing import view_html

        check_folder(out)
        heart = samples.load(sample)
        check_results(out, heart.mask, overwrite)
        errors.print(heart.description, style="dim", markup=False, soft_wrap=True)
        result = _personalized([heart.mask], Options())
        with written_together(out) as folder:
            write_mask(heart.mask, folder / "mask.nii.gz")
            result.write(folder)
            with errors.status("making the page"):
                view_html(result, folder / "index.html")
        typer.echo(f"Open {out / 'index.html'} in a browser.")


@app.command()
def dashboard(
    host: Annotated[
        str, typer.Option(metavar="HOST", help="Address to serve on; 0.0.0.0 for all.")
    ] = "localhost",
    port: Annotated[
        int | None,
        typer.Option(
            metavar="PORT", min=1, max=65535, show_default=False, help="8888 or the next free one."
        ),
    ] = None,
    token: Annotated[
        str | None,
        typer.Option(
            metavar="WORD",
            show_default=False,
            help="Word that visitors have to know; made up if others can reach the page.",
        ),
    ] = None,
    base_url: Annotated[
        str, typer.Option(metavar="PATH", help="Where the page is, behind a proxy: /x/.")
    ] = "/",
    no_browser: NoBrowser = False,
    debug: Debug = False,
) -> None:
    """Serve the dashboard: mask in, mesh out, in a browser."""
    with errors_reported(debug):
        from heartgen.serving.server import Address, serve

        base = f"/{base_url.strip('/')}/".replace("//", "/")
        serve(Address(host, port, token, base, browser=not no_browser))


@app.callback(invoke_without_command=True)
def _version(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, help="Show the version and end.")
    ] = False,
) -> None:
    """Answer ``--version``."""
    if version:
        typer.echo(f"heartgen {__version__}")
        raise typer.Exit


def _personalized(images: list[Mask], options: Options) -> Personalization:
    """Run the pipeline under progress bars, show the report, refuse a mesh that is not valid."""
    from heartgen.cli.tables import show_report, step_bars
    from heartgen.pipeline import personalize

    with step_bars() as progress:
        result = personalize(images, options, progress=progress)
    show_report(result.report)
    if not result.report.quality.valid:
        raise MeshError(
            f"{images[0].name}: the mesh is not valid ({result.report.quality.faults}), so nothing "
            "was written: try a lower level of detail or other numbers of elements, and look at "
            "the mask with heartgen inspect"
        )
    return result


def _fields(text: str) -> tuple[str, ...]:
    """Names of fields; all or none of them by one word."""
    from heartgen.fields import FIELDS
    from heartgen.fields.catalog import check_names

    words = {"all": tuple(FIELDS), "none": ()}
    return words[text] if text in words else check_names(text.split(","))


def _truncation(text: str) -> Any:
    """A distance in mm, or a word: `Options` refuses those it does not know."""
    try:
        return float(text)
    except ValueError:
        return text
