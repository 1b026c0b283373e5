"""One frame of a cine, by number or by the volume of the cavity, whatever file it comes in."""

from __future__ import annotations

import nibabel as nib
import numpy as np
import pytest
import SimpleITK

from heartgen import mask_from_array, read_labels, read_mask
from heartgen.errors import InputError
from heartgen.images.selecting import Selection

POOLS = (20.0, 17.0, 14.0, 16.0)  # radius in each frame, mm
ED, ES = 0, 2


@pytest.fixture(scope="module")
def cine(heart):
    """Affine and labels of ACDC, (nx, ny, nz, 4): the wall thickens inwards."""
    affine, at = heart.image(np.array([2.0, 2.0, 4.0]))
    labels = heart.labels(at)
    radius = np.linalg.norm(at, axis=-1)
    frames = [np.where((labels == 3) & (radius > pool), 2, labels) for pool in POOLS]
    return affine, np.stack(frames, axis=-1).astype(np.uint8)


@pytest.fixture(params=[".nii.gz", "5d.nii", ".mha", ".seq.nrrd", "list.nrrd"])
def write(request, tmp_path):
    """Save frames (nx, ny, nz, nt) in one of the ways that there are."""

    def write(frames, affine):
        path = tmp_path / f"cine{request.param}"
        if "nii" in path.name:
            values = frames[:, :, :, None] if path.name.startswith("cine5d") else frames
            nib.save(nib.Nifti1Image(values, np.diag([-1, -1, 1, 1]) @ affine), path)
        elif "nrrd" in path.name:
            vectors = " ".join(f"({','.join(map(str, column))})" for column in affine[:3, :3].T)
            first = path.name.startswith("cinelist")
            kinds = "list domain domain domain" if first else "domain domain domain list"
            sizes = frames.shape[3:] + frames.shape[:3] if first else frames.shape
            header = (
                "NRRD0004\ntype: uint8\ndimension: 4\nspace: left-posterior-superior\n"
                f"sizes: {' '.join(map(str, sizes))}\nspace directions: "
                f"{f'none {vectors}' if first else f'{vectors} none'}\nkinds: {kinds}\n"
                f"encoding: raw\nspace origin: ({','.join(map(str, affine[:3, 3]))})\n\n"
            )
            values = np.moveaxis(frames, -1, 0) if first else frames
            path.write_bytes(header.encode() + values.tobytes(order="F"))
        else:
            image = SimpleITK.JoinSeries(
                [SimpleITK.GetImageFromArray(f.T) for f in np.moveaxis(frames, -1, 0)]
            )
            image.SetSpacing([*np.diag(affine)[:3], 1.0])
            image.SetOrigin([*affine[:3, 3], 0.0])
            SimpleITK.WriteImage(image, str(path))
        return path

    return write


def test_frames_by_number_and_phase(cine, write, save):
    affine, labels = cine
    path = write(labels, affine)
    for frame, index in ((1, 0), ("2", 1), ("ED", ED), ("es", ES), (" 4 ", 3), ("4.0", 3)):
        alone = save(np.ascontiguousarray(labels[..., index]), affine, "alone.nii")
        expected = read_labels(alone, "acdc", ventricles="lv")
        mask = read_labels(path, "acdc", ventricles="lv", frame=frame)
        np.testing.assert_array_equal(mask.voxels, expected.voxels)
        np.testing.assert_allclose(mask.affine, expected.affine, atol=1e-4)
        wall = read_mask(path, label=2, frame=frame)
        np.testing.assert_array_equal(wall.voxels, expected.voxels)
    assert read_labels(path, "auto", frame="ES").findings[0].message.startswith("Frame 3 of 4 was")


def test_phases_of_masks(cine, write):
    affine, labels = cine
    path = write((labels == 2).astype(np.uint8), affine)
    assert read_mask(path, frame="ED").voxels.sum() == (labels[..., ED] == 2).sum()
    found = read_mask(path, frame="ES")
    assert found.voxels.sum() == (labels[..., ES] == 2).sum()
    assert "Frame 3 of 4 was read for end systole" in found.findings[0].message


def test_frames_without_labels_are_no_phase(cine, write):
    affine, labels = cine
    some = labels.copy()
    some[..., [1, 2]] = 0
    found = read_labels(write(some, affine), "acdc", frame="ES")
    assert "Frame 4 of 4 was read for end systole" in found.findings[0].message
    some[..., 3] = 0
    with pytest.raises(InputError, match="only in frame 1 of 4, so end systole cannot be told"):
        read_labels(write(some, affine), "acdc", frame="ES")


@pytest.mark.parametrize("frame", [0, 5, -1, "x", "1.5", "", "²", 10**9, "9" * 400, "nan", "inf"])
def test_frames_that_there_are_not(frame, cine, write):
    path = write(cine[1], cine[0])
    with pytest.raises(InputError, match=r"no frame .*, the image holds frames 1 to 4: give") as e:
        read_labels(path, "acdc", frame=frame)
    assert len(str(e.value)) < 200


def test_a_frame_has_to_be_chosen(cine, write):
    with pytest.raises(InputError, match=r"holds 4 frames; choose one .*ED or ES, as frame=...\.$"):
        read_labels(write(cine[1], cine[0]), "acdc")


def test_a_volume_is_its_only_frame(cine, save):
    affine, labels = cine
    path = save(np.ascontiguousarray(labels[..., 0]), affine, "one.nii")
    for frame in (1, "ED", "ES"):
        assert read_labels(path, "acdc", frame=frame).voxels.any()
    with pytest.raises(InputError, match="no frame '2', the image holds a single frame"):
        read_labels(path, "acdc", frame=2)


def test_what_a_command_line_says(cine, write):
    affine, labels = cine
    path = write(labels, affine)
    mask = Selection(labels="acdc", frame="ES").read(path, "lv")
    assert mask.voxels.sum() == (labels[..., ES] == 2).sum()


def test_an_array_with_frames_is_refused(cine):
    with pytest.raises(InputError, match="4 frames or channels"):
        mask_from_array(cine[1], cine[0])


@pytest.mark.parametrize("ending", [".nii.gz", ".mha"])
def test_a_channel_in_front_is_called_one(ending, cup, tmp_path):
    path = tmp_path / f"first{ending}"
    if "nii" in ending:
        nib.save(nib.Nifti1Image(cup[None], np.eye(4)), path)
    else:
        image = SimpleITK.GetImageFromArray(cup.T[..., None], isVector=False)
        SimpleITK.WriteImage(image, str(path))
    with pytest.raises(InputError, match=r"first axis .* channels, with a single entry"):
        read_mask(path)
    with pytest.raises(InputError, match=r"first axis .* channels, with a single entry"):
        mask_from_array(cup[None], np.eye(4))


@pytest.mark.parametrize("shape", [(4, 24, 22, 20), (2, 24, 22, 20, 1), (1, 1, 24, 22, 20)])
def test_channels_in_front(shape):
    with pytest.raises(InputError, match=r"first axis .* seems to be .* channels, with "):
        mask_from_array(np.ones(shape, np.uint8), np.eye(4))


def test_real_cine(shared_data):
    path = shared_data / "cine" / "bivme_patient1_labels_iso1.5_4d.nii.gz"
    roles = {"lv_pool": 1, "lv_myocardium": 2, "rv_pool": 3, "rv_myocardium": 4}
    frames = np.asarray(nib.load(path).dataobj)
    pools = (frames == 1).sum(axis=(0, 1, 2))
    for phase, index in (("ED", pools.argmax()), ("ES", pools.argmin())):
        found = read_labels(path, roles, frame=phase).findings[0].message
        assert found.startswith(f"Frame {index + 1} of 25 was read for end")
