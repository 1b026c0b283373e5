"""Tables of cases: CSV, TSV or Parquet, a row for each."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from heartgen.cohort.case import Case
from heartgen.errors import InputError
from heartgen.images.file_kinds import stem
from heartgen.images.selecting import Selection
from heartgen.options import OPTIONS, setting_from_text

TABLES = (".csv", ".tsv", ".parquet")
"""How the names of tables end."""

COLUMNS = ("mask", "case", "group", "labels", "label", "rv_wall", "frame")
"""Columns but for the options; only the first is needed."""


def cases_of_table(path: Path, selection: Selection) -> list[Case]:
    """Read a table of cases.

    Parameters
    ----------
    path : Path
        The column ``mask`` holds paths, relative to the table; ``case`` holds names, ``group``
        groups; ``labels``, ``label`` (``2+3`` for several), ``rv_wall`` and ``frame`` what
        ``heartgen fit`` takes; any other column is named after an option. Cells may be empty.
    selection : Selection
        What of an image is the myocardium, where its row says nothing about labels.

    Returns
    -------
    list of Case
        In the order of the table.

    Raises
    ------
    InputError
        If it cannot be read, or a row is not as it has to be.
    """
    rows = _rows(path)
    if not rows or "mask" not in rows[0]:
        raise InputError(f"{path}: there is no column 'mask' with the paths of masks: add one")
    options = sorted(OPTIONS)
    unknown = [name for name in rows[0] if name not in options and name not in COLUMNS]
    if unknown:
        raise InputError(
            f"{path}: column {unknown[0]!r} is not known: name columns {', '.join(COLUMNS)}, or "
            f"after an option: {', '.join(options)}"
        )
    cases = []
    for number, row in enumerate(rows, start=1):
        cells = {name: cell.strip() for name, cell in row.items() if cell.strip()}
        try:
            cases.append(_case(path.parent, cells, selection))
        except InputError as error:
            raise InputError(f"{path}, row {number}: {error}") from error
    return cases


def _case(folder: Path, cells: dict[str, str], selection: Selection) -> Case:
    """The case of a row, of which only cells that hold something are given."""
    if "mask" not in cells:
        raise InputError("there is no mask: give its path")
    mask = folder / cells["mask"]
    if {"labels", "label", "rv_wall"} & cells.keys():
        selection = Selection(
            tuple(cells["label"].split("+")) if "label" in cells else (),
            cells.get("labels"),
            _thickness(cells.get("rv_wall")),
            selection.frame,
        )
    if "frame" in cells:
        selection = replace(selection, frame=cells["frame"])
    choices = dict(setting_from_text(n, cell) for n, cell in cells.items() if n not in COLUMNS)
    name = cells.get("case", stem(mask))
    return Case(name, mask, cells.get("group", ""), selection, choices)


def _thickness(text: str | None) -> float | None:
    """Millimeters."""
    try:
        return None if text is None else float(text)
    except ValueError:
        raise InputError(f"rv_wall {text!r} is not a number: give mm") from None


def _separator(path: Path) -> str:
    """What parts the cells: spreadsheets with decimal commas write CSV with semicolons."""
    if path.suffix.lower() == ".tsv":
        return "\t"
    with path.open(encoding="utf-8") as file:
        head = file.readline()
    return ";" if head.count(";") > head.count(",") else ","


def _rows(path: Path) -> list[dict[str, str]]:
    """Rows as texts by column."""
    import pandas as pd

    try:
        if path.suffix.lower() == ".parquet":
            table = pd.read_parquet(path)
            table = table.map(lambda cell: "" if pd.isna(cell) else str(cell))
        else:
            table = pd.read_csv(path, sep=_separator(path), dtype=str, keep_default_na=False)
    except (OSError, ValueError) as error:  # those of pandas and pyarrow are ValueErrors, too
        reason = " ".join(str(error).split())
        raise InputError(
            f"{path}: the table cannot be read ({reason}): give CSV, TSV or Parquet"
        ) from error
    return [{str(k).strip(): str(v) for k, v in row.items()} for row in table.to_dict("records")]
