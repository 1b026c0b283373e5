"""What a page tells of its long work: what is being done, and why the last of it failed."""

from __future__ import annotations

from traitlets import HasTraits, Unicode

from heartgen.widgets.runs import Post
from heartgen.widgets.worker import Worker


class WorkState(HasTraits):
    """A state whose long work is done by a `Worker`.

    Parameters
    ----------
    post : callable, optional
        Has a change made where the state lives; at once if omitted.

    Attributes
    ----------
    doing : str
        What is being done; empty when nothing is.
    complaint : str
        Why the last of it failed, or was not even begun.
    """

    doing = Unicode("")
    complaint = Unicode("")

    def __init__(self, post: Post | None = None) -> None:
        super().__init__()
        self._worker = Worker(self._told, post)
        self.folder = self._worker.folder
        self.post = self._worker.post

    def close(self) -> None:
        """Begin no more work, and remove what was uploaded."""
        self._worker.close()

    def refuse(self, sentence: str) -> None:
        """Say why an input was not even read.

        Parameters
        ----------
        sentence : str
            What is wrong, and what to do.
        """
        self.complaint = sentence

    def _told(self, doing: str, complaint: str) -> None:
        """Take in what the worker tells; a complaint stays until something else is done."""
        with self.hold_trait_notifications():
            self.doing = doing
            if complaint or doing:
                self.complaint = complaint
