"""Named phantoms for demonstrations, notebooks and tests; the same at every call."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from scipy.spatial.transform import Rotation

from heartgen.errors import InputError
from heartgen.samples.biv_phantom import biv
from heartgen.samples.phantoms import ideal_cup, lifelike_lv
from heartgen.samples.sample import Sample

NOISE = 0.25
"""Share of the boundary voxels flipped in the noisy phantom: a careless manual segmentation."""

DILATED = 1.25
"""Width of the dilated right ventricle against the normal one."""

TILT = 12.0
"""Tilt of the base of the two ventricles in a chest, degrees."""

CHEST_ANGLES = (-50.0, -35.0, 25.0)
"""Turns about x, y and z, degrees: the long axis points left, forward and down as in a chest."""

CORONAL = ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
"""Columns are the index axes of a coronal image in the world (LPS): left, down, back."""

CORONAL_SPACING = (1.25, 1.25, 2.0)
"""Pixel size and slice distance of the tilted phantom's coronal image, mm."""

STACK_SPACING = (1.4, 1.4, 8.0)
"""Pixel size and slice distance of a clinical short-axis stack, mm."""


def names(ventricles: int | None = None) -> tuple[str, ...]:
    """Names of the phantoms that `load` knows.

    Parameters
    ----------
    ventricles : {1, 2} or None
        Only hearts with so many ventricles; None for all.

    Examples
    --------
    >>> from heartgen import samples
    >>> samples.names(ventricles=2)
    ('biv', 'dilated_rv', 'thick_lv', 'biv_tilted')
    """
    makers = {1: _LEFT, 2: _BOTH, None: _LEFT | _BOTH}
    if ventricles not in makers:
        raise InputError(f"Samples have 1 or 2 ventricles, not {ventricles}.")
    return tuple(makers[ventricles])


def load(name: str) -> Sample:
    """Make a phantom by name.

    Parameters
    ----------
    name : str
        One of `names`.

    Returns
    -------
    Sample
        Its mask carries the name.

    Raises
    ------
    InputError
        If there is no phantom of that name.

    Examples
    --------
    >>> from heartgen import samples
    >>> sample = samples.load("lifelike")
    >>> sample.mask.name, sample.mask.spacing.tolist()
    ('lifelike', [1.0, 1.0, 1.0])
    """
    makers = _LEFT | _BOTH
    if name not in makers:
        raise InputError(f"There is no sample {name!r}; choose one of {', '.join(makers)}.")
    sample = makers[name]()
    return replace(sample, mask=replace(sample.mask, name=name))


def _in_chest(make: Callable[..., Sample], **sizes: float) -> Sample:
    """Heart as it lies in a chest, on a coarser coronal image."""
    rotation = Rotation.from_euler("xyz", CHEST_ANGLES, degrees=True).as_matrix()
    sample = make(CORONAL_SPACING, rotation=rotation, direction=CORONAL, **sizes)
    return replace(sample, description=f"As in a chest, on coronal slices: {sample.description}")


def _described(sample: Sample, description: str) -> Sample:
    """Sample with a description of its own."""
    return replace(sample, description=description)


_LEFT: dict[str, Callable[[], Sample]] = {
    "ideal": ideal_cup,
    "lifelike": lifelike_lv,
    "papillary": lambda: lifelike_lv(papillary=True, trabeculae=True),
    "valves": lambda: lifelike_lv(valves=True),
    "noisy": lambda: lifelike_lv(noise=NOISE),
    "tilted": lambda: _in_chest(lifelike_lv),
    "stack": lambda: _described(
        lifelike_lv(STACK_SPACING), "As in a clinical stack: few thick short-axis slices."
    ),
}

_BOTH: dict[str, Callable[[], Sample]] = {
    "biv": biv,
    "dilated_rv": lambda: _described(
        biv(rv_size=DILATED, rv_wall=5.0, septum=9.0),
        "Both ventricles, the right one dilated and its wall thickened as under high pressure.",
    ),
    "thick_lv": lambda: _described(
        biv(radius=18.0, lv_wall=15.0, septum=17.0),
        "Both ventricles, the left one narrow in a thick wall, with the thicker septum of a "
        "hypertrophic heart.",
    ),
    "biv_tilted": lambda: _in_chest(biv, tilt=TILT),
}
