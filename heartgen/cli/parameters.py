"""Arguments and options that several commands have, under one name and with one help."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from heartgen import GLOSSARY
from heartgen.renamed import new_flags

EPILOG = f"Words and their units: {GLOSSARY}"
"""Last line of the help."""


class Group(TyperGroup):
    """Commands under one name, whose help shows flags without a type."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The group's own parameters.

        Parameters
        ----------
        ctx : typer.Context
            Of the command.
        """
        return _without_types(super().get_params(ctx))


class TakesFormerFlags(Group):
    """Commands that take flags under their former names, too."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the command line.

        Parameters
        ----------
        ctx : typer.Context
            Of the command.
        args : list of str
            The command line.
        """
        return super().parse_args(ctx, new_flags(args))


class Command(TyperCommand):
    """A command whose help shows flags without a type."""

    def get_params(self, ctx: Any) -> list[Any]:
        """The command's parameters.

        Parameters
        ----------
        ctx : typer.Context
            Of the command.
        """
        return _without_types(super().get_params(ctx))


def _without_types(parameters: list[Any]) -> list[Any]:
    """Parameters of which flags show no type in the help: they take no value."""
    for each in parameters:
        if getattr(each, "is_flag", False):
            each.metavar = ""
    return parameters


MaskPath = Annotated[
    Path,
    typer.Argument(
        metavar="MASK",
        show_default=False,
        help="NIfTI, NRRD, MetaImage; a DICOM segmentation or structure set, as a file or a "
        "folder; or a folder with a file for each structure.",
    ),
]
Views = Annotated[
    list[Path] | None,
    typer.Option(
        "--view",
        metavar="MASK",
        show_default=False,
        help="A further view of the heart in MASK, such as a long-axis slice, if that is a "
        "short-axis stack; may be repeated.",
    ),
]
Label = Annotated[
    list[str] | None,
    typer.Option(
        "--label",
        metavar="N",
        show_default=False,
        help="What is myocardium in a label image, by number or name; may be repeated.",
    ),
]
Labels = Annotated[
    str | None,
    typer.Option(
        "--labels",
        metavar="SCHEME",
        show_default=False,
        help="Read a label map: acdc, mmwhs, ukbb, mnms, emidec, totalsegmentator, auto, or roles "
        "such as lv_myocardium=2,lv_pool=3 (also rv_pool, rv_myocardium).",
    ),
]
Frame = Annotated[
    str | None,
    typer.Option(
        "--frame",
        metavar="N|ED|ES",
        show_default=False,
        help="Which frame of a cine: its number from 1, or the one with the largest (ED) or the "
        "smallest (ES) cavity of the left ventricle.",
    ),
]
RvWall = Annotated[
    float | None,
    typer.Option(
        "--rv-wall",
        metavar="MM",
        show_default=False,
        help="Thickness of the right ventricular wall if --labels has none; 3 mm if not given.",
    ),
]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace results of another heart in OUT.")
]
Debug = Annotated[bool, typer.Option("--debug", help="Show where in the code an error arose.")]
NoBrowser = Annotated[bool, typer.Option("--no-browser", help="Do not open it.")]
