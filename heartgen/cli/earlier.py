"""Results that are there already: those of the same heart are replaced, others only on demand."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.errors import InputError

if TYPE_CHECKING:
    from heartgen.images import Mask

MESHES = ("mesh.exf", "mesh.vtu")
"""Of a result."""


def check_results(folder: Path, mask: Mask, overwrite: bool) -> None:
    """Refuse a folder with results of another mask, unless they may be replaced.

    Parameters
    ----------
    folder : Path
        May be absent.
    mask : Mask
        To which a mesh is about to be fitted.
    overwrite : bool
        Whether they may be replaced.

    Raises
    ------
    InputError
        If there are such results.
    """
    from heartgen.report import REPORT, mask_sha256

    there = [name for name in (REPORT, *MESHES) if (folder / name).exists()]
    if overwrite or not there:
        return
    report = _read(folder / REPORT)
    if report.get("mask_sha256") == mask_sha256(mask):
        return
    whose = f"of {report['name']}" if report.get("name") else "of an unknown heart"
    raise InputError(
        f"{folder}: There are results {whose} ({', '.join(there)}), and not of this mask: choose "
        "another folder with -o, or have them replaced with --overwrite."
    )


def _read(path: Path) -> dict[str, Any]:
    """What a report says; nothing if it is none."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}
