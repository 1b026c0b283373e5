"""Uploads that are made to fill a memory or a disk: each is refused with a sentence."""

from __future__ import annotations

import gzip
import threading
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
import pytest

pytest.importorskip("distributed")

import httpx
import nibabel
import numpy as np

import heartgen
from heartgen.errors import HeartgenError
from tests.service.running import Running

pytestmark = pytest.mark.slow

MB, GB = 1024**2, 1024**3

MOST = GB
"""Bytes of memory that the server may take, whatever comes."""

WAITING = 300
"""Seconds for a job to end; a busy machine needs them."""

LOOK = 0.02
"""Seconds between two looks at the memory."""

TAKEN = 1200
"""MB of the largest upload."""


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Running]:
    """A service that takes more than a GB, with real fits."""
    with Running(tmp_path_factory.mktemp("hostile"), upload_limit=TAKEN) as service:
        yield service


@contextmanager
def watched(running: Running) -> Iterator[list[int]]:
    """The memory of the server, looked at all the time."""
    server, seen, ended = psutil.Process(running.processes["server"].pid), [], threading.Event()

    def look() -> None:
        while not ended.wait(LOOK):
            seen.append(server.memory_info().rss)

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    yield seen
    ended.set()
    thread.join()
    print(f"the server took at most {max(seen) / MB:.0f} MB")
    assert max(seen) < MOST


def outside(running: Running) -> set[str]:
    """Files beside those of the service, and of its logs."""
    files = (path.relative_to(running.folder) for path in running.folder.rglob("*"))
    return {str(f) for f in files if f.parts[0] != "data" and f.suffix != ".log"}


def header(*size: int) -> bytes:
    """Of a NIfTI image of bytes, so many along each axis."""
    made = nibabel.Nifti1Header()
    made.set_data_dtype(np.uint8)
    made["dim"][:4] = (3, *size)
    made["pixdim"][:4] = 1
    made.set_sform(np.eye(4), 1)
    made["magic"], made["vox_offset"] = b"n+1", 352
    return made.binaryblock + b"\0" * 4


def bomb(*size: int) -> bytes:
    """A NIfTI image of 8 GB in 8 MB, whatever size its header tells."""
    nothing = gzip.compress(b"\0" * (64 * MB), 9)
    return gzip.compress(header(*size)) + nothing * 128


def nrrd() -> bytes:
    """The header of an image that nobody has memory for."""
    told = ["NRRD0004", "type: uchar", "dimension: 3", "sizes: 60000 60000 60000"]
    told += ["space: left-posterior-superior", "space directions: (1,0,0) (0,1,0) (0,0,1)"]
    told += ["space origin: (0,0,0)", "encoding: raw", "", ""]
    return "\n".join(told).encode() + b"\0" * 1000


def mha() -> bytes:
    """The same as MetaImage, packed."""
    told = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "CompressedData = True"]
    told += ["TransformMatrix = 1 0 0 0 1 0 0 0 1", "Offset = 0 0 0", "ElementSpacing = 1 1 1"]
    told += [
        "DimSize = 60000 60000 60000",
        "ElementType = MET_UCHAR",
        "ElementDataFile = LOCAL",
        "",
    ]
    return "\n".join(told).encode() + zlib.compress(b"\0" * MB)


BOMBS = {
    "unpacks to 8 GB.nii.gz": lambda: bomb(4096, 4096, 512),
    "says 64 voxels and unpacks to 8 GB.nii.gz": lambda: bomb(64, 64, 64),
    "says 27 TB.nii": lambda: header(30000, 30000, 30000) + b"\0" * 1000,
    "says 27 TB.nii.gz": lambda: gzip.compress(header(30000, 30000, 30000) + b"\0" * 1000),
    "says less than nothing.nii": lambda: header(-5, 10, 10) + bytes(1000),
    "says 216 TB.nrrd": nrrd,
    "says 216 TB.mha": mha,
}


@pytest.mark.parametrize("name", BOMBS)
def test_bomb_ends_as_a_sentence(running: Running, name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(BOMBS[name]())
    before, client = outside(running), heartgen.Client(running.url)

    def ask() -> None:
        job = client.submit(path, optimize=False)
        client.wait(job, timeout=WAITING, progress=lambda _: None)

    with watched(running), pytest.raises(HeartgenError) as refusal:
        ask()
    said = str(refusal.value)
    print(said)
    assert len(said) > 40
    assert "still" not in said
    assert "please report it" not in said
    assert "Traceback" not in said
    assert outside(running) == before
    assert client._http.get("/healthz").status_code == 200


@pytest.mark.parametrize(("size", "code"), [(1.0, 422), (4.0, 413)])
def test_upload_of_gigabytes_passes_through_the_disk(
    running: Running, size: float, code: int
) -> None:
    """What is within the limit is looked at; what is not is ended there."""
    sent, block = 0, b"\0" * MB

    def stream() -> Iterator[bytes]:
        nonlocal sent
        yield b'--x\r\nContent-Disposition: form-data; name="mask"; filename="a.nii"\r\n\r\n'
        for _ in range(int(size * 1024)):
            sent += len(block)
            yield block
        yield b"\r\n--x--\r\n"

    before = outside(running)
    headers = {"Content-Type": "multipart/form-data; boundary=x"}
    with watched(running):
        answer = httpx.post(
            f"{running.url}/v1/jobs", content=stream(), headers=headers, timeout=WAITING
        )
    assert answer.status_code == code
    assert len(answer.json()["detail"]) > 30
    assert sent < (TAKEN + 100) * MB
    assert outside(running) == before
    incoming = (running.folder / "data" / "incoming").iterdir()
    assert [path.name for path in incoming if not path.name.startswith("dask")] == []
