"""`Client`: the service from Python."""

from __future__ import annotations

import json
import time
import uuid
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from heartgen.errors import FileError, HeartgenError, InputError, MissingFileError, needing
from heartgen.files import replacing

if TYPE_CHECKING:
    import httpx

PATIENCE = 60.0
"""Seconds for the service to answer."""

DRAWING = 600.0
"""Seconds for it to publish a model, with pictures of it: to ask again would publish it twice."""

TRIES = 5
"""Times that a request is made while the service does not answer, or has no room for now."""

PAUSE = 1.0
"""Seconds before it is made again; twice as many each time."""

LOOK = 1.0
"""Seconds between two questions for a job."""

AGAIN = (429, 502, 503, 504)
"""Answers after which a request is made again."""

NO_ANSWER = "no service answers there ({}): check the address, and that it runs"

ENDS = ("done", "failed", "cancelled")

Progress = Callable[[dict[str, Any]], None]
"""Called with a job, as the service tells it."""


class Client:
    """A service, as `heartgen serve` runs it.

    Parameters
    ----------
    url : str
        Of the service.
    token : str, optional
        That whoever operates the service gave you; none is needed on one's own machine.

    Examples
    --------
    >>> import heartgen
    >>> client = heartgen.Client("http://127.0.0.1:8000")
    >>> client
    Client('http://127.0.0.1:8000')

    With a service that runs there:

    >>> job = client.submit("heart.nii.gz", lod=2)  # doctest: +SKIP
    >>> client.wait(job)["summary"]["status"]  # doctest: +SKIP
    >>> client.download(job, "out")  # doctest: +SKIP
    """

    def __init__(self, url: str, token: str | None = None) -> None:
        with needing("the client needs", "service"):
            import httpx
        if not url.startswith(("http://", "https://")):
            raise InputError(f"{url!r} is no address: give one such as http://127.0.0.1:8000")
        self.url = url.rstrip("/")
        headers = {} if token is None else {"Authorization": f"Bearer {token}"}
        self._http = httpx.Client(base_url=self.url, headers=headers, timeout=PATIENCE)

    def __repr__(self) -> str:
        return f"Client({self.url!r})"

    def submit(
        self,
        mask: str | Path,
        *,
        selection: dict[str, Any] | None = None,
        title: str | None = None,
        email: str | None = None,
        key: str | None = None,
        **options: Any,
    ) -> str:
        """Submit a mask; what was done before is answered at once.

        Parameters
        ----------
        mask : path
            Of a file.
        selection : dict, optional
            What of the image is the myocardium: ``labels``, ``label``, ``rv_wall``, ``frame``, as
            on the command line.
        title : str, optional
            For your own list; the name of the file if omitted.
        email : str, optional
            Where the service tells of the result.
        key : str, optional
            The same key and content give the same job, however often it is submitted. One is made
            up if omitted, so that a request that is made again is not done twice.
        **options : object
            As of `heartgen.personalize`.

        Returns
        -------
        str
            Identifier of the job.
        """
        path = Path(mask)
        if not path.is_file():
            raise MissingFileError(f"{path}: There is no such file: check the path.")
        told = {"title": title, "email": email, **(selection or {})}
        data = {"options": json.dumps(options, default=list)}
        data |= {name: value for name, value in told.items() if value is not None}
        headers = {"Idempotency-Key": key or uuid.uuid4().hex}

        def send() -> httpx.Response:
            with path.open("rb") as file:
                return self._http.post(
                    "/v1/jobs", data=data, files={"mask": (path.name, file)}, headers=headers
                )

        return str(self._asked(send)["id"])

    def job(self, job: str) -> dict[str, Any]:
        """State, step, progress, place in the queue of a job; and what came out.

        Parameters
        ----------
        job : str
            Its identifier.
        """
        found: dict[str, Any] = self._asked(lambda: self._http.get(f"/v1/jobs/{job}"))
        return found

    def wait(
        self, job: str, *, timeout: float | None = None, progress: Progress | None = None
    ) -> dict[str, Any]:
        """Wait until a job has ended, under a progress bar.

        Parameters
        ----------
        job : str
            Its identifier.
        timeout : float, optional
            Seconds.
        progress : callable, optional
            Called with the job again and again, instead of the bar.

        Returns
        -------
        dict
            The job.

        Raises
        ------
        HeartgenError
            If it failed or was cancelled, or has not ended in time.
        """
        end = None if timeout is None else time.monotonic() + timeout
        for now in self._followed(job, progress):
            if now["state"] in ENDS:
                break
            if end is not None and time.monotonic() > end:
                raise HeartgenError(f"job {job} is {now['state']} still: wait longer, or cancel it")
        if now["state"] != "done":
            raise HeartgenError(f"job {job} is {now['state']}: {now['reason']}")
        return now

    def cancel(self, job: str) -> dict[str, Any]:
        """Cancel a job.

        Parameters
        ----------
        job : str
            Its identifier.
        """
        found: dict[str, Any] = self._asked(lambda: self._http.delete(f"/v1/jobs/{job}"))
        return found

    def download(
        self, job: str, folder: str | Path, formats: tuple[str, ...] = ("exf", "vtu")
    ) -> list[Path]:
        """Take away the result of a job; `heartgen.Personalization.load` reads the folder.

        Parameters
        ----------
        job : str
            Its identifier.
        folder : path
            Created if absent.
        formats : tuple of str
            Of `heartgen.formats.FORMATS`; the report comes with them.
        """
        place = f"/v1/jobs/{job}/results"
        return [self._save(f"{place}/{name}", Path(folder)) for name in (*formats, "report")]

    def publish(
        self, job: str, *, new_version_of: str | None = None, **metadata: Any
    ) -> dict[str, Any]:
        """Publish the result of a job in the library.

        Parameters
        ----------
        job : str
            Its identifier.
        new_version_of : str, optional
            A model of yours.
        **metadata : object
            ``title``, ``species``, ``condition`` and so on; ``no_names=True`` says that no person
            is named, nor can be recognized.
        """
        told = {"job": job, "metadata": metadata, "new_version_of": new_version_of}
        found: dict[str, Any] = self._asked(
            lambda: self._http.post("/v1/models", json=told, timeout=DRAWING)
        )
        return found

    def search(
        self, words: str = "", *, limit: int = 20, offset: int = 0, **facets: str
    ) -> dict[str, Any]:
        """Find models of the library.

        Parameters
        ----------
        words : str
            All of them have to be there.
        limit, offset : int
            How many, and after how many.
        **facets : str
            Such as ``species="human"``.

        Returns
        -------
        dict
            ``total``, ``models`` and ``facets``: how many there are under each value.
        """
        asked: dict[str, str | int] = {"q": words, "limit": limit, "offset": offset, **facets}
        found: dict[str, Any] = self._asked(lambda: self._http.get("/v1/models", params=asked))
        return found

    def download_model(
        self,
        identifier: str,
        folder: str | Path,
        version: int | None = None,
        formats: tuple[str, ...] = ("exf", "vtu"),
    ) -> list[Path]:
        """Take away a model of the library.

        Parameters
        ----------
        identifier : str
            Of the model.
        folder : path
            Created if absent.
        version : int, optional
            The latest if omitted.
        formats : tuple of str
            Of `heartgen.formats.FORMATS`; the report comes with them.
        """
        if version is None:
            latest = self._asked(lambda: self._http.get(f"/v1/models/{identifier}"))
            version = int(latest["version"])
        place = f"/v1/models/{identifier}/versions/{version}/files"
        return [self._save(f"{place}/{name}", Path(folder)) for name in (*formats, "report")]

    def _followed(self, job: str, progress: Progress | None) -> Iterator[dict[str, Any]]:
        """A job, again and again."""
        from rich.progress import Progress as Bars

        with Bars(transient=True, disable=progress is not None) as bars:
            bar = bars.add_task("waiting", total=1.0)
            while True:
                now = self.job(job)
                place = f"place {now['place']} in the queue" if now["place"] else now["step"]
                bars.update(bar, description=place or now["state"], completed=now["progress"])
                if progress is not None:
                    progress(now)
                yield now
                time.sleep(LOOK)

    def _save(self, place: str, folder: Path) -> Path:
        """Save a file under the name that the service gives it."""
        import httpx

        try:
            with self._http.stream("GET", place) as answer:
                if answer.is_error:
                    answer.read()
                    raise _refusal(answer)
                said = answer.headers.get("content-disposition", "")
                name = Path(said.partition('filename="')[2].rstrip('"')).name or "mesh"
                with replacing(folder / name) as temporary, temporary.open("wb") as file:
                    for block in answer.iter_bytes():
                        file.write(block)
        except httpx.TransportError as error:
            raise FileError(f"{self.url}: {NO_ANSWER.format(error)}") from error
        return folder / name

    def _asked(self, send: Callable[[], httpx.Response]) -> Any:
        """The answer to a request, which is made again while the service is not there."""
        import httpx

        for tries in range(1, TRIES + 1):
            try:
                answer = send()
            except httpx.TransportError as error:
                if tries == TRIES:
                    raise FileError(f"{self.url}: {NO_ANSWER.format(error)}") from error
            else:
                if answer.status_code not in AGAIN or tries == TRIES:
                    break
            time.sleep(PAUSE * 2 ** (tries - 1))
        if answer.is_error:
            raise _refusal(answer)
        return answer.json()


def _refusal(answer: httpx.Response) -> HeartgenError:
    """What the service says, as an error."""
    try:
        said = str(answer.json()["detail"])
    except (ValueError, LookupError, TypeError):
        said = f"the service answers {answer.status_code}: check its address"
    return InputError(said)
