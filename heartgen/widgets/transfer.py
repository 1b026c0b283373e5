"""Between page and kernel: files in and out, a text to the clipboard, and a sign of life."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO

import anywidget
from traitlets import Bool, Float, Int, Unicode

WEB = Path(__file__).parent / "web"

PIECE = 2 * 1024 * 1024
"""Bytes sent at a time: well below the 10 MB at which Jupyter's server drops a message."""

NAME_LENGTH = 120
"""Letters of a file name that are kept, its end."""

MEGABYTE = 1024.0 * 1024.0


class Upload(anywidget.AnyWidget):
    """A drop zone; what arrives is written into a folder.

    Parameters
    ----------
    folder : Path
        Where files are written.
    limit : int
        Bytes of the largest file that is taken.
    arrived : callable
        Called with the path of a file.
    refused : callable
        Called with a sentence.
    shown : callable
        Called when the drop zone is on the page.
    **traits : str
        First values of ``title``, what is written on it, ``name``, what it is called for those who
        do not see it, and ``zone``, its CSS class.
    """

    _esm = WEB / "upload.js"
    limit = Int(0).tag(sync=True)
    piece = Int(PIECE).tag(sync=True)
    title = Unicode("Upload a file").tag(sync=True)
    name = Unicode("Upload a mask or label map").tag(sync=True)
    zone = Unicode("hg-drop").tag(sync=True)

    def __init__(
        self,
        folder: Path,
        limit: int,
        arrived: Callable[[Path], None],
        refused: Callable[[str], None],
        shown: Callable[[], None] = lambda: None,
        **traits: str,
    ) -> None:
        super().__init__(limit=limit, **traits)
        self._folder, self._arrived, self._refused = folder, arrived, refused
        self._shown = shown
        self._file: BinaryIO | None = None
        self._path = folder
        self._size = self._received = self._count = 0
        self.on_msg(self._hear)

    def _hear(self, _: Any, message: dict[str, Any], buffers: list[Any]) -> None:
        """A message of the browser."""
        try:
            self._obey(message, buffers)
        except OSError as error:
            self._end()
            self._refused(
                f"the upload cannot be kept ({error.strerror or error}): try a smaller file"
            )

    def _obey(self, message: dict[str, Any], buffers: list[Any]) -> None:
        kind = message.get("kind")
        if kind == "shown":
            self._shown()
        elif kind == "refused" or (kind == "begin" and int(message["size"]) > self.limit):
            self.send({"kind": "end"})
            self._refused(
                f"{message['name']} has {int(message['size']) / MEGABYTE:.0f} MB, more than the "
                f"{self.limit / MEGABYTE:.0f} MB that are taken here: crop it to the heart, or "
                "save it compressed (.nii.gz)"
            )
        elif kind == "begin":
            self._begin(str(message["name"]), int(message["size"]))
        elif kind == "piece" and self._file is not None and buffers:
            self._take(bytes(buffers[0]))

    def _begin(self, name: str, size: int) -> None:
        """Make room: one upload at a time is kept."""
        self._end(tell=False)
        shutil.rmtree(self._folder / f"upload-{self._count}", ignore_errors=True)
        self._count += 1
        folder = self._folder / f"upload-{self._count}"
        folder.mkdir(parents=True)
        self._path = folder / safe_name(name)
        self._file = self._path.open("wb")
        self._size, self._received = size, 0
        self._go_on()

    def _take(self, piece: bytes) -> None:
        assert self._file is not None
        if self._received + len(piece) > self._size:
            self._end()
            self._refused(f"{self._path.name} is longer than announced: try again")
            return
        self._file.write(piece)
        self._received += len(piece)
        self._go_on()

    def _go_on(self) -> None:
        """Ask for the next piece, or hand over what has arrived."""
        if self._received < self._size:
            self.send({"kind": "next", "offset": self._received})
            return
        self._end()
        self._arrived(self._path)

    def _end(self, tell: bool = True) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None
        if tell:
            self.send({"kind": "end"})


class Download(anywidget.AnyWidget):
    """A button that asks for a file to be made, and saves it.

    Parameters
    ----------
    make : callable
        Called to have the file made.
    **traits : object
        First values of the attributes.
    """

    _esm = WEB / "download.js"
    title = Unicode("Download").tag(sync=True)
    hint = Unicode("").tag(sync=True)
    busy = Bool(False).tag(sync=True)
    disabled = Bool(True).tag(sync=True)

    def __init__(self, make: Callable[[], None], **traits: Any) -> None:
        super().__init__(**traits)
        self._make = make
        self.on_msg(self._hear)

    def hand_over(self, name: str, content: bytes) -> None:
        """Have the browser save a file.

        Parameters
        ----------
        name : str
            Of the file.
        content : bytes
            Of the file.
        """
        self.send({"kind": "file", "name": name}, buffers=[content])
        self.busy = False

    def _hear(self, _: Any, message: dict[str, Any], __: Any) -> None:
        """The click."""
        if message.get("kind") == "make" and not self.busy and not self.disabled:
            self.busy = True
            self._make()


class Copy(anywidget.AnyWidget):
    """A button that copies a text."""

    _esm = WEB / "copy.js"
    text = Unicode("").tag(sync=True)


class Pulse(anywidget.AnyWidget):
    """Tells the visitor when the kernel behind the page has ended; until then it is not seen.

    Parameters
    ----------
    **traits : object
        First values of the attributes.
    """

    _esm = WEB / "pulse.js"
    interval = Float(5.0).tag(sync=True)  # seconds between two questions
    patience = Float(30.0).tag(sync=True)  # seconds without an answer: it may just be busy

    def __init__(self, **traits: Any) -> None:
        super().__init__(**traits)
        self.on_msg(lambda *_: self.send({"kind": "here"}))


def safe_name(name: str) -> str:
    """A file name without folders, control characters or undue length.

    Parameters
    ----------
    name : str
        As a browser gives it.
    """
    last = PurePosixPath(name.replace("\\", "/")).name
    kept = "".join(c for c in last if c.isprintable()).strip().lstrip(".")
    return kept[-NAME_LENGTH:] or "upload"
