"""Files that are damaged or no images are refused by one error that names what is wrong."""

from __future__ import annotations

import gzip
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nibabel as nib
import numpy as np
import pytest
import SimpleITK

from heartgen import read_mask
from heartgen.errors import InputError

NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 24 22 20\nencoding: raw\n"
META = "NDims = 3\nDimSize = 24 22 20\nElementType = MET_UCHAR\n"
LOCAL = "ElementDataFile = LOCAL\n"

Maker = Callable[[Any, np.ndarray], Path]
bad_files: dict[str, tuple[Maker, str]] = {}


def bad(words: str) -> Callable[[Maker], Maker]:
    """Register a way to write a bad image into a folder, with words of the sentence it earns."""
    return lambda make: bad_files.setdefault(make.__name__, (make, words))[0]


@bad("no such file")
def missing(folder, cup):
    return folder / "nowhere.nii.gz"


@bad("file is empty")
def empty_file(folder, cup):
    (folder / "m.nii").touch()
    return folder / "m.nii"


@bad("no DICOM file in this folder")
def folder_without_dicom(folder, cup):
    return folder.nifti(cup).parent


@bad("declares 32767 x 32767 x 17 = 1.83e.10 voxels.*crop")
def eighteen_gigabytes(folder, cup):
    return folder.nifti(cup, dim=[3, 32767, 32767, 17, 1, 1, 1, 1])


@bad("truncated.*1,000,000,000 bytes")
def one_gigabyte_in_a_small_gzip(folder, cup):
    path = folder.nifti(cup, dim=[3, 1000, 1000, 1000, 1, 1, 1, 1])
    (folder / "m.nii.gz").write_bytes(gzip.compress(path.read_bytes()))
    return folder / "m.nii.gz"


@bad("impossible size")
def no_voxels(folder, cup):
    return folder.nifti(cup, dim=[3, 24, 0, 20, 1, 1, 1, 1])


@bad("declares .*voxels, more than")
def huge_nrrd(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("24", "240000000") + "\n", cup.tobytes())


@bad("truncated, it holds 10,560 of the")
def large_mha(folder, cup):
    return folder.text("m.mha", META.replace("24 22", "900 900") + LOCAL, cup.tobytes())


@bad("truncated, it holds 0 of the")
def packed_nrrd_without_data(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("raw", "gzip") + "\n", b"")


@bad("truncated")
def truncated_nifti(folder, cup):
    path = folder.nifti(cup)
    path.write_bytes(path.read_bytes()[:-100])
    return path


@bad("truncated in its header")
def truncated_nifti_header(folder, cup):
    path = folder.nifti(cup)
    nib.save(nib.Nifti2Image(cup, np.eye(4)), path)
    path.write_bytes(path.read_bytes()[:400])
    return path


@bad("truncated")
def truncated_gzip(folder, cup):
    noise = np.random.default_rng(0).integers(0, 2, (40, 40, 40), dtype=np.uint8)
    path = folder / "m.nii.gz"
    nib.save(nib.Nifti1Image(noise, np.eye(4)), path)
    path.write_bytes(path.read_bytes()[:-2000])
    return path


@bad("compression is damaged")
def flipped_bit_in_gzip(folder, cup):
    path = folder / "m.nii.gz"
    nib.save(nib.Nifti1Image(cup, np.eye(4)), path)
    data = bytearray(path.read_bytes())
    data[-6] ^= 1  # in the checksum
    path.write_bytes(data)
    return path


@bad("compression is damaged")
def damaged_packed_nrrd(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("raw", "gzip") + "\n", b"\x1f\x8b\x08" + b"x" * 99)


@bad("not gzip-compressed as its name says")
def plain_named_gz(folder, cup):
    return folder.nifti(cup).rename(folder / "m.nii.gz")


@bad("gzip-compressed: end its name in .nii.gz")
def gzip_named_plain(folder, cup):
    path = folder / "m.nii.gz"
    nib.save(nib.Nifti1Image(cup, np.eye(4)), path)
    return path.rename(folder / "m.nii")


@bad("compressed as a whole: unpack it")
def gzipped_nrrd(folder, cup):
    return folder.text("m.nrrd.gz", "", gzip.compress(NRRD.encode() + b"\n" + cup.tobytes("F")))


@bad("PNG picture, not a volume")
def picture_named_nifti(folder, cup):
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(cup[:, :, 8]), str(folder / "m.png"))
    return (folder / "m.png").rename(folder / "m.nii")


@bad("TIFF picture, not a volume")
def picture(folder, cup):
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(cup), str(folder / "m.tif"))
    return folder / "m.tif"


@bad("JPEG2000 picture, which holds no voxel size")
def picture_without_signature(folder, cup):
    SimpleITK.WriteImage(SimpleITK.GetImageFromArray(255 * cup[:, :, 8]), str(folder / "m.j2k"))
    return folder / "m.j2k"


@bad("DICOM file: its name must end in .dcm")
def dicom_named_nifti(folder, cup):
    return folder.text("m.nii", "", bytes(128) + b"DICM" + bytes(400))


@bad("NRRD image: its name must end in .nrrd or .nhdr")
def nrrd_named_mha(folder, cup):
    return folder.text("m.mha", NRRD + "\n", cup.tobytes("F"))


@bad("ZIP archive, not a volume")
def zipped(folder, cup):
    return folder.text("m.zip", "PK\x03\x04", bytes(100))


@bad("no NIfTI image header, as its name promises")
def text_named_nifti(folder, cup):
    return folder.text("m.nii", "version https://git-lfs.github.com/spec/v1\n", b"")


@bad("no image heartgen can read")
def something_else(folder, cup):
    return folder.text("m.txt", "Dear cardiologist,\n", b"")


@bad("Analyze image, which does not say which side is left")
def analyze(folder, cup):
    nib.save(nib.AnalyzeImage(cup, np.eye(4)), folder / "m.hdr")
    return folder / "m.hdr"


@bad("Analyze image, which does not say which side is left")
def second_of_an_analyze_pair(folder, cup):
    nib.save(nib.AnalyzeImage(cup, np.eye(4)), folder / "m.img")
    return folder / "m.img"


@bad("Analyze image, which does not say which side is left")
def second_of_a_big_endian_analyze_pair(folder, cup):
    header = nib.AnalyzeHeader(endianness=">")
    nib.save(nib.AnalyzeImage(cup, np.eye(4), header), folder / "m.img")
    return folder / "m.img"


@bad("two voxel sizes")
def second_of_a_pair_that_contradicts_itself(folder, cup):
    nib.save(nib.Nifti1Pair(cup, np.eye(4)), folder / "m.img")
    raw = nib.Nifti1Header((folder / "m.hdr").read_bytes()[:348], check=False)
    raw["pixdim"][1:4] = 2
    (folder / "m.hdr").write_bytes(raw.binaryblock)
    return folder / "m.img"


@bad(".hdr file .* is missing")
def other_half_of_a_pair(folder, cup):
    nib.save(nib.Nifti1Pair(cup, np.eye(4)), folder / "m.img")
    (folder / "m.hdr").unlink()
    return folder / "m.img"


@bad("compressed as a whole: unpack it")
def other_half_of_a_packed_pair(folder, cup):
    nib.save(nib.Nifti1Pair(cup, np.eye(4)), folder / "m.img.gz")
    return folder / "m.img.gz"


@bad("NIfTI image: its name must end in")
def nifti_named_img(folder, cup):
    return folder.nifti(cup).rename(folder / "m.img")


@bad("lengths in 'furlong', a unit that is not known")
def unknown_unit(folder, cup):
    units = 'spacings: 1 1 1\nunits: "furlong" "furlong" "furlong"\n\n'
    return folder.text("m.nrrd", NRRD + units, cup.tobytes("F"))


@bad("different units .mm, cm")
def several_units(folder, cup):
    units = 'spacings: 1 1 1\nunits: "mm" "mm" "cm"\n\n'
    return folder.text("m.nrrd", NRRD + units, cup.tobytes("F"))


@bad("does not say how large the voxels are, .* space directions or spacings in mm")
def nrrd_without_voxel_size(folder, cup):
    return folder.text("m.nrrd", NRRD + "\n", cup.tobytes("F"))


@bad("does not say how large the voxels are")
def nrrd_without_one_voxel_size(folder, cup):
    return folder.text("m.nrrd", NRRD + "spacings: 1 1 nan\n\n", cup.tobytes("F"))


@bad("does not say how large the voxels are")
def nrrd_without_one_direction(folder, cup):
    space = "space: LPS\nspace directions: none (0,1,0) (0,0,1)\n\n"
    return folder.text("m.nrrd", NRRD + space, cup.tobytes("F"))


@bad("does not say how large the voxels are, .* ElementSpacing in mm")
def mha_without_voxel_size(folder, cup):
    return folder.text("m.mha", META + LOCAL, cup.tobytes("F"))


@bad(".img file .* is missing")
def half_a_pair(folder, cup):
    nib.save(nib.Nifti1Pair(cup, np.eye(4)), folder / "m.hdr")
    (folder / "m.img").unlink()
    return folder / "m.hdr"


@bad("voxels begin at byte 1:")
def voxels_in_the_header(folder, cup):
    return folder.nifti(cup, vox_offset=1)


@bad("voxels of type 999")
def unknown_nifti_type(folder, cup):
    return folder.nifti(cup, datatype=999)


@bad("type 'MET_OTHER'")
def unknown_mha_type(folder, cup):
    return folder.text("m.mha", META.replace("MET_UCHAR", "MET_OTHER") + LOCAL, cup.tobytes("F"))


@bad("type 'block'")
def unknown_nrrd_type(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("uint8", "block") + "\n", cup.tobytes("F"))


@bad("sizes are 'many of them'")
def wordy_sizes(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("24 22 20", "many of them") + "\n", b"")


@bad("NDims and DimSize disagree")
def more_axes_than_sizes(folder, cup):
    return folder.text("m.mha", META.replace("NDims = 3", "NDims = 100") + LOCAL, cup.tobytes())


@bad("does not say where its data are")
def mha_without_data(folder, cup):
    return folder.text("m.mha", "ObjectType = Image\n" + META, b"")


@bad("header has no end")
def nrrd_without_end(folder, cup):
    return folder.text("m.nrrd", NRRD, b"")


@bad("encoding 'bzip2' is not read")
def bzip2(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("raw", "bzip2") + "\n", b"BZh9")


@bad("data file 'gone.raw' is missing")
def detached_data_missing(folder, cup):
    return folder.text("m.mhd", META + "ElementDataFile = gone.raw\n", b"")


@bad("not beside its header")
def detached_data_elsewhere(folder, cup):
    return folder.text("m.nhdr", NRRD + "data file: ../../secret.raw\n", b"")


@bad("several files")
def one_file_per_slice(folder, cup):
    return folder.text("m.mhd", META + "ElementDataFile = slice%02d.raw 0 19 1\n", b"")


@bad("SimpleITK cannot read the file .*sizes")
def refused_by_the_library(folder, cup):
    return folder.text("m.nrrd", NRRD.replace("dimension: 3", "dimension: 2") + "\n", bytes(10560))


@pytest.mark.parametrize("kind", bad_files)
def test_bad_file_is_refused_with_a_clear_sentence(kind, folder, cup, assert_refused):
    make, words = bad_files[kind]
    assert_refused(make(folder, cup), words)


def test_a_file_that_may_not_be_read(cup, folder):
    path = folder.nifti(cup)
    path.chmod(0)
    root = os.geteuid() == 0
    if root:  # who may read everything
        os.seteuid(65534)
    try:
        with pytest.raises(InputError, match=r"cannot be opened \(Permission denied\)"):
            read_mask(path)
    finally:
        if root:
            os.seteuid(0)


@pytest.mark.parametrize("path", ["", "a\0b", "n" * 5000, "/dev/null"])
def test_strange_paths(path):
    with pytest.raises(InputError):
        read_mask(path)
