"""What a worker does: a job in a process of its own, its progress told to whoever listens."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from distributed import get_worker

from heartgen.cohort.isolation import Watch, do_apart
from heartgen.cohort.job import Job
from heartgen.cohort.rows import Row

TOPIC = "heartgen"
"""Under which progress is told to the scheduler, and by it to servers."""


@dataclass(frozen=True)
class Order:
    """A job to be done.

    Attributes
    ----------
    identifier : str
        Of the job, in the database.
    job : Job
        What to do.
    limit : float
        Seconds that it may take.
    stop : Path
        File whose presence ends it.
    """

    identifier: str
    job: Job
    limit: float
    stop: Path


def work(order: Order) -> list[Row]:
    """Do a job; whatever goes wrong becomes the reason in its row.

    Parameters
    ----------
    order : Order
        What to do.
    """
    worker = get_worker()

    def tell(step: str, done: float) -> None:
        worker.log_event(TOPIC, {"job": order.identifier, "step": step, "progress": done})

    return do_apart(order.job, order.limit, Watch(tell, order.stop.exists))
