"""A visitor's session on the disk: found again by a key that only the visitor's browser knows."""

from __future__ import annotations

import os
import re
import secrets
import shutil
import tempfile
import time
import uuid
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.errors import InputError
from heartgen.widgets.keeping.jobs import Job, read_json, write_json
from heartgen.widgets.keeping.packing import pack, unpack

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.images import Mask

PLACE = "HEARTGEN_SESSIONS"
"""Variable with the folder of all sessions; ``heartgen dashboard`` sets it for its kernels."""

SERVED = "VOILA_REQUEST_URL"
"""Variable that Voila sets for the kernel of a page."""

KEPT_SECONDS = 24 * 3600
"""Time after which a session is removed to which nobody came back."""

KEPT_BYTES = 20_000_000_000
"""Most that all sessions take on the disk; beyond it those go first that were left first."""

LEFT_SECONDS = 90.0
"""Without a sign of life for so long, a page seems closed: one gives them every ten seconds, and
every minute where its tab is hidden."""

HELD_SECONDS = 2 * LEFT_SECONDS
"""The same, before what is kept of it may go."""

KEY = re.compile(r"[A-Za-z0-9_-]{32}")
"""24 random bytes: nobody guesses them."""

STATE, CLAIM, HELD = "session.json", "claim.json", "held"


@dataclass(frozen=True, eq=False)
class Store:
    """The folder of a session.

    Attributes
    ----------
    folder : Path
        Of the session; its name is the key.
    lasting : bool
        Whether it outlives whoever works in it.
    holder : str
        Who works in it, told from others that had the session before or have it now.
    """

    folder: Path
    lasting: bool = True
    holder: str = field(default_factory=lambda: uuid.uuid4().hex)

    @property
    def key(self) -> str:
        """By which the visitor's browser knows it."""
        return self.folder.name

    @property
    def uploads(self) -> Path:
        """Where files of the visitor are written."""
        return self.folder / "uploads"

    def claim(self) -> None:
        """Take the session: whoever had it has it no longer."""
        write_json(self.folder / CLAIM, self.holder)
        self.hold()

    @property
    def mine(self) -> bool:
        """Whether nobody else took the session, and it is still there."""
        return bool(read_json(self.folder / CLAIM) == self.holder)

    def hold(self) -> None:
        """Give a sign that somebody looks at it."""
        with suppress(OSError):
            (self.folder / HELD).touch()

    @property
    def left(self) -> bool:
        """Whether the page was closed, as far as is known."""
        return self.lasting and time.time() - _held(self.folder) > LEFT_SECONDS

    def write(self, state: dict[str, Any]) -> None:
        """Write down how the session stands, unless somebody else has it.

        Parameters
        ----------
        state : dict
            Plain values.
        """
        if self.mine:
            write_json(self.folder / STATE, state)

    def read(self) -> dict[str, Any] | None:
        """How the session stood; None if nothing was done in it.

        Raises
        ------
        InputError
            If what was written is damaged.
        """
        try:
            told = read_json(self.folder / STATE)
        except ValueError:
            raise InputError(
                "The session that was kept here is damaged: open one that you saved, or begin anew."
            ) from None
        return None if told is None else dict(told)

    def job(self, name: str) -> Job:
        """A job of the session.

        Parameters
        ----------
        name : str
            Of its folder.
        """
        return Job(self.folder / "jobs" / name)

    def case(self, number: int) -> Path:
        """Folder of an input.

        Parameters
        ----------
        number : int
            Of the input.
        """
        return self.folder / "cases" / str(number)

    def keep_case(self, mask: Mask, about: dict[str, Any], views: Sequence[Mask] = ()) -> int:
        """Write an input, and give it a number that no other has, whoever writes beside.

        Parameters
        ----------
        mask : Mask
            The myocardium.
        about : dict
            What else is known of it, plain values.
        views : sequence of Mask
            Further views of the heart.
        """
        cases = self.folder / "cases"
        cases.mkdir(exist_ok=True)  # not in a session that was removed
        number = 1
        while True:
            with suppress(FileExistsError):
                self.case(number).mkdir()
                break
            number += 1
        pack(mask, self.mask_file(number))
        if views:
            pack(tuple(views), self.views_file(number))
        write_json(self.case(number) / "about.json", about)
        return number

    def keep_anatomy(self, number: int, name: str, mask: Mask, anatomy: Anatomy) -> None:
        """Write what was measured in an input.

        Parameters
        ----------
        number : int
            Of the input.
        name : str
            Tells under which options.
        mask : Mask
            Of the input.
        anatomy : Anatomy
            What was measured.
        """
        path = self.anatomy_file(number, name)
        if not path.is_file():
            pack(anatomy, path, mask)

    def mask_file(self, number: int) -> Path:
        """File of an input's mask.

        Parameters
        ----------
        number : int
            Of the input.
        """
        return self.case(number) / "mask.pack"

    def views_file(self, number: int) -> Path:
        """File of further views of an input's heart.

        Parameters
        ----------
        number : int
            Of the input.
        """
        return self.case(number) / "views.pack"

    def anatomy_file(self, number: int, name: str) -> Path:
        """File of what was measured in an input.

        Parameters
        ----------
        number : int
            Of the input.
        name : str
            Tells under which options.
        """
        return self.case(number) / f"measured-{name}.pack"

    def load_case(self, number: int) -> tuple[Mask, tuple[Mask, ...], dict[str, Any]]:
        """Read an input, the further views of its heart, and what else is known of it.

        Parameters
        ----------
        number : int
            Of the input.
        """
        file = self.views_file(number)
        views = unpack(file) if file.is_file() else ()
        return unpack(self.mask_file(number)), views, read_json(self.case(number) / "about.json")

    def load_anatomy(self, number: int, name: str, mask: Mask) -> Anatomy | None:
        """Read what was measured in an input; None if it was not under these options.

        Parameters
        ----------
        number : int
            Of the input.
        name : str
            Tells under which options.
        mask : Mask
            Of the input.
        """
        path = self.anatomy_file(number, name)
        found: Anatomy | None = unpack(path, mask) if path.is_file() else None
        return found

    def close(self) -> None:
        """Leave the session; it is removed unless it is to last."""
        if not self.lasting:
            self.remove()

    def remove(self) -> None:
        """Remove everything."""
        shutil.rmtree(self.folder, ignore_errors=True)


def begun() -> Store:
    """A new session, where the visitor may come back to it; elsewhere a folder for the moment."""
    root = place()
    if root is None:
        store = Store(Path(tempfile.mkdtemp(prefix="heartgen-")), lasting=False)
    else:
        with suppress(OSError):
            clean(root)
        store = Store(root / secrets.token_urlsafe(24))
        store.folder.mkdir(mode=0o700)
    store.claim()
    return store


def found(key: str) -> Store | None:
    """The session of a key, if it is still there.

    Parameters
    ----------
    key : str
        That a browser gives.
    """
    root = place()
    if root is None or not KEY.fullmatch(key) or not (root / key).is_dir():
        return None
    return Store(root / key)


def place() -> Path | None:
    """Folder of all sessions; None where pages keep their kernels, as notebooks do."""
    told = os.environ.get(PLACE)
    if told is None and SERVED not in os.environ:
        return None
    user = os.getuid() if hasattr(os, "getuid") else "sessions"
    root = Path(told or Path(tempfile.gettempdir()) / f"heartgen-{user}")
    root.mkdir(mode=0o700, parents=True, exist_ok=True)
    if hasattr(os, "getuid") and root.stat().st_uid != os.getuid():
        return None  # somebody else put it there, to read what is written into it
    return root


def clean(root: Path, most: int = KEPT_BYTES) -> None:
    """Remove sessions that were left long ago, and the oldest where there are too many.

    Parameters
    ----------
    root : Path
        Of all sessions.
    most : int
        Bytes that they may take.
    """
    now = time.time()
    left = sorted(
        (held, folder) for folder in _sessions(root) if now - (held := _held(folder)) > HELD_SECONDS
    )
    sizes = {folder: _size(folder) for folder in _sessions(root)}
    for held, folder in left:
        if now - held > KEPT_SECONDS or sum(sizes.values()) > most:
            shutil.rmtree(folder, ignore_errors=True)
            sizes.pop(folder, None)


def _sessions(root: Path) -> Iterable[Path]:
    return [folder for folder in root.iterdir() if KEY.fullmatch(folder.name)]


def _held(folder: Path) -> float:
    """When there was the last sign of life, seconds."""
    for name in (HELD, "."):
        with suppress(OSError):
            return (folder / name).stat().st_mtime
    return time.time()


def _size(folder: Path) -> int:
    """Bytes of all files of a folder."""
    total = 0
    for at, _, names in os.walk(folder):  # folders that go meanwhile are passed over
        for name in names:
            with suppress(OSError):
                total += os.stat(os.path.join(at, name)).st_size
    return total
