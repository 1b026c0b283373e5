"""What the commands show in the terminal: progress, findings, anatomy, report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.columns import Columns
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn
from rich.table import Table
from rich.text import Text

from heartgen import clock
from heartgen.anatomy import Anatomy
from heartgen.cli.outcome import errors
from heartgen.cohort.summary import Summary
from heartgen.comparison import Comparison
from heartgen.images import Finding, Mask
from heartgen.options import STEPS
from heartgen.report import Report
from heartgen.viewing.card import Section, number, sections, verdict
from heartgen.viewing.states import changes, headline, states

console = Console()

STYLES = {"good": "bold green", "doubtful": "bold yellow", "bad": "bold red"}
"""Of a verdict, by its level."""

DIRECTIONS = (("left", "right"), ("posterior", "anterior"), ("superior", "inferior"))
"""Where the axes of the world (LPS) point, and away from where."""

SLANTED = 0.3
"""Component of a unit vector from which its direction is worth a word (17 degrees)."""

ML = 1000.0
"""mm^3 in a milliliter."""


@contextmanager
def step_bars() -> Iterator[clock.Progress]:
    """Show a bar for each step of the pipeline.

    Yields
    ------
    callable
        To be handed to `heartgen.personalize` as its `progress`.
    """
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TaskProgressColumn(),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=errors) as bars:
        tasks = {step: bars.add_task(step, total=1.0, start=False) for step in STEPS}

        def show(step: str, done: float) -> None:
            bars.start_task(tasks[step])
            bars.update(tasks[step], completed=done)

        try:
            yield show
        except BaseException:
            _leave_off(bars)
            raise


def _leave_off(bars: Progress) -> None:
    """After a failure: say at which step, and leave out those that never began."""
    for task in bars.tasks:
        if not task.started:
            bars.update(task.id, visible=False)
        elif not task.finished:
            bars.stop_task(task.id)
            bars.update(task.id, description=f"{task.description}: stopped")


def show_report(report: Report) -> None:
    """Show all measures, what was noticed on the way, and the verdict.

    Parameters
    ----------
    report : Report
        Of a fitted mesh.
    """
    judged = verdict(report)
    console.print()
    console.print(Columns([_table(section) for section in sections(report)], padding=(0, 3)))
    _show_findings(report.findings)
    sentence = Text.assemble((report.name, "bold"), ": ", (judged.text, STYLES[judged.level]))
    console.print(sentence, soft_wrap=True)


def show_comparison(comparison: Comparison) -> None:
    """Show what a heart ejects, its strains, and the indices of each state.

    Parameters
    ----------
    comparison : Comparison
        A heart in several states.
    """
    console.print()
    console.print(Columns([_table(part) for part in changes(comparison)], padding=(0, 3)))
    shown = states(comparison)
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("")
    for name in shown.names:
        table.add_column(Text(name), justify="right")
    for measure, values in shown.rows:
        table.add_row(Text(measure), *map(Text, values))
    console.print(table)
    for note in comparison.notes:
        console.print(Text(note, "yellow"), soft_wrap=True)
    console.print(Text(headline(comparison), "bold"), soft_wrap=True)


def show_image(mask: Mask) -> None:
    """Show how the image is made, and what its checks found.

    Parameters
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    """
    shape = " × ".join(map(str, mask.voxels.shape))
    spacing = " × ".join(f"{s:.4g}" for s in mask.spacing)
    axis = mask.stack_axis
    stack = "no" if axis is None else f"along {'ijk'[axis]}, {int(mask.planes.sum())} with data"
    rows = (
        ("voxels", shape),
        ("voxel size", f"{spacing} mm"),
        ("stack of slices", stack),
        ("volume of the mask", f"{number(mask.volume / ML)} ml"),
    )
    console.print(Text(mask.name, style="bold"))
    console.print(_table(Section("Image", rows)))
    if not mask.findings:
        console.print("The checks of the image found nothing to mend.")
    _show_findings(mask.findings)


def show_anatomy(anatomy: Anatomy) -> None:
    """Show what the shape analysis measured.

    Parameters
    ----------
    anatomy : Anatomy
        The patient's heart, measured.
    """
    cut = anatomy.base.truncation
    sizes = (
        ("length of the cavity", f"{number(anatomy.length)} mm"),
        ("radius of the cavity", f"{number(anatomy.radius)} mm"),
        ("wall at mid-height", f"{number(anatomy.wall_thickness)} mm"),
        ("wall at the apex", f"{number(anatomy.apex_thickness)} mm"),
        ("blood pool", f"{number(anatomy.pool_volume / ML)} ml"),
        ("myocardium", f"{number(anatomy.wall_volume / ML)} ml"),
    )
    place = (
        ("from apex to base", _direction(anatomy.frame[:3, 2])),
        (
            "wider side" if anatomy.rv is None else "from left to right ventricle",
            _direction(anatomy.frame[:3, 0]),
        ),
        ("center of the base", f"{_vector(anatomy.frame[:3, 3], 1)} mm"),
        ("rim irregularity", f"{number(anatomy.base.irregularity)} mm"),
        ("truncation", "none" if cut is None else f"{number(cut)} mm below the basal plane"),
    )
    console.print(_table(Section("Left ventricle", sizes)))
    if anatomy.rv is not None:
        low, high = np.degrees(anatomy.rv.insertion)
        right = (
            ("free wall", f"{number(anatomy.rv.wall_thickness)} mm"),
            ("septum", f"{number(anatomy.rv.septal_thickness)} mm"),
            ("blood pool", f"{number(anatomy.rv.pool_volume / ML)} ml"),
            ("lowest point", f"{number(-anatomy.rv.apex_level)} mm below the base"),
            ("width", f"{number(anatomy.rv.width)} mm"),
            ("seen from the left one", f"from {low:.0f} to {high:.0f} degrees"),
        )
        console.print(_table(Section("Right ventricle", right)))
    console.print(_table(Section("Place in the world (LPS)", place)))
    _show_findings(anatomy.findings)


def _show_findings(findings: tuple[Finding, ...]) -> None:
    """A table of what checks saw, if they saw anything."""
    if not findings:
        return
    table = Table(box=box.SIMPLE_HEAD, title="Findings", title_justify="left", title_style="bold")
    table.add_column("check", no_wrap=True)
    table.add_column("what was seen and done")
    for finding in findings:
        table.add_row(Text(finding.check), Text(finding.message))
    console.print(table)


def _table(section: Section) -> Table:
    """A titled table of names and values."""
    table = Table(
        box=box.SIMPLE,
        title=section.title,
        title_justify="left",
        title_style="bold",
        show_header=False,
        pad_edge=False,
    )
    table.add_column()
    table.add_column(justify="right")
    for name, value in section.rows:
        table.add_row(Text(name), Text(value))
    return table


def _direction(unit: NDArray[np.float64]) -> str:
    """A direction in words, the strongest first, and in numbers."""
    words = [
        DIRECTIONS[axis][int(unit[axis] < 0)]
        for axis in np.argsort(-np.abs(unit))
        if abs(unit[axis]) >= SLANTED
    ]
    return f"{', '.join(words)} {_vector(unit, 2)}"


def _vector(components: NDArray[np.float64], digits: int) -> str:
    """Three numbers in brackets."""
    return "({})".format(", ".join(f"{c:.{digits}f}" for c in components))


def show_summaries(summaries: Sequence[Summary]) -> None:
    """Show what the groups of a cohort came to.

    Parameters
    ----------
    summaries : sequence of Summary
        One for each group.
    """
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("", no_wrap=True)
    for head in (
        "cases",
        "success",
        "valid",
        "failed",
        "error",
        "worst",
        "Q",
        "worst",
        "wriggle",
        "worst",
    ):
        table.add_column(head, justify="right", no_wrap=True)
    for group in summaries:
        counts = (group.cases, group.successes, group.valid, group.failures)
        figures = [""] * 6
        if group.error is not None and group.quality is not None:
            error, quality = group.error, group.quality
            shown = (error.median, error.largest, quality.median, quality.least)
            figures[:4] = [f"{figure:.3f}" for figure in shown]
        if group.wriggle is not None:
            figures[4:] = [f"{group.wriggle.median:.0f}", f"{group.wriggle.largest:.0f}"]
        table.add_row(Text(group.name), *map(str, counts), *figures)
    console.print(table)
    console.print(
        "Medians and worst cases; errors are mean distances, in mm; wriggle is that of the "
        "longitudinal lines, in degrees.",
        style="dim",
    )
