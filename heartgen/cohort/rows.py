"""Results as rows of plain values, one for each mesh, and as a table."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict
from typing import TYPE_CHECKING, Any, TypeAlias

from heartgen.options import Options, as_text
from heartgen.viewing.card import Verdict, verdict

if TYPE_CHECKING:
    import pandas as pd

    from heartgen.cohort.case import Case
    from heartgen.images.selecting import Selection
    from heartgen.report import Report

Row: TypeAlias = dict[str, Any]
"""Of a table of results, by column."""

SUCCESS = "success"
"""Status of a case whose mesh is a success by our rule (`Report.success`)."""

FAILED = "failed: "
"""How the status of a case begins that ended without a mesh; the reason follows."""

NO_COLUMNS = (
    "name",
    "mask_sha256",
    "mask_source",
    "options",
    "slices",
    "findings",
    "success",
)
"""Parts of a report that a row has elsewhere, or not at all."""

PARTS = {
    "accuracy": "error",
    "quality": "q",
    "fairness": "fair",
    "unoptimized_fairness": "fair_unoptimized",
    "measurements": "size",
    "versions": "version",
}
"""Parts of a report whose values become columns, and how the names of those begin."""

RENAMED = {
    "error_dice": "dice",
    "q_valid": "valid",
    "q_invalid_elements": "invalid_elements",
    "q_overlapping_elements": "overlapping_elements",
    "unenhanced_quality": "q_unenhanced",
    "unoptimized_quality": "q_unoptimized",
}
"""Columns with a name of their own."""

FIRST = ("case", "group", "status", "success", "valid", "error_mean", "q_mean", "seconds")
"""Columns that a reader looks for first."""


def row_of(case: Case, digest: str, report: Report) -> Row:
    """Everything that a report says, in one row.

    Parameters
    ----------
    case : Case
        The input.
    digest : str
        SHA-256 of what was read.
    report : Report
        Of its mesh.

    Returns
    -------
    dict
        Errors in mm (``error_...``), qualities (``q_...``), fairness in degrees (``fair_...``),
        sizes in mm and ml (``size_...``), seconds, versions, options, findings as one
        text, and ``status``: success, why it is none, or failed and why.
    """
    judged, parts = verdict(report), report.to_dict()
    row = _head(case, digest, report.options) | {
        "status": _status(judged),
        "success": report.success,
        "seconds": round(sum(report.seconds.values()), 3),
        "findings": "; ".join(f"{f.check}: {f.message}" for f in report.findings),
    }
    for name, value in parts.items():
        if name in PARTS:
            row |= _flat(value, PARTS[name])
        elif name == "seconds":
            row |= {f"seconds_{step.replace(' ', '_')}": s for step, s in value.items()}
        elif name not in NO_COLUMNS:
            row |= _flat(value, name) if isinstance(value, Mapping) else {name: _cell(value)}
    return {RENAMED.get(name, name): value for name, value in row.items()}


def failed_row(case: Case, digest: str, options: Options, reason: str) -> Row:
    """The row of a case that ended without a mesh.

    Parameters
    ----------
    case : Case
        The input.
    digest : str
        SHA-256 of what was read; empty if nothing was.
    options : Options
        Of the run.
    reason : str
        A sentence.
    """
    return _head(case, digest, asdict(options)) | {
        "status": FAILED + " ".join(writable(reason).split()),
        "success": False,
        "paper_success": False,
        "valid": False,
    }


def table_of(rows: Iterable[Row]) -> pd.DataFrame:
    """A table with every column that any row has, those that are looked for first in front.

    Parameters
    ----------
    rows : iterable of Row
        As of `row_of`.
    """
    import pandas as pd

    table = pd.DataFrame(list(rows))
    first = [name for name in FIRST if name in table]
    table = table[first + [name for name in table if name not in first]]
    for name in table.columns:
        kinds = {type(value) for value in table[name].dropna()}
        if len(kinds) > 1 and not kinds <= {int, float}:  # Parquet has columns of one type only
            table[name] = table[name].map(as_text, na_action="ignore")
    return table


def _status(judged: Verdict) -> str:
    """How a case ended that has a mesh."""
    if judged.level == "good":
        return SUCCESS
    return FAILED + judged.text if judged.level == "bad" else judged.text


def _head(case: Case, digest: str, options: Mapping[str, Any]) -> Row:
    """What is known of a case beforehand."""
    from heartgen.images import Mask

    source = case.source
    return {
        "case": writable(case.name),
        "group": writable(case.group),
        "mask": writable(source.name if isinstance(source, Mask) else str(source)),
        "sha256": digest,
        **_selected(case.selection),
        **{name: _cell(value) for name, value in options.items()},
    }


def writable(text: str) -> str:
    """A text that every file takes: bytes of a file name that are no letters, as their numbers.

    Parameters
    ----------
    text : str
        Any text.
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


def _selected(selection: Selection) -> Row:
    """What of the file is the myocardium, as in a table of cases."""
    told = {
        "label": "+".join(selection.label) or None,
        "labels": selection.labels,
        "rv_wall": selection.rv_wall,
        "frame": selection.frame,
    }
    return {name: value for name, value in told.items() if value is not None}


def _flat(values: Mapping[str, Any], prefix: str) -> Row:
    """Nested values side by side, their names joined."""
    row: Row = {}
    for name, value in values.items():
        if name == "by_surface":
            row |= _flat(value, prefix)
        elif isinstance(value, Mapping):
            row |= _flat(value, f"{prefix}_{name}")
        elif value is not None:
            row[f"{prefix}_{name}"] = _cell(value)
    return row


def _cell(value: Any) -> Any:
    """A value that fits into a cell."""
    if isinstance(value, (tuple, list)) and all(isinstance(v, (int, float)) for v in value):
        return as_text(value)
    return json.dumps(value) if isinstance(value, (tuple, list)) else value
