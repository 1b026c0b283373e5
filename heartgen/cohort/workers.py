"""Who does the work: a choice, which starts nothing yet."""

from __future__ import annotations

from dataclasses import dataclass

from heartgen.errors import InputError

TIME_LIMIT = 30.0
"""Minutes: fifty times what a usual fit takes on one core, and no night for a case that hangs."""


@dataclass(frozen=True)
class Workers:
    """Processes of this machine, of a running Dask cluster, or of one that is started.

    Attributes
    ----------
    jobs : int or None
        Processes to start; one for each core, or what the cluster starts by itself, if None.
    scheduler : str or None
        Address of a running scheduler, or the file it wrote.
    cluster : str or None
        A class of a cluster to be started, such as ``dask_jobqueue.SLURMCluster``; its settings
        are those of Dask's configuration.
    time_limit : float or None
        Minutes after which a mesh that is not done is given up; None to wait for ever.
    """

    jobs: int | None = None
    scheduler: str | None = None
    cluster: str | None = None
    time_limit: float | None = TIME_LIMIT

    def __post_init__(self) -> None:
        if self.jobs is not None and self.jobs < 1:
            raise InputError(f"{self.jobs} processes cannot work: give 1 or more")
        if self.time_limit is not None and not self.time_limit > 0:
            raise InputError(f"in {self.time_limit:g} minutes no mesh is done: give more")
        if self.scheduler is not None and (self.cluster is not None or self.jobs is not None):
            raise InputError(
                "a scheduler that runs has workers of its own: give neither a cluster nor a "
                "number of processes with it"
            )
