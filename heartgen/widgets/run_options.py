"""What the user chooses before a run, as traits that know no widget."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from traitlets import Any as AnyTrait
from traitlets import HasTraits

from heartgen.options import OPTIONS, Options

_Declared: Any = type(
    "_Declared", (HasTraits,), {name: AnyTrait(each.default) for name, each in OPTIONS.items()}
)

OFFERED: Mapping[str, tuple[tuple[int, int], ...]] = {"elements": ((1, 6), (3, 48), (1, 36))}
"""Where the page offers fewer numbers than there are: three times the usual elements, which is
minutes of work, and no fewer than close a ring."""


class RunOptions(_Declared):  # type: ignore[misc]
    """Options of the next run, a trait for each that heartgen has, under its name.

    They may contradict each other for a while; `options` turns them into those of heartgen.
    """

    def options(self) -> Options:
        """Options for heartgen, without those that have no effect beside the others.

        Raises
        ------
        InputError
            If they contradict each other.
        """
        chosen = {name: each for name, each in OPTIONS.items() if each.applies(self)}
        return Options(**{name: getattr(self, name) for name in chosen})


def changed_options(options: Options) -> dict[str, Any]:
    """Those options that are not heartgen's defaults, the level of detail always among them.

    Parameters
    ----------
    options : Options
        Of a run.
    """
    values = {name: getattr(options, name) for name in OPTIONS}
    return {
        name: value
        for name, value in values.items()
        if name == "lod" or value != OPTIONS[name].default
    }
