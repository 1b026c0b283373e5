"""The commands: read the options, run, show, write.

What takes long to import is imported inside the commands, so that ``heartgen --help`` is instant.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from heartgen import __version__
from heartgen.cli.outcome import appearing_together, check_folder, check_picture, errors, told
from heartgen.errors import InputError, MeshError

if TYPE_CHECKING:
    from heartgen.images import Mask
    from heartgen.pipeline import Options, Personalization

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="From a binary mask of the myocardium to a personalised cubic Hermite mesh.",
)

DPI = 150
"""Of the picture of `inspect`, dots per inch: 1800 pixels across."""

MaskPath = Annotated[
    Path,
    typer.Argument(
        metavar="MASK",
        show_default=False,
        help="NIfTI, NRRD, MetaImage; or a DICOM segmentation, as a file or a folder.",
    ),
]
Labels = Annotated[
    list[str] | None,
    typer.Option(
        "--label",
        metavar="N",
        show_default=False,
        help="What is myocardium in a label image, by number or name; may be repeated.",
    ),
]
Truncate = Annotated[
    str,
    typer.Option(
        metavar="auto|off|MM",
        help="Cut the base below the basal plane: where valves rise, never, or by so much.",
    ),
]
Debug = Annotated[bool, typer.Option("--debug", help="Show where in the code an error arose.")]


@app.command()
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
    lod: Annotated[
        int,
        typer.Option(min=1, max=5, help="Level of detail: 1, most stable, to 5, most accurate."),
    ] = 1,
    elements: Annotated[
        str,
        typer.Option(metavar="RxCxL", help="Elements, radial x circumferential x longitudinal."),
    ] = "1x12x6",
    truncate: Truncate = "auto",
    label: Labels = None,
    depth: Annotated[
        str,
        typer.Option(
            metavar="graded|linear",
            help="Parametrisation across the wall: for even elements, or proportional.",
        ),
    ] = "graded",
    no_enhance: Annotated[
        bool, typer.Option("--no-enhance", help="Leave out the step that straightens elements.")
    ] = False,
    debug: Debug = False,
) -> None:
    """Fit a mesh to a mask and write it with its report.

    Ends with 0 only if the mesh is valid; if it is not, nothing is written.
    """
    with told(debug):
        from heartgen.images import read_mask
        from heartgen.pipeline import Options

        check_folder(out)
        options = Options(
            lod=lod,
            elements=_elements(elements),
            truncate=_truncation(truncate),
            enhance=not no_enhance,
            depth=cast("Any", depth),  # Options refuses words it does not know
        )
        result = _personalized(read_mask(mask, label=_labels(label)), options)
        with appearing_together(out) as folder:
            result.write(folder)


@app.command()
def inspect(
    mask: MaskPath,
    picture: Annotated[
        Path,
        typer.Option("-o", "--out", metavar="PICTURE", help="Picture of three slices."),
    ] = Path("inspect.png"),
    truncate: Truncate = "auto",
    label: Labels = None,
    debug: Debug = False,
) -> None:
    """Show what is in a mask: what the checks found, what the shape analysis sees."""
    with told(debug):
        from heartgen.anatomy import analyse
        from heartgen.cli.tables import console, show_anatomy, show_image
        from heartgen.formats import replacing
        from heartgen.images import read_mask
        from heartgen.pipeline import Options
        from heartgen.viewing import draw_slices

        check_picture(picture)
        options = Options(truncate=_truncation(truncate))
        image = read_mask(mask, label=_labels(label))
        show_image(image)
        anatomy = analyse(image, options.truncate)
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
    debug: Debug = False,
) -> None:
    """Mesh a sample heart, and make a page that shows the result."""
    with told(debug):
        from heartgen import samples
        from heartgen.pipeline import Options
        from heartgen.viewing import view_html

        check_folder(out)
        heart = samples.load(sample)
        errors.print(heart.description, style="dim", markup=False, soft_wrap=True)
        result = _personalized(heart.mask, Options())
        with appearing_together(out) as folder:
            _write_mask(heart.mask, folder / "mask.nii.gz")
            result.write(folder)
            with errors.status("making the page"):
                view_html(result, folder / "index.html")
        typer.echo(f"Open {out / 'index.html'} in a browser.")


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


def _personalized(mask: Mask, options: Options) -> Personalization:
    """Run the pipeline under progress bars, show the report, refuse a mesh that is not valid."""
    from heartgen.cli.tables import show_report, step_bars
    from heartgen.pipeline import personalize

    with step_bars() as progress:
        result = personalize(mask, options, progress=progress)
    show_report(result.report)
    if not result.report.quality.valid:
        bad, of = result.report.quality.invalid_elements, result.mesh.n_elements
        raise MeshError(
            f"{mask.name}: the mesh is not valid in {bad} of {of} elements, so nothing was "
            "written: try a lower level of detail or other numbers of elements, and look at the "
            "mask with heartgen inspect"
        )
    return result


def _elements(text: str) -> tuple[int, int, int]:
    """Three numbers, from 1x12x6."""
    found = re.fullmatch(r"(\d{1,4})[x×](\d{1,4})[x×](\d{1,4})", text.strip().lower())
    if found is None:
        raise InputError(
            f"elements {text!r} are not three numbers: give radial, circumferential and "
            "longitudinal, for example 1x12x6"
        )
    radial, circumferential, longitudinal = map(int, found.groups())
    return radial, circumferential, longitudinal


def _truncation(text: str) -> Any:
    """A distance in mm, or a word: `Options` refuses those it does not know."""
    try:
        return float(text)
    except ValueError:
        return text


def _labels(given: list[str] | None) -> list[int | str] | None:
    """Labels by number where they are numbers, else by name."""
    if not given:
        return None
    return [int(text) if re.fullmatch(r"-?\d+", text) else text for text in given]


def _write_mask(mask: Mask, path: Path) -> None:
    """Write a mask as an image that any viewer opens."""
    import numpy as np
    import SimpleITK

    image: Any = SimpleITK.GetImageFromArray(mask.voxels.astype(np.uint8).transpose(2, 1, 0))
    image.SetSpacing(mask.spacing.tolist())
    image.SetOrigin(mask.affine[:3, 3].tolist())
    image.SetDirection((mask.affine[:3, :3] / mask.spacing).ravel().tolist())
    SimpleITK.WriteImage(image, str(path), useCompression=True)
