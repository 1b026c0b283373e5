"""A case: the mask to be meshed, where it came from, and how Python gets at it again."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from heartgen.errors import HeartgenError, InputError, notes_of
from heartgen.wording import worded_for

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.images import Mask
    from heartgen.options import Options

BLOCK = 1 << 20
"""Bytes that are hashed at a time."""

BINARY = "binary"
"""Scheme of a file that is no label map."""

AUTO = "auto"
"""Scheme of a label map that says by its labels which it is."""

VIEWS = "views"
"""Part of an input's origin: files of further views."""

FILES = ("file", VIEWS)
"""Parts of an input's origin that are paths, one in each line."""


@dataclass(frozen=True, eq=False)
class InputCase:
    """A mask to be meshed.

    Attributes
    ----------
    mask : Mask
        The myocardium, in the world (LPS).
    code : str
        A Python expression that gives the mask.
    sha256 : str
        Of the file, or of the voxels and the affine of a sample.
    description : str
        One sentence, of samples.
    origin : dict of str to str
        Name of the ``sample``; or ``file``, ``scheme`` and ``frame`` as of `load_file`, and its
        ``views``, a path in each line.
    views : tuple of Mask
        Further views of the heart, such as long-axis slices, of a mask that is a stack.
    """

    mask: Mask
    code: str
    sha256: str
    description: str = ""
    origin: Mapping[str, str] = field(default_factory=dict)
    views: tuple[Mask, ...] = ()

    @property
    def name(self) -> str:
        """Name of the mask."""
        return self.mask.name


def name_unlike(name: str, taken: Collection[str]) -> str:
    """A name that tells one from the others: the given one, or that with a number.

    Parameters
    ----------
    name : str
        That is wanted.
    taken : collection of str
        Names of the others.
    """
    found, n = name, 1
    while found in taken:
        n += 1
        found = f"{name} ({n})"
    return found


class LabelMapError(InputError):
    """A file was read as a mask, and is a label map.

    Parameters
    ----------
    error : InputError
        Why it is no mask.
    scheme : str
        By which it can be read, as of `load_file`.
    """

    def __init__(self, error: InputError, scheme: str) -> None:
        super().__init__(str(error))
        self.scheme = scheme
        for note in notes_of(error):
            self.add_note(note)


@dataclass(frozen=True)
class SampleGroup:
    """Samples under a heading: names of the catalog, and what they are called.

    Attributes
    ----------
    title : str
        The heading.
    names : dict of str to str
        What samples are called, by their names in the catalog.
    """

    title: str
    names: dict[str, str]


SAMPLES = (
    SampleGroup(
        "Left ventricle",
        {
            "lifelike": "Lifelike",
            "ideal": "Ideal ellipsoid",
            "papillary": "With papillary muscles",
            "valves": "With valve anatomy",
            "noisy": "Careless segmentation",
            "tilted": "Oblique coronal slices",
            "stack": "Clinical short-axis stack",
        },
    ),
    SampleGroup(
        "Both ventricles",
        {
            "biv": "Lifelike",
            "dilated_rv": "Dilated right ventricle",
            "thick_lv": "Thick left ventricle",
            "biv_tilted": "Oblique coronal slices",
        },
    ),
)
"""In the order in which they are offered; samples added to the catalog appear by themselves."""


def sample_choices() -> tuple[tuple[str, str], ...]:
    """Title and name of every sample of the catalog."""
    from heartgen.samples import names

    titles = {
        name: f"{group.title} · {title.lower()}"
        for group in SAMPLES
        for name, title in group.names.items()
    }
    known = names()
    ordered = [name for name in titles if name in known]
    others = [name for name in known if name not in titles]
    return tuple((titles.get(name, name), name) for name in (*ordered, *others))


def load_sample(name: str) -> InputCase:
    """Make a sample of the catalog.

    Parameters
    ----------
    name : str
        In the catalog of `heartgen.samples`.
    """
    from heartgen import samples

    sample = samples.load(name)
    digest = hashlib.sha256(sample.mask.voxels.tobytes() + sample.mask.affine.tobytes())
    code = f"heartgen.samples.load({name!r}).mask"
    return InputCase(sample.mask, code, digest.hexdigest(), sample.description, {"sample": name})


def paths_of(origin: Mapping[str, str]) -> list[str]:
    """Files of an input's origin.

    Parameters
    ----------
    origin : dict of str to str
        As of `InputCase`.
    """
    return [line for name in FILES for line in origin.get(name, "").splitlines()]


def with_paths(origin: Mapping[str, str], change: Callable[[str], str]) -> dict[str, str]:
    """An input's origin with other paths, such as from another folder.

    Parameters
    ----------
    origin : dict of str to str
        As of `InputCase`.
    change : callable
        Gives the new path of each.
    """
    named = {name: origin[name].splitlines() for name in FILES if name in origin}
    return {**origin, **{name: "\n".join(map(change, each)) for name, each in named.items()}}


def load_origin(origin: Mapping[str, str]) -> InputCase:
    """Read what an input came from.

    Parameters
    ----------
    origin : dict of str to str
        With a ``file``, as of `InputCase`.
    """
    views = origin.get(VIEWS, "").splitlines()
    return load_file(
        Path(origin["file"]), origin["scheme"], origin["frame"], tuple(map(Path, views))
    )


@worded_for("page")
def load_file(
    path: Path, scheme: str = BINARY, frame: str = "", views: Sequence[Path] = ()
) -> InputCase:
    """Read a mask or a label map.

    Parameters
    ----------
    path : Path
        The file.
    scheme : str
        ``"binary"``, the name of a scheme of labels, ``"auto"``, or roles as on the command line.
    frame : str
        Of a cine: number of the frame from 1, ``"ED"`` or ``"ES"``; empty for one volume.
    views : sequence of Path
        Files with further views of the heart, read alike.

    Returns
    -------
    InputCase

    Raises
    ------
    InputError
        With one sentence that says what is wrong, where, and what to do; a `LabelMapError` where
        the file is a label map that would be read as such.
    """
    mask, code = _read(path, scheme, frame)
    origin = {"file": str(path), "scheme": scheme, "frame": frame}
    if not views:
        return InputCase(mask, code, _digest(path), origin=origin)
    further = [_read(view, scheme, frame, view=True) for view in views]
    names = ", ".join(view.name for view in views)
    return InputCase(
        mask,
        f"[{', '.join([code, *(each for _, each in further)])}]",
        _digest(path),
        f"With further views of the heart: {names}.",
        {**origin, VIEWS: "\n".join(map(str, views))},
        tuple(each for each, _ in further),
    )


def _read(path: Path, scheme: str, frame: str, view: bool = False) -> tuple[Mask, str]:
    """What is in a file, and the Python expression that reads it."""
    from heartgen import read_labels, read_mask
    from heartgen.images.schemes import scheme_from_text

    chosen = frame.strip() or None
    told = "" if chosen is None else f", frame={chosen!r}"
    told += ", view=True" if view else ""
    if scheme != BINARY:
        labeling = scheme_from_text(scheme)
        mask = read_labels(path, labeling, frame=chosen, view=view)
        return _nowhere(mask), f"heartgen.read_labels({path.name!r}, {labeling!r}{told})"
    try:
        mask = read_mask(path, frame=chosen, view=view)
    except InputError as error:
        if _is_label_map(path, chosen, view):
            raise LabelMapError(error, AUTO) from error
        raise
    return _nowhere(mask), f"heartgen.read_mask({path.name!r}{told})"


def _nowhere(mask: Mask) -> Mask:
    """A mask whose source is the name of its file: where uploads lie here is nobody's business."""
    if mask.source is None:
        return mask
    return replace(mask, source={**mask.source, "path": Path(mask.source["path"]).name})


def _is_label_map(path: Path, frame: str | None, view: bool) -> bool:
    """Whether a file can be read as a label map of a known scheme."""
    from heartgen import read_labels

    try:
        read_labels(path, AUTO, frame=frame, view=view)
    except HeartgenError:
        return False
    return True


@worded_for("page")
def analyze_case(case: InputCase, options: Options) -> Anatomy:
    """Measure the heart in a case, as the pipeline will.

    Parameters
    ----------
    case : InputCase
        The input.
    options : Options
        Of the pipeline.
    """
    from heartgen.anatomy import analyze_under, with_views

    return with_views(analyze_under(case.mask, options), case.views)


def _digest(path: Path) -> str:
    """SHA-256 of a file, or of all files of a folder by name."""
    digest = hashlib.sha256()
    for file in sorted(path.iterdir()) if path.is_dir() else [path]:
        if not file.is_file():
            continue
        with file.open("rb") as stream:
            while block := stream.read(BLOCK):
                digest.update(block)
    return digest.hexdigest()
