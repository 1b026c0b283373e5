"""What the page of one visitor shows: panels observe it, and the session changes it."""

from __future__ import annotations

from traitlets import Any, Bool, Dict, HasTraits, Instance, Int, List, Unicode

from heartgen.widgets.run_options import RunOptions
from heartgen.widgets.runs import Outcome, Run


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
    """

    case = Any(None, allow_none=True)
    anatomy = Any(None, allow_none=True)
    reading = Unicode("")
    complaint = Unicode("")
    awaited = Bool(False)
    offer = Unicode("")
    choices = Instance(RunOptions)
    runs: List[Run] = List()
    outcomes: List[Outcome] = List()
    shown = Any(None, allow_none=True)
    against = Any(None, allow_none=True)
    taken = Unicode("")
    cursor = Any(None, allow_none=True)
    states = Dict()
    cost_revision = Int(0)
