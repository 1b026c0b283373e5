"""A heart is in the same place of the world whatever file it comes in."""

from __future__ import annotations

import gzip
import subprocess
import sys

import nibabel as nib
import numpy as np
import pytest
import SimpleITK
from hypothesis import given, settings
from hypothesis import strategies as st

from heartgen import Mask, mask_from_array, read_labels, read_mask
from heartgen.errors import InputError

FLOAT32_MM = 1e-4  # rounding of NIfTI's float32 transforms over 300 mm


def world_points(mask: Mask) -> np.ndarray:
    """Centers of the voxels of the heart, in an order that does not depend on the indexing."""
    points = mask.to_world(np.argwhere(mask.voxels).astype(float))
    return points[np.lexsort(np.round(points, 2).T)]


def by_hand(voxels: np.ndarray, affine: np.ndarray) -> np.ndarray:
    points = np.argwhere(voxels) @ affine[:3, :3].T + affine[:3, 3]
    return points[np.lexsort(np.round(points, 2).T)]


@pytest.mark.parametrize(
    "name",
    ["m.nii", "m.nii.gz", "m.nrrd", "m.nhdr", "m.mha", "m.mhd", "m.vtk", "coração 1.nii.gz"],
)
def test_every_format_gives_the_same_world(name, cup, oblique, save):
    # Legacy VTK files hold no directions.
    affine = np.diag([1.0, 1.25, 2.0, 1.0]) if name.endswith("vtk") else oblique
    path = save(cup, affine, name)
    mask = read_mask(path)
    np.testing.assert_allclose(world_points(mask), by_hand(cup, affine), atol=FLOAT32_MM)
    assert mask.voxels.dtype == bool
    assert mask.name == name
    assert mask.findings == ()


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 2, 0), (2, 1, 0)])
@pytest.mark.parametrize("flips", [(), (0,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize("ending", [".nii.gz", ".nrrd", ".mha"])
def test_storage_order_does_not_move_the_heart(axes, flips, ending, cup, oblique, save):
    stored = np.flip(cup, flips).transpose(axes)
    affine = oblique.copy()
    for axis in flips:
        affine[:3, 3] += affine[:3, axis] * (cup.shape[axis] - 1)
        affine[:3, axis] *= -1
    affine[:3, :3] = affine[:3, list(axes)]
    mask = read_mask(save(np.ascontiguousarray(stored), affine, "stored" + ending))
    np.testing.assert_allclose(world_points(mask), by_hand(cup, oblique), atol=FLOAT32_MM)


def test_nifti2_pair_and_big_endian(cup, oblique, tmp_path):
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ oblique
    nib.save(nib.Nifti2Image(cup, ras), tmp_path / "two.nii.gz")
    nib.save(nib.Nifti1Pair(cup, ras), tmp_path / "pair.hdr")
    nib.save(nib.Nifti1Pair(cup, ras), tmp_path / "packed.img.gz")
    with gzip.open(tmp_path / "packed.hdr.gz") as packed:
        (tmp_path / "packed.hdr").write_bytes(packed.read())
    swapped = nib.Nifti1Image(cup.astype(">i2"), ras, nib.Nifti1Header(endianness=">"))
    nib.save(swapped, tmp_path / "big.nii")
    for name in ("two.nii.gz", "pair.hdr", "pair.img", "packed.img.gz", "big.nii"):
        mask = read_mask(tmp_path / name)
        np.testing.assert_allclose(world_points(mask), by_hand(cup, oblique), atol=FLOAT32_MM)


@pytest.mark.parametrize(("unit", "mm"), [("meter", 1000.0), ("mm", 1.0), ("micron", 0.001)])
def test_nifti_units_become_mm(unit, mm, cup, tmp_path):
    image = nib.Nifti1Image(cup, np.diag([1 / mm, 1 / mm, 1 / mm, 1.0]))
    image.header.set_xyzt_units(unit)
    nib.save(image, tmp_path / "units.nii")
    np.testing.assert_allclose(read_mask(tmp_path / "units.nii").spacing, 1.0, rtol=1e-6)


UNITS = {"m": 1000.0, "cm": 10.0, "mm": 1.0, "um": 0.001, "Microns": 0.001, "": 1.0}


def in_unit(voxels, affine, name: str, unit: str) -> bytes:
    """An image whose affine, in mm, is written in another unit, with a header of text."""
    world = affine[:3] / UNITS[unit]
    size = np.linalg.norm(world[:, :3], axis=0)
    sizes = " ".join(map(str, voxels.shape))
    vectors = [f"({','.join(map(repr, column.tolist()))})" for column in world.T]
    numbers = [" ".join(map(repr, column.tolist())) for column in (*(world[:, :3] / size).T, size)]
    header = {
        "placed.nrrd": f"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\n"
        f"sizes: {sizes}\nspace directions: {' '.join(vectors[:3])}\nspace origin: {vectors[3]}\n"
        f'space units: "{unit}" "{unit}" "{unit}"\nencoding: raw\n\n',
        "sized.nrrd": f"NRRD0004\ntype: uint8\ndimension: 3\nsizes: {sizes}\nencoding: raw\n"
        f'spacings: {numbers[3]}\nunits: "{unit}" "{unit}" "{unit}"\n\n',
        "placed.mha": f"ObjectType = Image\nNDims = 3\nDimSize = {sizes}\nElementSpacing = "
        f"{numbers[3]}\nTransformMatrix = {' '.join(numbers[:3])}\nOffset = "
        f"{' '.join(map(repr, world[:, 3].tolist()))}\nDistanceUnits = {unit or '?'}\n"
        "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n",
    }[name]
    return header.encode() + voxels.tobytes(order="F")


@pytest.mark.parametrize("unit", UNITS)
@pytest.mark.parametrize("name", ["placed.nrrd", "sized.nrrd", "placed.mha"])
def test_units_of_text_headers_become_mm(name, unit, cup, oblique, tmp_path):
    affine = np.diag([1.0, 1.25, 2.0, 1.0]) if name == "sized.nrrd" else oblique
    (tmp_path / name).write_bytes(in_unit(cup, affine, name, unit))
    mask = read_mask(tmp_path / name)
    np.testing.assert_allclose(world_points(mask), by_hand(cup, affine), atol=FLOAT32_MM)


def test_gzip_in_several_members(cup, save, tmp_path):
    plain = save(cup, np.eye(4), "plain.nii").read_bytes()
    parts = [gzip.compress(plain[:1000]), gzip.compress(plain[1000:])]
    (tmp_path / "parts.nii.gz").write_bytes(b"".join(parts))
    assert read_mask(tmp_path / "parts.nii.gz").voxels.sum() == cup.sum()


@pytest.mark.parametrize("value", [1, 3, 255, -7, 0.5, 1e-4])
def test_any_single_value_is_a_mask(value, cup):
    mask = mask_from_array(cup * np.float32(value), np.eye(4))
    np.testing.assert_array_equal(mask.voxels, cup.astype(bool))


def test_trailing_axes_of_length_one(cup, oblique, save, tmp_path):
    nib.save(nib.Nifti1Image(cup[..., None, None], np.eye(4)), tmp_path / "five.nii")
    assert read_mask(tmp_path / "five.nii").voxels.shape == cup.shape
    four = SimpleITK.JoinSeries([SimpleITK.ReadImage(str(save(cup, oblique, "three.mha")))])
    SimpleITK.WriteImage(four, str(tmp_path / "four.nrrd"))
    mask = read_mask(tmp_path / "four.nrrd")
    np.testing.assert_allclose(world_points(mask), by_hand(cup, oblique), atol=FLOAT32_MM)


def test_labels_by_number_by_name_and_united(cup, save, tmp_path):
    labels = cup.copy()
    labels[:12][cup[:12] == 1] = 2
    assert read_mask(save(labels, np.eye(4), "l.nii"), label=2).voxels.sum() == (labels == 2).sum()
    both = read_mask(save(labels, np.eye(4), "l.mha"), label=[1, 2])
    np.testing.assert_array_equal(both.voxels, cup.astype(bool))
    image = SimpleITK.GetImageFromArray(labels.T)
    for n, (value, name) in enumerate([("1", "RV wall"), ("2", "LV wall")]):
        image.SetMetaData(f"Segment{n}_LabelValue", value)
        image.SetMetaData(f"Segment{n}_Name", name)
    SimpleITK.WriteImage(image, str(tmp_path / "slicer.seg.nrrd"))
    named = read_mask(tmp_path / "slicer.seg.nrrd", label="lv wall")
    assert named.voxels.sum() == (labels == 2).sum()
    walls = read_mask(tmp_path / "slicer.seg.nrrd")
    np.testing.assert_array_equal(walls.voxels, cup.astype(bool))
    assert "2 'LV wall' as lv_myocardium, 1 'RV wall' as rv_my" in walls.findings[0].message


def layered_nrrd(layers: list, segments: dict, path) -> None:
    """Segments, by name their layer and value, as 3D Slicer saves them where they overlap."""
    values = np.stack(layers)
    lines = ["NRRD0004", "type: uint8", "dimension: 4", "space: left-posterior-superior",
             f"sizes: {' '.join(map(str, values.shape))}", "kinds: list domain domain domain",
             "space directions: none (1,0,0) (0,1,0) (0,0,1)", "encoding: raw",
             "space origin: (0,0,0)"]  # fmt: skip
    for n, (name, (layer, value)) in enumerate(segments.items()):
        lines += [f"Segment{n}_Name:={name}", f"Segment{n}_LabelValue:={value}"]
        lines += [f"Segment{n}_Layer:={layer}"]
    path.write_bytes("\n".join([*lines, "", ""]).encode() + values.tobytes(order="F"))


def test_segments_in_layers(cup, tmp_path):
    """Values are those of a layer: the same number means another segment in another one."""
    outline = np.maximum(cup, np.roll(cup, 1, 2))
    path = tmp_path / "layers.seg.nrrd"
    segments = {"one": (0, 1), "two": (1, 1), "three": (1, 2)}
    layered_nrrd([cup, outline + np.roll(cup, 8, 0)], segments, path)
    assert read_mask(path, label="one").voxels.sum() == cup.sum()
    assert read_mask(path, label=["one", "two"]).voxels.sum() >= outline.sum() * 0.8
    with pytest.raises(InputError, match="segments 1 'one', 2 'two', 3 'three': pass the myoc"):
        read_mask(path)
    with pytest.raises(InputError, match=r"segments 'one' and '.*' overlap: say which"):
        read_labels(path, "auto")


def test_segments_in_layers_that_are_not_there(cup, tmp_path):
    path = tmp_path / "layers.seg.nrrd"
    layered_nrrd([cup, np.roll(cup, 8, 0)], {"one": (4, 1), "two": (5, 1)}, path)
    with pytest.raises(InputError, match="None of its segments lies in one of the 2 layers"):
        read_mask(path)


def test_layers_of_old_versions_have_no_numbers(cup, tmp_path):
    path = tmp_path / "old.seg.nrrd"
    other = np.roll(cup, 1, 0)
    layered_nrrd([cup, other], {"LV wall": (0, 1), "RV wall": (1, 1)}, path)
    lines = path.read_bytes().split(b"\n")
    kept = [line for line in lines if b"_LabelValue" not in line and b"_Layer" not in line]
    path.write_bytes(b"\n".join(kept))
    assert read_mask(path, label="LV wall").voxels.sum() == cup.sum()
    assert read_mask(path).voxels.sum() == np.maximum(cup, other).sum()


def test_layers_with_names_are_a_label_map(heart, tmp_path, save):
    _, at = heart.image(np.array([1.0, 1.0, 1.0]))
    labels = heart.labels(at)
    epicardium = np.isin(labels, (2, 3)).astype(np.uint8)
    pools = np.where(labels == 3, 1, np.where(labels == 1, 2, 0)).astype(np.uint8)
    path = tmp_path / "layers.seg.nrrd"
    names = {"LV epicardium": (0, 1), "LV": (1, 1), "RV": (1, 2)}
    layered_nrrd([epicardium, pools], names, path)
    expected = read_labels(save(labels, np.eye(4), "whole.nrrd"), "acdc")
    np.testing.assert_array_equal(read_mask(path).voxels, expected.voxels)


def test_a_segment_with_codes_alone(heart, tmp_path):
    _, at = heart.image(np.array([1.0, 1.0, 1.0]))
    labels = heart.labels(at)
    image = SimpleITK.GetImageFromArray(labels.astype(np.uint8).T)
    for n, (value, code) in enumerate({2: "49848007", 3: "87878005", 1: "53085002"}.items()):
        image.SetMetaData(f"Segment{n}_LabelValue", str(value))
        image.SetMetaData(f"Segment{n}_Name", f"Segment_{value}")
        terms = f"list~SCT^123037004^Anatomical Structure~SCT^{code}^x~^^~list~^^~^^"
        image.SetMetaData(f"Segment{n}_Tags", f"Status:done|TerminologyEntry:{terms}|")
    SimpleITK.WriteImage(image, str(tmp_path / "coded.seg.nrrd"))
    told = read_mask(tmp_path / "coded.seg.nrrd").findings[0].message
    assert "2 'Segment_2' as lv_myocardium, 3 'Segment_3' as lv_pool, 1 'Segment_1' as rv" in told


@pytest.mark.parametrize("label", [2, "2", 2.0, np.int64(2), np.array([2]), (2, 2), {2}])
def test_a_label_may_be_written_in_many_ways(label, cup):
    labels = cup.copy()
    labels[:12] *= 2
    assert mask_from_array(labels, np.eye(4), label=label).voxels.sum() == (labels == 2).sum()


def test_ras_affines_are_turned(cup, oblique):
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ oblique
    np.testing.assert_allclose(mask_from_array(cup, ras, frame="RAS").affine, oblique)


@settings(deadline=None, max_examples=25)
@given(st.floats(0.03, 10.0))
def test_scaling_the_world_scales_the_mask(scale):
    k = np.arange(12)
    r = np.sqrt(sum(a**2 for a in np.meshgrid(k - 5.5, k - 5.5, k - 5.5)))
    shell = (r < 5) & (r > 3)
    one = mask_from_array(shell, np.diag([1.0, 1.0, 2.0, 1.0]))
    other = mask_from_array(shell, np.diag([scale, scale, 2 * scale, 1.0]))
    np.testing.assert_array_equal(one.voxels, other.voxels)
    np.testing.assert_allclose(other.affine[:3], scale * one.affine[:3], rtol=1e-12)
    assert one.stack_axis == other.stack_axis


def test_the_array_given_is_left_alone(cup):
    affine = np.eye(4)
    touching = np.ascontiguousarray(cup[:, :, 3:])
    before = touching.copy()
    mask_from_array(touching, affine)
    np.testing.assert_array_equal(touching, before)
    np.testing.assert_array_equal(affine, np.eye(4))


def test_transforms_that_differ_in_place_only(cup, tmp_path):
    image = nib.Nifti1Image(cup, np.eye(4))
    image.set_sform(np.eye(4), 2)
    moved = np.eye(4)
    moved[0, 3] = 17.0
    image.set_qform(moved, 1)
    nib.save(image, tmp_path / "two.nii")
    mask = read_mask(tmp_path / "two.nii")
    assert [f.check for f in mask.findings] == ["transforms"]
    assert "17 mm apart" in mask.findings[0].message
    np.testing.assert_allclose(mask.affine, np.diag([-1.0, -1.0, 1.0, 1.0]), atol=1e-6)


def test_nifti_without_a_place(cup, tmp_path):
    image = nib.Nifti1Image(cup, np.eye(4))
    image.set_sform(None, 0)
    image.set_qform(None, 0)
    nib.save(image, tmp_path / "nowhere.nii")
    mask = read_mask(tmp_path / "nowhere.nii")
    assert [f.check for f in mask.findings] == ["placement"]
    seen_by_itk = SimpleITK.ReadImage(str(tmp_path / "nowhere.nii"))
    np.testing.assert_allclose(mask.affine[:3, :3].ravel(), seen_by_itk.GetDirection(), atol=1e-6)


@pytest.mark.parametrize(("size", "unit"), [(0.005, " in m,"), (0.0002, "check the unit")])
def test_odd_sizes_are_remarked_and_kept(size, unit, cup):
    mask = mask_from_array(cup, np.diag([size, size, size, 1.0]))
    assert [f.check for f in mask.findings] == ["scale"]
    assert unit in mask.findings[0].message


@pytest.mark.slow
def test_nothing_reaches_the_terminal_and_importing_stays_light(cup, save, tmp_path):
    good = save(cup, np.eye(4), "good.mha")
    bad = tmp_path / "bad.mha"
    bad.write_bytes(good.read_bytes().replace(b"TransformMatrix = 1 0", b"TransformMatrix = nan 0"))
    code = (
        "import sys, heartgen; light = 'SimpleITK' not in sys.modules\n"
        "from heartgen.errors import InputError\n"
        f"heartgen.read_mask({str(good)!r})\n"
        f"try: heartgen.read_mask({str(bad)!r})\n"
        "except InputError: print('refused', light)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "refused True\n"
    assert done.stderr == ""


def test_real_label_stacks(shared_data):
    paths = sorted((shared_data / "stacks" / "labels").glob("*.nii.gz"))[:4]
    assert len(paths) == 4
    for path in paths:
        mask = read_mask(path, label=2)
        assert mask.voxels.sum() == (np.asarray(nib.load(path).dataobj) == 2).sum()
        assert mask.stack_axis == 2
