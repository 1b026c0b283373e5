"""Whatever stands in a header, the answer is a mask or a refusal: no crash, no other error.

``HEARTGEN_FUZZ=10000 pytest tests/images/test_fuzz_headers.py`` tries as many mutations a format.
"""

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

from tests.images.dicom_files import segmentation, structure_set

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux limits memory")

HEADER = 420  # bytes that hold the headers of the small files
PATIENCE = 60.0  # s that an answer may take before the worker counts as hanging
EXAMPLES = int(os.environ.get("HEARTGEN_FUZZ", "150"))
NAMES = ["raw.nii", "second.nii", "packed.nii.gz", "inside.nii.gz", "pair.hdr", "pair.img",
         "raw.nrrd", "packed.nrrd", "detached.nhdr", "named.seg.nrrd", "layers.seg.nrrd",
         "cine.seq.nrrd", "raw.mha", "packed.mha", "detached.mhd", "seg.dcm", "cine.dcm",
         "rt.dcm"]  # fmt: skip
PAIRED = {"pair.hdr": "pair.img", "pair.img": "pair.hdr", "detached.nhdr": "detached.nhdr.raw",
          "detached.mhd": "detached.raw"}  # fmt: skip
ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False)
BINARY_HEADER = 6000  # bytes of the DICOM files, most of them header

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


WORDS = [b"LV blood pool", b"LV wall", b"Myo", b"RV", b"scar", b"", b"\xff\xfe", b"^^~~|",
         b"=" * 300, b"x" * 300, b"\xce\xbcm"]  # fmt: skip
UNITS = [b"mm", b"cm", b"m", b"um", b"furlong", b"s", b"?", b"", b"\xc2\xb5m", b"nan", b"m" * 400]
LINES = [b'space units: "%b" "%b" "%b"', b'units: "%b" "mm" "%b"', b"DistanceUnits = %b",
         b"units: %b", b"Segment0_Name:=%b", b"Segment1_LabelValue:=%b", b"Segment0_Layer:=%b",
         b"Segment0_Tags:=TerminologyEntry:%b~%b^%b^%b~%b", b"kinds: list %b", b"spacings: %b",
         b"space directions: none %b", b"Name = %b", b"data file: %b"]  # fmt: skip


def insert_line(at: int, line: bytes, word: bytes) -> Mutation:
    """A line more in a text header: a unit, a name, or what a format may say besides."""

    def apply(file: bytes) -> bytes:
        lines = file[:HEADER].split(b"\n")
        lines.insert(at % len(lines), line.replace(b"%b", word))
        return b"\n".join(lines) + file[HEADER:]

    return apply


def replace_word(which: int, new: bytes) -> Mutation:
    """Replace one of the words, such as a name or a unit."""

    def apply(file: bytes) -> bytes:
        found = list(re.finditer(rb"[A-Za-z_]{2,}", file[:BINARY_HEADER]))
        if not found:
            return file
        one = found[which % len(found)]
        return file[: one.start()] + new + file[one.end() :]

    return apply


def set_unit(code: int) -> Mutation:
    """The units of a NIfTI-1 or NIfTI-2 header."""
    return lambda file: put(500 if file[:4] == b"\x1c\x02\0\0" else 123, bytes([code]))(file)


def mutations(reach: int) -> st.SearchStrategy[list[Mutation]]:
    """A few mutations of the first bytes of a file."""
    at = st.integers(0, reach)
    return st.lists(
        st.one_of(
            st.builds(put, at, st.binary(min_size=1, max_size=4)),
            st.builds(put, at, st.sampled_from(INTEGERS).map(lambda n: struct.pack("<h", n))),
            st.builds(
                put,
                at.map(lambda n: n & ~3),
                st.sampled_from(FLOATS).map(lambda x: struct.pack("<f", x)),
            ),
            st.builds(replace_number, st.integers(0, 40), st.sampled_from(NUMBERS)),
            st.builds(replace_word, st.integers(0, 400), st.sampled_from(WORDS + UNITS)),
            st.builds(
                insert_line,
                st.integers(0, 20),
                st.sampled_from(LINES),
                st.sampled_from(WORDS + UNITS + NUMBERS),
            ),
            st.builds(set_unit, st.integers(0, 255)),
            st.builds(swap_lines, st.integers(0, 20), st.integers(0, 20)),
            st.builds(cut, at, st.integers(1, 20000)),
        ),
        min_size=1,
        max_size=4,
    )


def sound_files(cup: np.ndarray, folder: Path) -> dict[str, bytes]:
    """A sound file of each format, by name; of pairs both."""
    image = SimpleITK.GetImageFromArray(np.ascontiguousarray(cup.T))
    for name in ("raw.nrrd", "packed.nrrd", "raw.mha", "packed.mha", "detached.mhd"):
        SimpleITK.WriteImage(image, str(folder / name), useCompression="packed" in name)
    nib.save(nib.Nifti1Image(cup, np.eye(4)), folder / "raw.nii")
    nib.save(nib.Nifti2Image(cup, np.eye(4)), folder / "second.nii")
    nib.save(nib.Nifti1Pair(cup, np.eye(4)), folder / "pair.hdr")
    packed = gzip.compress((folder / "raw.nii").read_bytes())
    (folder / "packed.nii.gz").write_bytes(packed)
    (folder / "inside.nii.gz").write_bytes(packed)
    for name, content in nrrd_files(cup).items():
        (folder / name).write_bytes(content)
    write_dicom(cup, folder)
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def nrrd_files(cup: np.ndarray) -> dict[str, bytes]:
    """Detached data, segments with names, in one layer and in two, and frames."""
    sizes = " ".join(map(str, cup.shape))
    axes = "(1,0,0) (0,1,0) (0,0,1)"
    one = f"NRRD0004\ntype: uint8\ndimension: 3\nspace: LPS\nsizes: {sizes}\nencoding: raw\n"
    one += f"space directions: {axes}\n"
    two = one.replace("dimension: 3", "dimension: 4").replace("sizes: ", "sizes: 2 ")
    two = two.replace("directions:", "directions: none") + "kinds: list domain domain domain\n"
    names = "Segment0_Name:=LV wall\nSegment0_LabelValue:=1\nSegment0_Layer:=0\n"
    more = "Segment1_Name:=RV wall\nSegment1_LabelValue:=1\nSegment1_Layer:=1\n"
    layers = np.stack([cup, np.roll(cup, 2, 0)]).tobytes(order="F")
    data = cup.tobytes(order="F")
    return {
        "detached.nhdr": f"{one}data file: detached.nhdr.raw\n".encode(),
        "detached.nhdr.raw": data,
        "named.seg.nrrd": f"{one}{names}\n".encode() + data,
        "layers.seg.nrrd": f"{two}{names}{more}\n".encode() + layers,
        "cine.seq.nrrd": f"{two}\n".encode() + layers,
    }


def write_dicom(cup: np.ndarray, folder: Path) -> None:
    """A segmentation, a cine of two moments, and a structure set."""
    ds = segmentation({"LV wall": cup}, np.eye(4))
    ds.save_as(folder / "seg.dcm", enforce_file_format=True)
    ds.PerFrameFunctionalGroupsSequence = [*ds.PerFrameFunctionalGroupsSequence] * 2
    ds.NumberOfFrames = 2 * ds.NumberOfFrames
    ds.PixelData = ds.PixelData * 2
    ds.save_as(folder / "cine.dcm", enforce_file_format=True)
    circles = [
        np.column_stack([r * np.cos(ANGLES), r * np.sin(ANGLES), np.full(len(ANGLES), z)])
        for r in (30, 20)
        for z in range(0, 40, 4)
    ]
    structure_set({"LV wall": circles}).save_as(folder / "rt.dcm", enforce_file_format=True)


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
        if name in PAIRED:
            (self.folder / PAIRED[name]).write_bytes(self.sound[PAIRED[name]])
        return self.ask(path)

    def ask(self, path: Path) -> str:
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


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_sound_files_are_read(name, worker):
    expected = "refused" if name.startswith("cine") else "mask"  # for want of a frame
    assert worker.answer(name, worker.sound[name]) == expected


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
@settings(max_examples=EXAMPLES)
@given(data=st.data())
def test_no_header_breaks_the_reader(name, worker, data):
    changes = data.draw(mutations(BINARY_HEADER if name.endswith(".dcm") else HEADER))
    content = worker.sound[name]
    if name.startswith("inside"):
        content = gzip.decompress(content)
    for change in changes:
        content = change(content)
    if name.startswith("inside"):
        content = gzip.compress(content, compresslevel=1)
    assert worker.answer(name, content) in {"mask", "refused"}


STEMS = [
    "m",
    "LV wall",
    "n" * 200,
    "n" * 300,
    "μ",
    ".m",
    "m.nii",
    "a b",
    "-x",
    "%d",
    "m\u202e",
    " ",
]
ENDINGS = ["", ".nii", ".nii.gz", ".hdr", ".img", ".img.gz", ".nrrd", ".nhdr", ".seg.nrrd", ".mha",
           ".mhd", ".dcm", ".NII", ".Img", ".gz", ".raw", ".vtk", ".hdr.gz"]  # fmt: skip


@pytest.mark.slow
@settings(max_examples=EXAMPLES)
@given(
    of=st.sampled_from([*NAMES, *PAIRED.values()]),
    stem=st.sampled_from(STEMS),
    ending=st.sampled_from(ENDINGS),
)
def test_no_name_breaks_the_reader(worker, of, stem, ending):
    """A sound file under any name: read, or refused for it."""
    path = worker.folder / f"{stem}{ending}"
    try:
        path.write_bytes(worker.sound[of])
    except OSError:  # too long for a file, but not for a question
        assert worker.ask(path) == "refused"
        return
    assert worker.ask(path) in {"mask", "refused"}
    path.unlink()


def test_and_nothing_reaches_the_terminal(worker):
    hostile = worker.sound["raw.mha"].replace(b"TransformMatrix = 1 0", b"TransformMatrix = nan 0")
    assert worker.answer("raw.mha", hostile) == "refused"
    assert worker.noise.read_text() == ""
