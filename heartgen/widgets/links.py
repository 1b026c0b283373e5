"""Links that carry a sample and options, so that who follows one sees the same."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, urlencode

from heartgen.errors import InputError
from heartgen.options import OPTIONS, as_text
from heartgen.options.text import setting_from_text
from heartgen.widgets.run_options import changed_options

if TYPE_CHECKING:
    from heartgen.options import Options

SAMPLE, RUN = "sample", "run"
"""What a link may say beside the names of options."""


@dataclass(frozen=True)
class Link:
    """What a link asks for.

    Attributes
    ----------
    sample : str
        Name of a sample; empty for the usual one.
    choices : dict of str to object
        Values of options.
    run : bool
        Whether to fit the mesh at once.
    """

    sample: str = ""
    choices: dict[str, Any] = field(default_factory=dict)
    run: bool = False

    @property
    def empty(self) -> bool:
        """Whether it asks for nothing."""
        return not (self.sample or self.choices or self.run)

    @classmethod
    def read(cls, query: str) -> Link:
        """Read what follows the question mark of an address; what others put there is left alone.

        Parameters
        ----------
        query : str
            Of the address.

        Raises
        ------
        InputError
            If a value is none of its option, or there is no such sample.
        """
        from heartgen.samples import names

        told = dict(parse_qsl(query, keep_blank_values=True))
        sample = told.get(SAMPLE, "")
        if sample and sample not in names():
            raise InputError(f"The link asks for the sample {sample[:40]!r}, which is not there.")
        choices = dict(setting_from_text(k, v) for k, v in told.items() if k in OPTIONS)
        return cls(sample, choices, told.get(RUN, "0") not in ("", "0", "no"))


def query_of(sample: str, options: Options, run: bool) -> str:
    """What follows the question mark of a link.

    Parameters
    ----------
    sample : str
        Name of a sample; empty if the input is none.
    options : Options
        All that are not heartgen's defaults are told.
    run : bool
        Whether to fit the mesh at once.

    Examples
    --------
    >>> from heartgen.options import Options
    >>> query_of("biv", Options(lod=3), True)
    'sample=biv&lod=3&run=1'
    """
    told = {SAMPLE: sample} if sample else {}
    told |= {name: as_text(value) for name, value in changed_options(options).items()}
    return urlencode(told | ({RUN: "1"} if run else {}))
