"""A session in one file, to be kept by the visitor and opened again, here or elsewhere."""

from __future__ import annotations

import ast
import io
import re
import zipfile
from pathlib import Path

from heartgen.errors import InputError
from heartgen.widgets.keeping.jobs import ENDED, read_json
from heartgen.widgets.keeping.packing import MOST
from heartgen.widgets.keeping.store import STATE, Store

ENDING = ".heartgen"
"""Of the name of a file that holds a session."""

HELD = re.compile(
    r"session\.json"
    r"|cases/\d+/(about\.json|mask\.pack|views\.pack|measured-[0-9a-f]{16}\.pack)"
    r"|jobs/\d+(-others)?/(job\.json|ended\.json|lod-[1-5]\.pack)"
)
"""Files of a session's folder that belong into it: not what was uploaded, nor what goes on."""

CALLS = (
    "heartgen.read_mask",
    "heartgen.read_labels",
    "heartgen.samples.load",
    "heartgen.Client",
)
"""What the expressions that give a mask in Python call."""


def saved(store: Store) -> bytes:
    """All that was done in a session, without the files that were uploaded.

    Parameters
    ----------
    store : Store
        Of the session.
    """
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for file in sorted(store.folder.rglob("*")):
            name = file.relative_to(store.folder).as_posix()
            if HELD.fullmatch(name) and _is_whole(file):
                archive.write(file, name)
    return buffer.getvalue()


def open_saved(path: Path, store: Store) -> None:
    """Put a session that was saved into the folder of a new one.

    Parameters
    ----------
    path : Path
        The file.
    store : Store
        Of the new session.

    Raises
    ------
    InputError
        If the file is none, or holds what no session has.
    """
    refusal = f"{path.name}: This is no session that heartgen saved"
    try:
        with zipfile.ZipFile(path) as archive:
            infos = [info for info in archive.infolist() if HELD.fullmatch(info.filename)]
            if STATE not in (info.filename for info in infos):
                raise InputError(f"{refusal}: choose a file that ends in {ENDING}.")
            if sum(info.file_size for info in infos) > MOST:
                raise InputError(f"{path.name}: This session is too large to be opened here.")
            for info in infos:
                archive.extract(info, store.folder)
    except (zipfile.BadZipFile, OSError, EOFError) as error:
        raise InputError(f"{refusal}, or it is damaged ({error}): save it again.") from error
    for about in store.folder.glob("cases/*/about.json"):
        _check_code(str(read_json(about).get("code")), path.name)


def _is_whole(file: Path) -> bool:
    """Whether a file is none of a job that goes on: who opens it would not go on with it."""
    return file.parent.parent.name != "jobs" or (file.parent / ENDED).is_file()


def _check_code(code: str, name: str) -> None:
    """Refuse Python that does more than read images: the page hands it out to be run."""
    try:
        reads = _reads(ast.parse(code, mode="eval").body)
    except (SyntaxError, ValueError, RecursionError):
        reads = False
    if not reads:
        raise InputError(f"{name}: This session holds code that heartgen did not write.")


def _reads(node: ast.expr) -> bool:
    """Whether an expression reads images, by names and numbers alone."""
    if isinstance(node, ast.List):
        return all(map(_reads, node.elts))
    if isinstance(node, ast.Attribute):
        return node.attr == "mask" and _reads(node.value)
    if not isinstance(node, ast.Call):
        return False
    for given in (*node.args, *(keyword.value for keyword in node.keywords)):
        ast.literal_eval(given)  # raises ValueError where it is more than a value
    called = node.func
    if isinstance(called, ast.Attribute) and called.attr == "download_model":
        return _reads(called.value)
    return ast.unparse(called) in CALLS
