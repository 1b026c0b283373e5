"""Whatever stands in a header, the answer is a mask or a refusal: no crash, no other error."""

from __future__ import annotations

import gzip
import os
import re
import select
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import SimpleITK
from hypothesis import given, settings
from hypothesis import strategies as st

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory")

HEADER = 420  # bytes that hold the headers of the small files
PATIENCE = 60.0  # s that an answer may take before the worker counts as hanging
EXAMPLES = 150
NAMES = ["raw.nii", "second.nii", "packed.nii.gz", "inside.nii.gz", "raw.nrrd", "packed.nrrd",
         "raw.mha", "packed.mha"]  # fmt: skip

Mutation = Callable[[bytes], bytes]

NUMBERS = [b"0", b"-1", b"1", b"4", b"7", b"2147483648", b"99999999999999999999", b"1e400",
           b"nan", b"-inf", b"0.0", b"1e-300", b"", b"24 24", b"\x00", b"LIST", b"none",
           b"9" * 6000]  # fmt: skip
INTEGERS = [0, 1, -1, 2, 3, 4, 7, 8, 24, 255, 256, 1024, 32767, -32768]
FLOATS = [0.0, -0.0, 1.0, -1.0, 0.5, 1e-30, 3e38, -3e38, np.inf, -np.inf, np.nan, 352.0, 1e9]


def put(at: int, data: bytes) -> Mutation:
    return lambda file: file[:at] + data + file[at + len(data) :]


def cut(at: int, length: int) -> Mutation:
    return lambda file: file[:at] + file[at + length :]


def replace_number(which: int, new: bytes) -> Mutation:
    """Replace a number of the text header, or of what looks like one."""

    def apply(file: bytes) -> bytes:
        found = list(re.finditer(rb"-?\d+\.?\d*", file[:HEADER]))
        if not found:
            return file
        one = found[which % len(found)]
        return file[: one.start()] + new + file[one.end() :]

    return apply


def swap_lines(first: int, second: int) -> Mutation:
    def apply(file: bytes) -> bytes:
        lines = file[:HEADER].split(b"\n")
        a, b = first % len(lines), second % len(lines)
        lines[a], lines[b] = lines[b], lines[a]
        return b"\n".join(lines) + file[HEADER:]

    return apply


AT = st.integers(0, HEADER)
mutations = st.lists(
    st.one_of(
        st.builds(put, AT, st.binary(min_size=1, max_size=4)),
        st.builds(put, AT, st.sampled_from(INTEGERS).map(lambda n: struct.pack("<h", n))),
        st.builds(
            put,
            AT.map(lambda n: n & ~3),
            st.sampled_from(FLOATS).map(lambda x: struct.pack("<f", x)),
        ),
        st.builds(replace_number, st.integers(0, 40), st.sampled_from(NUMBERS)),
        st.builds(swap_lines, st.integers(0, 20), st.integers(0, 20)),
        st.builds(cut, AT, st.integers(1, 20000)),
    ),
    min_size=1,
    max_size=4,
)


def sound_files(cup: np.ndarray, folder: Path) -> dict[str, bytes]:
    """A sound file of each format, by name."""
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(cup.T))
    for name in ("raw.nrrd", "packed.nrrd", "raw.mha", "packed.mha"):
        SimpleITK.WriteImage(image, str(folder / name), useCompression="packed" in name)
    nib.save(nib.Nifti1Image(cup, np.eye(4)), folder / "raw.nii")
    nib.save(nib.Nifti2Image(cup, np.eye(4)), folder / "second.nii")
    packed = gzip.compress((folder / "raw.nii").read_bytes())
    (folder / "packed.nii.gz").write_bytes(packed)
    (folder / "inside.nii.gz").write_bytes(packed)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


class Worker:
    """A process that reads files; started again if one of them ended it."""

    def __init__(self, folder: Path, sound: dict[str, bytes]) -> None:
        self.folder = folder
        self.sound = sound
        self.noise = folder / "stderr.txt"
        self.start()

    def start(self) -> None:
        with self.noise.open("a") as stderr:
            self.process = subprocess.Popen(
                [sys.executable, Path(__file__).with_name("fuzz_worker.py")],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=stderr,
                text=True,
                env={**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
            )

    def answer(self, name: str, content: bytes) -> str:
        path = self.folder / name
        path.write_bytes(content)
        self.process.stdin.write(f"{path}\n")
        self.process.stdin.flush()
        ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE)
        said = self.process.stdout.readline().strip() if ready else "hangs"
        if said == "" or not ready:
            self.stop()
            said = said or f"died with code {self.process.returncode}"
            self.start()
        return said

    def stop(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture(scope="module")
def worker(cup, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Worker]:
    one = Worker(
        tmp_path_factory.mktemp("fuzz"), sound_files(cup, tmp_path_factory.mktemp("sound"))
    )
    yield one
    one.stop()


@pytest.mark.parametrize("name", NAMES)
def test_sound_files_are_read(name, worker):
    assert worker.answer(name, worker.sound[name]) == "mask"


@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=EXAMPLES)
@given(changes=mutations)
def test_no_header_breaks_the_reader(name, worker, changes):
    content = worker.sound[name]
    if name.startswith("inside"):
        content = gzip.decompress(content)
    for change in changes:
        content = change(content)
    if name.startswith("inside"):
        content = gzip.compress(content, compresslevel=1)
    assert worker.answer(name, content) in {"mask", "refused"}


def test_and_nothing_reaches_the_terminal(worker):
    hostile = worker.sound["raw.mha"].replace(b"TransformMatrix = 1 0", b"TransformMatrix = nan 0")
    assert worker.answer("raw.mha", hostile) == "refused"
    assert worker.noise.read_text() == ""
