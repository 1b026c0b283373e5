"""Between page and kernel: files in and out, a text to the clipboard, and a sign of life."""

from __future__ import annotations

import shutil
import tempfile
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

OWN = "upload-"
"""Begins the folder of a file."""

MEGABYTE = 1024.0 * 1024.0


class Upload(anywidget.AnyWidget):
    """A drop zone; what arrives is written into a folder.

    Parameters
    ----------
    folder : Path or callable
        Where files are written, or what tells it.
    limit : int
        Bytes of the largest file that is taken.
    arrived : callable
        Called with the path of a file; of the folder with all of them, where there are several.
    refused : callable
        Called with a sentence.
    shown : callable
        Called when the drop zone is on the page.
    in_use : callable
        Tells whether the files of before are still to be read: the next takes their place if not.
    **traits : object
        First values of ``title``, what is written on it, ``name``, what it is called for those who
        do not see it, ``zone``, its CSS class, and
        ``several``, whether several files are taken at once.
    """

    _esm = WEB / "upload.js"
    limit = Int(0).tag(sync=True)
    piece = Int(PIECE).tag(sync=True)
    title = Unicode("Upload a file").tag(sync=True)
    name = Unicode("Upload a mask or label map").tag(sync=True)
    zone = Unicode("hg-drop").tag(sync=True)
    several = Bool(False).tag(sync=True)

    def __init__(
        self,
        folder: Path | Callable[[], Path],
        limit: int,
        arrived: Callable[[Path], None],
        refused: Callable[[str], None],
        shown: Callable[[], None] = lambda: None,
        in_use: Callable[[], bool] = lambda: False,
        **traits: Any,
    ) -> None:
        super().__init__(limit=limit, **traits)
        self._folder: Callable[[], Path] = (lambda: folder) if isinstance(folder, Path) else folder
        self._arrived, self._refused = arrived, refused
        self._shown, self._in_use = shown, in_use
        self._file: BinaryIO | None = None
        self._path = self._place = Path()
        self._left = 0
        self._arrived_files: list[Path] = []
        self._size = self._received = 0
        self.on_msg(self._hear)

    def recall(self, path: Path) -> None:
        """Know an upload of before, which the next takes the place of.

        Parameters
        ----------
        path : Path
            Of a file.
        """
        place = self._folder()
        own = [f for f in path.parents if f.name.startswith(OWN) and f.parent == place]
        self._place = own[0] if own else Path()

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
        elif kind == "unread":
            self._end()
            self._refused(
                f"{message['name']} cannot be read by the browser: of a folder, choose the files "
                "in it, or a zip of it"
            )
        elif kind == "begin":
            self._left = int(message.get("left", 0))
            self._begin(str(message["name"]), int(message["size"]), message.get("first", True))
        elif kind == "piece" and self._file is not None and buffers:
            self._take(bytes(buffers[0]))

    def _begin(self, name: str, size: int, first: bool) -> None:
        """Make room: what was chosen at once is kept, and nothing that was chosen before."""
        self._end(tell=False)
        if first:
            self._arrived_files = []
            self._make_room()
        self._path = self._place / safe_name(name)
        self._file = self._path.open("wb")
        self._size, self._received = size, 0
        self._go_on()

    def _make_room(self) -> None:
        folder = self._folder()
        folder.mkdir(parents=True, exist_ok=True)
        if self._place.name.startswith(OWN) and not self._in_use():
            shutil.rmtree(self._place, ignore_errors=True)
        self._place = Path(tempfile.mkdtemp(prefix=OWN, dir=folder))

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
        self._arrived_files.append(self._path)
        if self._left > 0:
            self._end(tell=False)
            self.send({"kind": "more"})
            return
        self._end()
        several = len(self._arrived_files) > 1
        self._arrived(self._place if several else self._path)

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
    kept = Bool(False).tag(sync=True)  # whether a new page finds what was done

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
