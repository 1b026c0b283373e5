"""Many hearts: `batch` meshes a cohort, `sweep` compares options, `write_report` shows both."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from heartgen.errors import needing

if TYPE_CHECKING:
    from heartgen.cohort.batch_report import write_report
    from heartgen.cohort.batching import batch
    from heartgen.cohort.case import Case
    from heartgen.cohort.cases import find_cases
    from heartgen.cohort.store import read_results
    from heartgen.cohort.sweeping import sweep
    from heartgen.cohort.workers import Workers

__all__ = ["Case", "Workers", "batch", "find_cases", "read_results", "sweep", "write_report"]

_HOMES = {
    "Case": "case",
    "Workers": "workers",
    "batch": "batching",
    "find_cases": "cases",
    "read_results": "store",
    "sweep": "sweeping",
    "write_report": "batch_report",
}

NEEDED = ("pandas", "pyarrow", "filelock", "dask", "distributed")
"""Packages of the extra ``cohort``."""


def __getattr__(name: str) -> Any:
    """Load a public name, or say which packages are missing for it."""
    if name not in _HOMES:
        raise AttributeError(f"module 'heartgen.cohort' has no attribute {name!r}")
    with needing("cohorts need", "cohort"):
        for package in NEEDED:
            import_module(package)
        return getattr(import_module(f"heartgen.cohort.{_HOMES[name]}"), name)
