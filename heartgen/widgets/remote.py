"""What a service does for the page: fits that are made there, and models of its library."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
from traitlets import List, Unicode

from heartgen.errors import Cancelled, HeartgenError
from heartgen.images.schemes import KEPT
from heartgen.options import STEPS
from heartgen.saved_result import keep_mask
from heartgen.widgets.input_case import InputCase
from heartgen.widgets.run_options import changed_options
from heartgen.widgets.runs import Make, Outcome, Run
from heartgen.widgets.work_state import WorkState

if TYPE_CHECKING:
    from heartgen.anatomy import Anatomy
    from heartgen.client import Client
    from heartgen.images import Mask
    from heartgen.mesh import HexMesh
    from heartgen.report import Report
    from heartgen.result import Personalization
    from heartgen.widgets.runs import Progress
    from heartgen.widgets.session import Session

VOXEL = 1.5
"""Size of the voxels in which a model of the library is drawn, mm: as fine as masks usually are."""

MARGIN = 3
"""Empty voxels around it."""

MOST = 50
"""Models that are listed."""

FILES = ("exf",)
"""Formats in which meshes are fetched: the one that holds them to the last digit."""

DRAWN = (
    "A model of the library: its mask is not published, so the mask that is shown is drawn from "
    "the mesh, and the distance between them says nothing."
)


@dataclass(frozen=True)
class Address:
    """A service, and what it knows the visitor by.

    Attributes
    ----------
    url : str
        Of the service.
    token : str
        Empty where none is needed.
    """

    url: str
    token: str = ""

    def client(self) -> Client:
        """Whoever asks it."""
        from heartgen.client import Client

        return Client(self.url.strip(), self.token.strip() or None)


class Remote(WorkState):
    """A service beside a session.

    Parameters
    ----------
    session : Session
        The visitor's work.

    Attributes
    ----------
    models : list of dict
        What the last search found, as the service tells it.
    found : str
        How many there are, in words.
    """

    models: List[dict[str, Any]] = List()
    found = Unicode("")

    def __init__(self, session: Session) -> None:
        super().__init__(session.post)
        self.session = session

    def send(self, address: Address) -> Future[None]:
        """Have the heart fitted by a service, with the choices of the moment.

        Parameters
        ----------
        address : Address
            Of the service.

        Raises
        ------
        HeartgenError
            If there is no input, the choices contradict each other, or there is no such address.
        """
        return self.session.start(make=fit_there(address.client()))

    def search(self, address: Address, words: str = "") -> Future[None]:
        """Look for models of a library.

        Parameters
        ----------
        address : Address
            Of the service.
        words : str
            All of them have to be there; the latest models if empty.
        """
        return self._worker.do(
            "searching the library",
            lambda: address.client().search(words.strip(), limit=MOST),
            self._take_models,
        )

    def open(self, address: Address, identifier: str) -> Future[None]:
        """Fetch a model of a library and look at it.

        Parameters
        ----------
        address : Address
            Of the service.
        identifier : str
            Of the model.
        """
        return self._worker.do(
            f"fetching {identifier}",
            lambda: fetched(address.client(), identifier),
            self._take_result,
        )

    def _take_models(self, found: dict[str, Any]) -> None:
        total = found["total"]
        self.models = found["models"]
        listed = f", the first {len(self.models)} are listed" if total > len(self.models) else ""
        self.found = f"{total} {'model' if total == 1 else 'models'}{listed}"

    def _take_result(self, made: tuple[InputCase, Personalization]) -> None:
        """Put a result in the list of runs, and show it."""
        case, result = made
        session, options = self.session, result.options
        run = Run(case, options, number=session.next_number(), levels=(options.lod,), phase="done")
        run.seconds = sum(result.report.seconds.values())
        run.outcomes = (Outcome(run.number, case, result, run),)
        if session.keeping is not None:
            session.keeping.keep_results(run, (result,))
        session.outcomes = [*session.outcomes, *run.outcomes]
        session.shown = None  # so that the page turns to it
        session.show(run.outcomes[0])
        session.runs = [*session.runs, run]


def fit_there(client: Client) -> Make:
    """How a run has its mesh made by a service.

    Parameters
    ----------
    client : Client
        Of the service.
    """

    def make(run: Run, anatomy: Anatomy | None, progress: Progress) -> Sequence[Personalization]:
        with TemporaryDirectory(prefix="heartgen-") as place:
            mask = run.case.mask
            if run.case.views:
                raise HeartgenError(
                    "the service takes one image of a heart: fit one with further views here"
                )
            sent = keep_mask(mask, Path(place))
            selection = {} if mask.blood is None else {"labels": KEPT.name}
            chosen = changed_options(replace(run.options, lod=run.levels[0]))
            title = run.case.name[-200:]
            job = client.submit(sent, selection=selection, title=title, **chosen)
            try:
                client.wait(job, progress=_told_to(run, progress))
            except Cancelled:
                client.cancel(job)
                raise
            result = fetched_result(lambda folder: client.download(job, folder, FILES), mask)
            vars(result)["report"] = told_of(mask, result.report)
            return [result]

    return make


def told_of(mask: Mask, report: Report) -> Report:
    """A report with what was seen here when the mask was read: a service is sent what came of that.

    Parameters
    ----------
    mask : Mask
        Of the fit.
    report : Report
        From a service.
    """
    seen = {finding.message for finding in mask.findings}
    more = tuple(finding for finding in report.findings if finding.message not in seen)
    return replace(
        report, name=mask.name, findings=(*mask.findings, *more), mask_source=mask.source
    )


def fetched_result(fetch: Callable[[Path], Any], mask: Mask | None = None) -> Personalization:
    """A result that was computed elsewhere, with what the page shows of it.

    Parameters
    ----------
    fetch : callable
        Called with an empty folder; puts the files of the result there.
    mask : Mask, optional
        Of the fit; one is drawn from the mesh if omitted.
    """
    from heartgen.result import Personalization

    with TemporaryDirectory(prefix="heartgen-") as place:
        fetch(Path(place))
        result = Personalization.load(place, mask)
    if mask is None:
        vars(result)["mask"] = drawn(result.mesh, result.report.name)
    _ = result.anatomy  # measured now, in the thread, not when the page draws it
    return result


def fetched(client: Client, identifier: str) -> tuple[InputCase, Personalization]:
    """A model of a library, and the mask that it looks like.

    Parameters
    ----------
    client : Client
        Of the service.
    identifier : str
        Of the model.
    """
    result = fetched_result(lambda folder: client.download_model(identifier, folder, None, FILES))
    vars(result)["mask"] = mask = replace(result.mask, name=identifier)
    code = f"heartgen.Client({client.url!r}).download_model({identifier!r}, 'model')"
    return InputCase(mask, code, result.report.mask_sha256, DRAWN), result


def drawn(mesh: HexMesh, name: str) -> Mask:
    """A mask that a mesh fills.

    Parameters
    ----------
    mesh : HexMesh
        mm, world (LPS).
    name : str
        Of the mask.
    """
    from heartgen.images import Mask
    from heartgen.mesh.rasterization import rasterize

    points = np.asarray(mesh.to_pyvista().points)
    low, high = points.min(0) - MARGIN * VOXEL, points.max(0) + MARGIN * VOXEL
    affine = np.diag([VOXEL, VOXEL, VOXEL, 1.0])
    affine[:3, 3] = low
    shape = tuple(int(n) for n in np.ceil((high - low) / VOXEL) + 1)
    return Mask(rasterize(mesh, shape, affine) > 0, affine, name)


def _told_to(run: Run, progress: Progress) -> Callable[[dict[str, Any]], None]:
    """What takes a job, as the service tells it, and tells a run; steps gone by are done."""
    ended: set[str] = set()

    def tell(job: dict[str, Any]) -> None:
        run.raise_if_stopped()
        step = job["step"]
        at = STEPS.index(step) if step in STEPS else 0
        for past in STEPS[: len(STEPS) if job["state"] == "done" else at]:
            if past not in ended:
                ended.add(past)
                progress(past, 1.0)
        if step in STEPS and step not in ended and job["progress"] < 1:
            progress(step, job["progress"])

    return tell
