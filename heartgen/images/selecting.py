"""What of an image is the myocardium, as users write it on a command line or in a table."""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import Any

from heartgen.errors import InputError
from heartgen.images.mask import Mask
from heartgen.images.reading import read_heart
from heartgen.images.schemes import label_from_text, scheme_from_text
from heartgen.images.taking import Taking
from heartgen.images.ventricles import RV_WALL


@dataclass(frozen=True)
class Selection:
    """What of an image is the myocardium.

    Attributes
    ----------
    label : tuple of str
        Numbers or names of its labels; empty for a binary image.
    labels : str or None
        A scheme of labels, as `scheme_from_text` reads it, if the image is a label map.
    rv_wall : float or None
        Thickness of a right ventricular wall that has to be built, mm; only with `labels`.
    frame : str or None
        Which frame of a cine: its number from 1, ``ED`` or ``ES``.
    """

    label: tuple[str, ...] = ()
    labels: str | None = None
    rv_wall: float | None = None
    frame: str | None = None

    def __post_init__(self) -> None:
        if self.labels is not None and self.label:
            raise InputError(
                "--label and --labels were both given: name the label of the myocardium, or say "
                "what all labels are"
            )
        if self.labels is None and self.rv_wall is not None:
            raise InputError("--rv-wall needs a label map: say what its labels are: --labels")

    def read(self, path: str | PathLike[str], ventricles: str = "auto", view: bool = False) -> Mask:
        """Read a mask, or the myocardium of a label map.

        Parameters
        ----------
        path : path-like
            As of `heartgen.read_mask`.
        ventricles : {"auto", "lv", "biv"}
            Which to take from a label map.
        view : bool
            As of `heartgen.read_mask`.

        Returns
        -------
        Mask

        Raises
        ------
        InputError
            If no heart can be meshed from the file.
        """
        which: Any = ventricles  # the reader refuses words it does not know
        taking = Taking(
            label=[*map(label_from_text, self.label)] or None,
            scheme=None if self.labels is None else scheme_from_text(self.labels),
            ventricles=which,
            rv_wall=RV_WALL if self.rv_wall is None else self.rv_wall,
            frame=self.frame,
        )
        return read_heart(path, taking, view=view)
