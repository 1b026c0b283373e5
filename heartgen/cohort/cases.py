"""Which hearts: all masks of a folder or a table, or the one of a file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from heartgen.cohort.case import WHOLE, Case
from heartgen.cohort.case_tables import TABLES, cases_of_table
from heartgen.errors import InputError
from heartgen.images.file_kinds import ENDINGS, stem
from heartgen.images.folder import is_one_heart
from heartgen.images.selecting import Selection

NAME = re.compile(r"[^/\\\0-\x1f:*?\"<>|.][^/\\\0-\x1f:*?\"<>|]*")
"""A name that every system accepts for a folder, and that hides none."""

LONGEST = 200
"""Bytes of the name of a folder; systems take 255, and what is written beside it adds some."""


def find_cases(place: Path, selection: Selection = WHOLE) -> list[Case]:
    """Find the cases of a folder, of a table, or the one of a file.

    Parameters
    ----------
    place : Path
        A folder: every image in it and below is a case, and so is every folder below it of DICOM
        files or with a file for each structure of a heart; the first folder below is its group. A
        table, as of `cases_of_table`: every row is a case. Whatever else: an image.
    selection : Selection
        What of an image is the myocardium, where there is no table that says it.

    Returns
    -------
    list of Case
        By name, or in the order of the table.

    Raises
    ------
    InputError
        If there are no cases, or a row of the table is not as it has to be.
    """
    place = place.absolute()  # workers may have another folder of their own
    if place.is_dir() and not is_one_heart(place):
        cases = [_case_in(place, path, selection) for path in sorted(_images(place))]
        if not cases:
            raise InputError(
                f"{place}: there is no image in this folder whose name ends in "
                f"{', '.join(ENDINGS)}: give another, or a table with a column 'mask'"
            )
    elif place.suffix.lower() in TABLES:
        cases = cases_of_table(place, selection)
    else:
        cases = [Case(stem(place), place, selection=selection)]
    check_names(cases)
    return cases


def check_names(cases: Sequence[Case]) -> None:
    """Refuse names that cannot be those of folders, and names given twice.

    Parameters
    ----------
    cases : sequence of Case
        Of a cohort.
    """
    seen: dict[str, str] = {}
    for case in cases:
        if not all(NAME.fullmatch(part) for part in case.name.split("/")):
            raise InputError(f"case {case.name!r} cannot be the name of a folder: give another")
        longest = max(len(part.encode()) for part in case.name.split("/"))
        if longest > LONGEST:
            raise InputError(
                f"case {case.name[:40]}... has a name of {longest} bytes, more than the {LONGEST} "
                "that the name of a folder may have: give it another, in a column 'case' of a table"
            )
        if case.name.lower() in seen:
            raise InputError(
                f"cases {seen[case.name.lower()]!r} and {case.name!r} have the same name: give "
                "them others, in a column 'case' of a table"
            )
        seen[case.name.lower()] = case.name


def _images(folder: Path) -> Iterator[Path]:
    """Images in a folder and below; one below with DICOM files or structures counts as one."""
    for path in folder.iterdir():
        if path.name.startswith("."):
            continue
        if path.is_dir():
            dicom = any(file.suffix.lower() == ".dcm" for file in path.iterdir())
            yield from [path] if dicom or is_one_heart(path) else _images(path)
        elif path.name.lower().endswith(tuple(ENDINGS)):
            yield path


def _case_in(folder: Path, path: Path, selection: Selection) -> Case:
    """The case of an image in a folder."""
    *above, _ = path.relative_to(folder).parts
    return Case("/".join([*above, stem(path)]), path, above[0] if above else "", selection)
