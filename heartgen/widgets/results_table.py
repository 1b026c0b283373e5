"""All meshes of a session as a table of the same columns that `heartgen batch` writes."""

from __future__ import annotations

from collections.abc import Iterable

from heartgen.widgets.runs import Outcome


def results_csv(outcomes: Iterable[Outcome]) -> str:
    """A row for each mesh.

    Parameters
    ----------
    outcomes : iterable of Outcome
        Of all runs.
    """
    from heartgen.cohort.case import Case
    from heartgen.cohort.rows import row_of, table_of

    rows = []
    for outcome in outcomes:
        name = (outcome.source.name if outcome.source else "") or outcome.case.name
        case = Case(f"{outcome.run}/{name}", outcome.case.mask)
        rows.append(row_of(case, outcome.case.sha256, outcome.result.report))
    return str(table_of(rows).to_csv(index=False))
