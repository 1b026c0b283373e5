"""Processes to work in: of this machine, of a running Dask cluster, or of one that is started."""

from __future__ import annotations

import logging
import uuid
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from threading import Event, Thread
from typing import Any, TypeVar

import dask
from dask.system import CPU_COUNT
from distributed import Client, LocalCluster, as_completed
from distributed.scheduler import KilledWorker
from distributed.system import MEMORY_LIMIT

from heartgen.cohort.workers import Workers
from heartgen.errors import HeartgenError, InputError, sentence

DEATH = (
    "its worker died each time it was tried, perhaps because it took more memory than a worker "
    "may have: crop the image to the heart, or work in fewer processes"
)
"""Why there is no result where workers died; the system does not say more."""

ABSENT = (ImportError, AttributeError)
"""What comes of workers that lack heartgen, or have another version of it."""

T = TypeVar("T")
R = TypeVar("R")

TICK = 5.0
"""Seconds between two looks for processes that are missing."""

PATIENCE = "15s"
"""For the scheduler to answer."""

OWN = {
    # Tasks wait at the scheduler: those that wait with a worker that dies would be under suspicion.
    "distributed.scheduler.worker-saturation": 1.0,
    # Nothing of a case outlives it, so a worker that pauses or spills would do so for ever.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    # Nobody looks at what it samples a hundred times a second.
    "distributed.worker.profile.enabled": False,
    "distributed.deploy.lost-worker-timeout": "5s",
}
"""Settings of Dask for the processes of this machine; what takes all its memory is still ended."""


@dataclass(frozen=True)
class Died:
    """What came of a task whose worker died, again and again, or could not take it.

    Attributes
    ----------
    reason : str
        A sentence.
    """

    reason: str


@contextmanager
def connected(workers: Workers, tasks: int) -> Iterator[Client]:
    """Have processes to work in, and no more of one's own than there are tasks.

    Parameters
    ----------
    workers : Workers
        How many and where.
    tasks : int
        How many there are to do.

    Raises
    ------
    HeartgenError
        If there is no such scheduler, or no such cluster.
    """
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters becomes a sentence
    if workers.scheduler is not None:
        with _client(workers.scheduler) as client:
            yield client
        return
    with (
        dask.config.set({} if workers.cluster else OWN),
        _started(workers, tasks) as place,
        Client(place, timeout=PATIENCE) as client,
    ):
        yield client


def each(client: Client, work: Callable[[T], R], jobs: Sequence[T]) -> Iterator[tuple[T, R | Died]]:
    """Jobs and what came of them, as they are done; a job whose worker dies is tried again.

    Parameters
    ----------
    client : Client
        Of dask.
    work : callable
        Top-level function that raises nothing.
    jobs : sequence
        What to work on, one after the other.

    Yields
    ------
    job
    result : object or Died
        `Died` where the worker died every time, or the work raised something all the same.

    Raises
    ------
    HeartgenError
        If the scheduler is lost, or the workers cannot do the work at all.
    """
    batch = uuid.uuid4().hex
    futures = {
        client.submit(work, job, key=("heartgen", batch, n), pure=False): job
        for n, job in enumerate(jobs)
    }
    try:
        ended = as_completed(futures)
        for future in ended:
            if future.status in ("pending", "lost"):  # with the worker that had the result
                ended.add(future)
                continue
            if future.status not in ("finished", "error"):
                raise HeartgenError(
                    "the scheduler was lost: start it again, and give the same command to go on"
                )
            error = future.exception() if future.status == "error" else None
            if error is None:
                yield futures[future], future.result()
            elif isinstance(error, KilledWorker):
                yield futures[future], Died(DEATH)
            elif isinstance(error, ABSENT):
                raise HeartgenError(
                    f"the workers cannot run heartgen ({type(error).__name__}: {error}): install "
                    "there what is installed here"
                )
            else:
                yield futures[future], Died(sentence(error))
            del futures[future]
            future.release()
    finally:
        client.cancel(list(futures), force=True)


@contextmanager
def _client(scheduler: str) -> Iterator[Client]:
    """A client of a running scheduler."""
    file = Path(scheduler)
    where: dict[str, Any] = (
        {"scheduler_file": str(file)} if file.is_file() else {"address": scheduler}
    )
    try:
        client = Client(**where, timeout=PATIENCE)
    except (OSError, ValueError, TypeError) as error:
        raise HeartgenError(
            f"{scheduler}: no scheduler answers there ({error}): give the address that "
            "dask scheduler prints, such as tcp://10.0.0.1:8786, or its file"
        ) from error
    with client:
        yield client


@contextmanager
def _started(workers: Workers, tasks: int) -> Iterator[Any]:
    """A cluster that ends with the block."""
    if workers.cluster is None:
        n = min(workers.jobs or CPU_COUNT, tasks)
        with (
            LocalCluster(
                n_workers=n,
                threads_per_worker=1,
                memory_limit=MEMORY_LIMIT // n,
                processes=True,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            ) as place,
            _kept_at(place, n),
        ):
            yield place
        return
    module, _, name = workers.cluster.rpartition(".")
    try:
        kind = getattr(import_module(module), name)
    except (ImportError, AttributeError, ValueError) as error:
        raise InputError(
            f"there is no cluster {workers.cluster} ({error}): name an installed class, such as "
            "dask_jobqueue.SLURMCluster or dask_kubernetes.operator.KubeCluster"
        ) from error
    with kind() as place:
        if workers.jobs is not None:
            place.scale(workers.jobs)
        yield place


@contextmanager
def _kept_at(cluster: LocalCluster, n: int) -> Iterator[None]:
    """Replace processes that end for good: their keeper gives up where one dies as it starts."""
    ended = Event()

    def mend() -> None:
        while not ended.wait(TICK):
            cluster.scale(n)

    keeper = Thread(target=mend, daemon=True)
    keeper.start()
    try:
        yield
    finally:
        ended.set()
        keeper.join()
