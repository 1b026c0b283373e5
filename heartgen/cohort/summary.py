"""What a cohort came to, group by group."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from heartgen.cohort.rows import FAILED
from heartgen.options import as_text

if TYPE_CHECKING:
    import pandas as pd

LEFT, BOTH, NONE = "left ventricle", "both ventricles", "not meshed"
"""Groups of a cohort that was given none."""

WRIGGLE = "fair_longitudinal_median"
"""Column of the wriggle by which cases are told apart: that of the longitudinal lines, which the
shape of a heart does not ask for."""


@dataclass(frozen=True)
class Spread:
    """Least value, quartiles and largest value of a quantity.

    Attributes
    ----------
    least, low, median, high, largest : float
        In the unit of the quantity.
    """

    least: float
    low: float
    median: float
    high: float
    largest: float


@dataclass(frozen=True)
class Summary:
    """What a group of cases came to.

    Attributes
    ----------
    name : str
        Of the group.
    cases, valid, successes, failures : int
        All; with a mesh proven valid; with one that is a success by the paper's rule (section
        3.5); without a mesh.
    error, quality : Spread or None
        Mean distance from mask to mesh, mm, and mean Jacobian ratio of the cases with a mesh; None
        if there are none.
    wriggle : Spread or None
        Median wriggle of the longitudinal lines, degrees; None also where it was not measured.
    """

    name: str
    cases: int
    valid: int
    successes: int
    failures: int
    error: Spread | None
    quality: Spread | None
    wriggle: Spread | None


def by_options(table: pd.DataFrame, varied: Sequence[str]) -> pd.DataFrame:
    """The table with a group for every combination of the options that had several values.

    Parameters
    ----------
    table : DataFrame
        Of results.
    varied : sequence of str
        Names of options.
    """
    texts = [name + " " + table[name].map(as_text) for name in varied]
    joined = texts[0] if texts else table["case"].map(lambda _: "all")
    for text in texts[1:]:
        joined = joined + ", " + text
    return table.assign(group=joined)


def by_ventricles(table: pd.DataFrame) -> pd.DataFrame:
    """The table with a group for every case: those given, or else the ventricles that were found.

    Cases without a mesh count with the others if these are all of one kind.

    Parameters
    ----------
    table : DataFrame
        Of results.
    """
    if (table["group"] != "").any():
        return table
    kinds = table["group"].mask(meshed(table), LEFT)
    if "size_right_width" in table:
        kinds = kinds.mask(table["size_right_width"].notna(), BOTH)
    known = kinds[kinds != ""].unique()
    rest = known[0] if len(known) == 1 else NONE
    return table.assign(group=kinds.where(kinds != "", rest))


def summarize(table: pd.DataFrame) -> list[Summary]:
    """What the groups of a table of results came to, in the order of the table.

    Parameters
    ----------
    table : DataFrame
        Of results, with groups.
    """
    return [_summary(str(name), part) for name, part in table.groupby("group", sort=False)]


def meshed(table: pd.DataFrame) -> pd.Series:
    """Which cases have a mesh.

    Parameters
    ----------
    table : DataFrame
        Of results.
    """
    return ~table["status"].str.startswith(FAILED)


def reasons(table: pd.DataFrame) -> list[tuple[str, str]]:
    """Cases without a mesh, and why.

    Parameters
    ----------
    table : DataFrame
        Of results.
    """
    failed = table[~meshed(table)]
    return [
        (str(case), str(status).removeprefix(FAILED))
        for case, status in zip(failed["case"], failed["status"], strict=True)
    ]


def _summary(name: str, part: pd.DataFrame) -> Summary:
    """What a group came to."""
    done = part[meshed(part)]
    return Summary(
        name,
        cases=len(part),
        valid=int(part["valid"].sum()),
        successes=int(part["success"].sum()),
        failures=len(part) - len(done),
        error=_spread(done["error_mean"]) if len(done) else None,
        quality=_spread(done["q_mean"]) if len(done) else None,
        wriggle=_spread(done[WRIGGLE].dropna()) if _measured(done, WRIGGLE) else None,
    )


def _measured(done: pd.DataFrame, name: str) -> bool:
    """Whether any case has a figure: results of earlier versions lack some."""
    return name in done and bool(done[name].notna().any())


def _spread(values: pd.Series) -> Spread:
    """Five numbers."""
    return Spread(*(float(v) for v in values.quantile([0, 0.25, 0.5, 0.75, 1])))
