"""Each kind of bad mask is refused by one error whose sentence names what is wrong."""

from __future__ import annotations

import gzip
import os
from collections.abc import Callable
from pathlib import Path

import nibabel as nib
import numpy as np
import pytest
import SimpleITK

from heartgen import mask_from_array, read_mask
from heartgen.errors import InputError

NRRD = "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 24 22 20\nencoding: raw\n"
META = "NDims = 3\nDimSize = 24 22 20\nElementType = MET_UCHAR\n"
LOCAL = "ElementDataFile = LOCAL\n"
LPS = "space: left-posterior-superior\nspace origin: (0,0,0)\n"

Maker = Callable[[Path, np.ndarray], Path]
bad_masks: dict[str, tuple[Maker, str]] = {}


def bad(words: str) -> Callable[[Maker], Maker]:
    """Register a way to write a bad mask into a folder, with words of the sentence it earns."""

    def register(make: Maker) -> Maker:
        bad_masks[make.__name__] = make, words
        return make

    return register


def nifti(folder: Path, voxels: np.ndarray, name: str = "m.nii", **header: object) -> Path:
    """Save a NIfTI-1 image and then set fields of its header by force."""
    image = nib.Nifti1Image(voxels, np.eye(4))
    nib.save(image, folder / name)
    data = bytearray((folder / name).read_bytes())
    raw = nib.Nifti1Header(bytes(data[:348]), check=False)
    for key, value in header.items():
        raw[key] = value
    (folder / name).write_bytes(raw.binaryblock + data[348:])
    return folder / name


def text(folder: Path, name: str, header: str, data: bytes) -> Path:
    (folder / name).write_bytes(header.encode() + data)
    return folder / name


@bad("no such file")
def missing(folder, cup):
    return folder / "nowhere.nii.gz"


@bad("file is empty")
def empty_file(folder, cup):
    (folder / "m.nii").touch()
    return folder / "m.nii"


@bad("no DICOM file in this folder")
def folder_without_dicom(folder, cup):
    return nifti(folder, cup).parent


@bad("not binary.* labels 1 .*, 2 .*--label")
def two_labels(folder, cup):
    return nifti(folder, cup * np.repeat([[[1]], [[2]]], 12, axis=0).astype(np.uint8))


@bad("not a mask.*different values.*threshold")
def probabilities(folder, cup):
    return nifti(folder, cup * np.linspace(0.1, 0.9, cup.shape[2]).astype(np.float32))


@bad("mask is empty, no voxel")
def nothing_set(folder, cup):
    return nifti(folder, 0 * cup)


@bad("Every voxel is set")
def everything_set(folder, cup):
    return nifti(folder, np.ones_like(cup))


@bad("swapped: invert")
def inside_out(folder, cup):
    return nifti(folder, 1 - cup)


@bad("3 frames")
def cine(folder, cup):
    return nifti(folder, np.stack([cup] * 3, axis=-1))


@bad("5 frames")
def cine_nrrd(folder, cup):
    image = SimpleITK.JoinSeries([SimpleITK.GetImageFromArray(cup.T)] * 5)
    SimpleITK.WriteImage(image, str(folder / "m.nrrd"))
    return folder / "m.nrrd"


@bad("two-dimensional")
def one_slice(folder, cup):
    return nifti(folder, cup[:, :, 8])


@bad("two-dimensional .*24 x 22 x 1")
def one_slice_in_three_axes(folder, cup):
    return nifti(folder, cup[:, :, 8:9])


@bad("only 2 voxels along the k axis")
def two_slices(folder, cup):
    flat = 0 * cup
    flat[:, :, 8:10] = cup[:, :, 8:10]
    return nifti(folder, flat)


@bad("only 27 voxels, too few")
def speck(folder, cup):
    few = 0 * cup
    few[5:8, 5:8, 5:8] = 1
    return nifti(folder, few)


@bad("only 13 voxels, too few")
def dust(folder, cup):
    specks = 0 * cup
    specks[1::4, 1::4, 1::4] = 1
    specks[1:3, 1:3, 1:3] = 1
    return nifti(folder, specks)


@bad("NaN or infinity stands in 1 voxel:")
def not_a_number(folder, cup):
    values = cup.astype(np.float32)
    values[0, 0, 0] = np.nan
    return nifti(folder, values)


@bad("NaN or infinity stands in 20 voxels:")
def infinite(folder, cup):
    values = cup.astype(np.float64)
    values[3, 3] = np.inf
    return nifti(folder, values)


@bad("complex numbers")
def complex_numbers(folder, cup):
    return nifti(folder, cup.astype(np.complex64))


@bad("complex numbers")
def complex_numbers_nrrd(folder, cup):
    image = SimpleITK.GetImageFromArray(cup.T.astype(np.complex64))
    SimpleITK.WriteImage(image, str(folder / "m.nrrd"))
    return folder / "m.nrrd"


@bad("colours or vectors")
def colours(folder, cup):
    rgb = np.zeros(cup.shape, dtype=[("R", "u1"), ("G", "u1"), ("B", "u1")])
    return nifti(folder, rgb)


@bad("colours or vectors")
def vectors(folder, cup):
    image = SimpleITK.GetImageFromArray(np.stack([cup.T] * 3, axis=-1), isVector=True)
    SimpleITK.WriteImage(image, str(folder / "m.mha"))
    return folder / "m.mha"


@bad("voxel size of 0 x 1 x 1 mm.*not positive")
def zero_spacing(folder, cup):
    return nifti(folder, cup, pixdim=[1, 0, 1, 1, 0, 0, 0, 0])


@bad("voxel size of 1 x -2 x 1 mm.*not positive")
def negative_spacing(folder, cup):
    return nifti(folder, cup, pixdim=[1, 1, -2, 1, 0, 0, 0, 0])


@bad("voxel size of 1 -2 1 mm.*not positive")
def negative_spacing_mha(folder, cup):
    return text(folder, "m.mha", META + "ElementSpacing = 1 -2 1\n" + LOCAL, cup.tobytes("F"))


@bad("voxel size of 1 0 1 mm.*not positive")
def zero_spacing_nrrd(folder, cup):
    return text(folder, "m.nrrd", NRRD + "spacings: 1 0 1\n\n", cup.tobytes("F"))


@bad("500 x 500 x 500 mm is not possible")
def half_metre_voxels(folder, cup):
    nib.save(nib.Nifti1Image(cup, np.diag([500, 500, 500, 1])), folder / "m.nii")
    return folder / "m.nii"


@bad("1e-06 mm is not possible")
def nanometre_voxels(folder, cup):
    nib.save(nib.Nifti1Image(cup, np.diag([1e-6, 1e-6, 1e-6, 1])), folder / "m.nii")
    return folder / "m.nii"


@bad("two of them meet at 7[67].* degrees.*resample")
def sheared_nifti(folder, cup):
    affine = np.eye(4)
    affine[0, 2] = 0.25
    image = nib.Nifti1Image(cup, affine)
    image.set_qform(None, 0)
    nib.save(image, folder / "m.nii")
    return folder / "m.nii"


@bad("sheared")
def sheared_nrrd(folder, cup):
    axes = "space directions: (1,0,0) (0.2,1,0) (0,0,1)\n\n"
    return text(folder, "m.nrrd", NRRD + LPS + axes, cup.tobytes("F"))


@bad("two voxel sizes, 1 x 1 x 1 mm by its sform and 2 x 1 x 1 mm by its pixdim")
def two_voxel_sizes(folder, cup):
    return nifti(folder, cup, pixdim=[1, 2, 1, 1, 0, 0, 0, 0])


@bad("sform and the qform of the header are mirror images")
def mirrored_transforms(folder, cup):
    image = nib.Nifti1Image(cup, np.eye(4))
    image.set_sform(np.diag([-1.0, 1, 1, 1]), 1)
    image.set_qform(np.eye(4), 1)
    nib.save(image, folder / "m.nii")
    return folder / "m.nii"


@bad("header is damaged")
def impossible_rotation(folder, cup):
    return nifti(folder, cup, qform_code=1, quatern_b=3.0)


@bad("not a sensible number")
def nowhere_nan(folder, cup):
    return nifti(folder, cup, srow_x=[1, 0, 0, np.nan])


@bad("declares 32767 x 32767 x 17 = 1.83e.10 voxels.*crop")
def eighteen_gigabytes(folder, cup):
    return nifti(folder, cup, dim=[3, 32767, 32767, 17, 1, 1, 1, 1])


@bad("truncated.*1,000,000,000 bytes")
def one_gigabyte_in_a_small_gzip(folder, cup):
    path = nifti(folder, cup, dim=[3, 1000, 1000, 1000, 1, 1, 1, 1])
    (folder / "m.nii.gz").write_bytes(gzip.compress(path.read_bytes()))
    return folder / "m.nii.gz"


@bad("impossible size")
def no_voxels(folder, cup):
    return nifti(folder, cup, dim=[3, 24, 0, 20, 1, 1, 1, 1])


@bad("declares .*voxels, more than")
def huge_nrrd(folder, cup):
    return text(folder, "m.nrrd", NRRD.replace("24", "240000000") + "\n", cup.tobytes())


@bad("truncated, it holds 10,560 of the")
def large_mha(folder, cup):
    return text(folder, "m.mha", META.replace("24 22", "900 900") + LOCAL, cup.tobytes())


@bad("truncated, it holds 0 of the")
def packed_nrrd_without_data(folder, cup):
    return text(folder, "m.nrrd", NRRD.replace("raw", "gzip") + "\n", b"")


@bad("truncated")
def truncated_nifti(folder, cup):
    path = nifti(folder, cup)
    path.write_bytes(path.read_bytes()[:-100])
    return path


@bad("truncated in its header")
def truncated_nifti_header(folder, cup):
    path = nifti(folder, cup)
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
    return text(folder, "m.nrrd", NRRD.replace("raw", "gzip") + "\n", b"\x1f\x8b\x08" + b"x" * 99)


@bad("not gzip-compressed as its name says")
def plain_named_gz(folder, cup):
    return nifti(folder, cup).rename(folder / "m.nii.gz")


@bad("gzip-compressed: end its name in .nii.gz")
def gzip_named_plain(folder, cup):
    path = folder / "m.nii.gz"
    nib.save(nib.Nifti1Image(cup, np.eye(4)), path)
    return path.rename(folder / "m.nii")


@bad("compressed as a whole: unpack it")
def gzipped_nrrd(folder, cup):
    return text(folder, "m.nrrd.gz", "", gzip.compress(NRRD.encode() + b"\n" + cup.tobytes("F")))


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
    return text(folder, "m.nii", "", bytes(128) + b"DICM" + bytes(400))


@bad("NRRD image: its name must end in .nrrd or .nhdr")
def nrrd_named_mha(folder, cup):
    return text(folder, "m.mha", NRRD + "\n", cup.tobytes("F"))


@bad("ZIP archive, not a volume")
def zipped(folder, cup):
    return text(folder, "m.zip", "PK\x03\x04", bytes(100))


@bad("no NIfTI image header, as its name promises")
def text_named_nifti(folder, cup):
    return text(folder, "m.nii", "version https://git-lfs.github.com/spec/v1\n", b"")


@bad("no image heartgen can read")
def something_else(folder, cup):
    return text(folder, "m.txt", "Dear cardiologist,\n", b"")


@bad("Analyze image, which does not say which side is left")
def analyze(folder, cup):
    nib.save(nib.AnalyzeImage(cup, np.eye(4)), folder / "m.hdr")
    return folder / "m.hdr"


@bad(".img file .* is missing")
def half_a_pair(folder, cup):
    nib.save(nib.Nifti1Pair(cup, np.eye(4)), folder / "m.hdr")
    (folder / "m.img").unlink()
    return folder / "m.hdr"


@bad("voxels begin at byte 1:")
def voxels_in_the_header(folder, cup):
    return nifti(folder, cup, vox_offset=1)


@bad("voxels of type 999")
def unknown_nifti_type(folder, cup):
    return nifti(folder, cup, datatype=999)


@bad("type 'MET_OTHER'")
def unknown_mha_type(folder, cup):
    return text(folder, "m.mha", META.replace("MET_UCHAR", "MET_OTHER") + LOCAL, cup.tobytes("F"))


@bad("type 'block'")
def unknown_nrrd_type(folder, cup):
    return text(folder, "m.nrrd", NRRD.replace("uint8", "block") + "\n", cup.tobytes("F"))


@bad("sizes are 'many of them'")
def wordy_sizes(folder, cup):
    return text(folder, "m.nrrd", NRRD.replace("24 22 20", "many of them") + "\n", b"")


@bad("NDims and DimSize disagree")
def more_axes_than_sizes(folder, cup):
    return text(folder, "m.mha", META.replace("NDims = 3", "NDims = 100") + LOCAL, cup.tobytes())


@bad("does not say where its data are")
def mha_without_data(folder, cup):
    return text(folder, "m.mha", "ObjectType = Image\n" + META, b"")


@bad("header has no end")
def nrrd_without_end(folder, cup):
    return text(folder, "m.nrrd", NRRD, b"")


@bad("encoding 'bzip2' is not read")
def bzip2(folder, cup):
    return text(folder, "m.nrrd", NRRD.replace("raw", "bzip2") + "\n", b"BZh9")


@bad("data file 'gone.raw' is missing")
def detached_data_missing(folder, cup):
    return text(folder, "m.mhd", META + "ElementDataFile = gone.raw\n", b"")


@bad("not beside its header")
def detached_data_elsewhere(folder, cup):
    return text(folder, "m.nhdr", NRRD + "data file: ../../secret.raw\n", b"")


@bad("several files")
def one_file_per_slice(folder, cup):
    return text(folder, "m.mhd", META + "ElementDataFile = slice%02d.raw 0 19 1\n", b"")


@bad("SimpleITK cannot read the file .*sizes")
def refused_by_the_library(folder, cup):
    return text(folder, "m.nrrd", NRRD.replace("dimension: 3", "dimension: 2") + "\n", bytes(10560))


@pytest.mark.parametrize("kind", bad_masks)
def test_bad_mask_is_refused_with_a_clear_sentence(kind, cup, tmp_path, capfd):
    make, words = bad_masks[kind]
    path = make(tmp_path, cup)
    with pytest.raises(InputError, match=words) as refusal:
        read_mask(path)
    message = str(refusal.value)
    assert message.startswith((f"{path.name}: ", f"{path}: "))
    assert message.endswith(".")
    assert "\n" not in message  # one kind of fault, one sentence
    assert capfd.readouterr().err == ""


def test_all_problems_are_named_at_once(cup):
    values = cup.astype(float)
    values[0, 0, 0] = np.nan
    affine = np.eye(4)
    affine[0, 1] = 0.5
    with pytest.raises(InputError, match="case 7: 2 problems") as refusal:
        mask_from_array(values, affine, name="case 7")
    assert "sheared" in str(refusal.value)
    assert "NaN" in str(refusal.value)


def test_a_file_that_may_not_be_read(cup, tmp_path):
    path = nifti(tmp_path, cup)
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


@pytest.mark.parametrize(
    ("label", "words"),
    [
        (7, "no label 7 in the image, which holds 1 .*, 2"),
        ([1, 8], "no label 8 "),
        ("septum", "no label 'septum' "),
        (1.5, "no label 1.5 "),
        (None, "not binary"),
        ([], "empty"),
        ([[1, 2]], r"no label \[1, 2\] "),
    ],
)
def test_labels_that_are_not_there(label, words, cup):
    labels = cup.copy()
    labels[:12] *= 2
    with pytest.raises(InputError, match=words):
        mask_from_array(labels, np.eye(4), label=label)


@pytest.mark.parametrize(
    ("affine", "words"),
    [
        (np.eye(3), "4 x 4 matrix"),
        (np.zeros((4, 4)), "last row 0 0 0 1"),
        (np.diag([1.0, 0.0, 1.0, 1.0]), "1 x 0 x 1 mm is not possible"),
        (np.diag([1.0, np.inf, 1.0, 1.0]), "not a sensible number"),
        ("identity", "not a matrix of numbers"),
    ],
)
def test_bad_affines(affine, words, cup):
    with pytest.raises(InputError, match=words):
        mask_from_array(cup, affine)


@pytest.mark.parametrize("voxels", [np.zeros(0), np.zeros((0, 3, 3)), [["a"]], np.array(None), 3])
def test_arrays_that_are_no_images(voxels):
    with pytest.raises(InputError):
        mask_from_array(voxels, np.eye(4))


def test_an_unknown_frame(cup):
    with pytest.raises(InputError, match="'LPS' or 'RAS'"):
        mask_from_array(cup, np.eye(4), frame="RSA")
