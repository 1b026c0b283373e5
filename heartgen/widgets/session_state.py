"""What the page of one visitor shows: panels observe it, and the session changes it."""

from __future__ import annotations

from traitlets import Any, Bool, Dict, HasTraits, Instance, Int, List, Unicode

from heartgen.widgets.run_options import RunOptions
from heartgen.widgets.runs import Outcome, Run, Waiting


class SessionState(HasTraits):
    """The state of one visitor's page.

    Attributes
    ----------
    case : Case or None
    anatomy : Anatomy or None
        Of the case, under the choices of the moment.
    reading : str
        What is being read or measured; empty when nothing is.
    complaint : str
        Why the last input was refused, or its heart cannot be measured.
    awaited : bool
        An input was asked for that is not the case: it is being read, or was refused.
    offer : str
        Scheme of labels by which a file that was refused as a mask can be read.
    origin : dict of str to str
        Where the input that was asked for last comes from, as of `InputCase`.
    choices : RunOptions
    runs : list of Run
        The newest last.
    outcomes : list of Outcome
        Every mesh of every run.
    shown : Outcome or None
        The one that is looked at, judged and taken away.
    against : Outcome or None
        Another mesh of the heart, with which the shown one is compared.
    taken : str
        What was downloaded last.
    cursor : (3,) tuple or None
        A point of the heart that was clicked in a slice or in the 3-D view, mm, world (LPS).
    states : dict of str to StepState
    hearts : list of dict of str to str
        Where the hearts come from that were uploaded at once, as of `InputCase`.
    queue : list of Waiting
        Hearts that wait to be read and fitted.
    unkept : str
        Why what is done is not written down at the moment; empty if it is.
    refused : list of str
        Why hearts of several were not read.
    ahead : bool
        Fit the other levels of detail of a run after it.
    ahead_of : str
        Those that are being fitted; empty if none are.
    """

    case = Any(None, allow_none=True)
    anatomy = Any(None, allow_none=True)
    reading = Unicode("")
    complaint = Unicode("")
    awaited = Bool(False)
    offer = Unicode("")
    origin = Dict()
    choices = Instance(RunOptions)
    runs: List[Run] = List()
    outcomes: List[Outcome] = List()
    shown = Any(None, allow_none=True)
    against = Any(None, allow_none=True)
    taken = Unicode("")
    cursor = Any(None, allow_none=True)
    states = Dict()
    hearts: List[dict[str, str]] = List()
    queue: List[Waiting] = List()
    unkept = Unicode("")
    refused: List[str] = List()
    ahead = Bool(True)
    ahead_of = Unicode("")
    cost_revision = Int(0)
