"""A small cup-shaped heart and a labeled one, and ways to save them with others' writers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

import nibabel as nib
import numpy as np
import pytest
import SimpleITK
from numpy.typing import NDArray

from heartgen import read_mask
from heartgen.errors import InputError

RAS_FROM_LPS = np.diag([-1.0, -1.0, 1.0, 1.0])


class Heart:
    """Both ventricles made of spheres, cut at z = 0, with the exact distance to the right pool."""

    lv_pool, lv_wall = 20.0, 30.0  # radii around the origin, mm
    rv_pool, rv_at = 30.0, -22.0  # radius, and x of the center; the left ventricle dents it
    corners = np.array([[x, y, z] for x in (-58, 36) for y in (-38, 38) for z in (-38, 16)])
    acdc: ClassVar = {"rv_pool": 1, "lv_myocardium": 2, "lv_pool": 3, "rv_openings": 7}

    def image(self, spacing, rotation=None) -> tuple[NDArray, NDArray]:
        """Affine of an image around the heart, and the places of its voxels in it, mm."""
        turn = np.eye(3) if rotation is None else rotation
        ends = self.corners @ turn.T
        low, high = ends.min(0), ends.max(0)
        shape = np.ceil((high - low) / spacing).astype(int) + 1
        affine = np.diag([*spacing, 1.0])
        affine[:3, 3] = low
        return affine, (np.moveaxis(np.indices(shape), 0, -1) * spacing + low) @ turn

    def labels(self, at: NDArray, values=acdc, rv_top: float = 0.0) -> NDArray[np.int16]:
        """Labels at places (..., 3) of the heart, mm."""
        z, radius = at[..., 2], np.linalg.norm(at, axis=-1)
        out = np.zeros(z.shape, dtype=np.int16)
        out[(self.distance(at) <= 0) & (z <= rv_top)] = values["rv_pool"]
        out[(radius <= self.lv_wall) & (z <= 0)] = values["lv_myocardium"]
        out[(radius <= self.lv_pool) & (z <= 0)] = values["lv_pool"]
        return out

    def distance(self, at: NDArray, in_plane: bool = False) -> NDArray[np.float64]:
        """Distance to the right pool, in 3-D or in planes of equal z, mm; negative inside.

        Where the foot on the pool's sphere lies in the left ventricle, the nearest point is on the
        circle in which the two meet.
        """
        x, y, z = np.moveaxis(at, -1, 0)
        height = z if in_plane else 0 * z
        pool, wall = (np.sqrt(np.maximum(r**2 - height**2, 0)) for r in (self.rv_pool, 30.0))
        across = np.abs(y) if in_plane else np.hypot(y, z)
        meet = (self.rv_at**2 + wall**2 - pool**2) / (2 * self.rv_at)
        circle = np.sqrt(np.maximum(wall**2 - meet**2, 0))
        far = np.hypot(x - self.rv_at, across)
        scale = pool / np.maximum(far, 1e-9)
        foot = np.hypot(self.rv_at + (x - self.rv_at) * scale, across * scale)
        to_circle = np.hypot(x - meet, across - circle)
        if in_plane:  # below the circle's lowest point the slices are whole discs
            foot = np.where(wall + pool > -self.rv_at, foot, np.inf)
        beyond = np.where((foot >= wall) & (far > pool), far - pool, to_circle)
        return np.where((far <= pool) & (np.hypot(x, across) > wall), far - pool, beyond)


@pytest.fixture(scope="session")
def heart() -> Heart:
    """A labeled heart."""
    return Heart()


@pytest.fixture(scope="session")
def cup() -> NDArray[np.uint8]:
    """A cup, closed below and open above, with background on every side."""
    i, j, k = np.mgrid[:24, :22, :20] - np.array([12.0, 11.0, 11.0])[:, None, None, None]
    r = np.sqrt(i**2 + j**2 + k**2)
    voxels = ((r <= 8) & (r > 5) & (k < 3)).astype(np.uint8)
    voxels.setflags(write=False)  # all tests share it
    return voxels


@pytest.fixture
def oblique() -> NDArray[np.float64]:
    """An affine, mm, LPS: anisotropic, permuted, rotated, mirrored and off the origin."""
    angle = np.radians(30)
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    swap = np.array([[0, 0, 1], [-1, 0, 0], [0, 1, 0]])
    affine = np.eye(4)
    affine[:3, :3] = turn @ swap @ np.diag([1.0, 1.25, -2.0])
    affine[:3, 3] = [-31.0, 12.5, 240.0]
    return affine


@pytest.fixture
def save(tmp_path: Path) -> Callable[..., Path]:
    """Save voxels (nx, ny, nz) under a name, by the writer its ending asks for."""

    def write(voxels: NDArray, affine: NDArray, name: str) -> Path:
        path = tmp_path / name
        if name.endswith((".nii", ".nii.gz")):
            nib.save(nib.Nifti1Image(voxels, RAS_FROM_LPS @ affine), path)
            return path
        spacing = np.linalg.norm(affine[:3, :3], axis=0)
        image = SimpleITK.GetImageFromArray(np.ascontiguousarray(voxels.T))
        image.SetSpacing(spacing.tolist())
        image.SetOrigin(affine[:3, 3].tolist())
        image.SetDirection((affine[:3, :3] / spacing).ravel().tolist())
        SimpleITK.WriteImage(image, str(path), useCompression=True)
        return path

    return write


class Folder:
    """A folder into which bad images are written."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __truediv__(self, name: str) -> Path:
        return self.path / name

    def nifti(self, voxels: NDArray, name: str = "m.nii", **header: object) -> Path:
        """Save a NIfTI-1 image and then set fields of its header by force."""
        nib.save(nib.Nifti1Image(voxels, np.eye(4)), self / name)
        data = (self / name).read_bytes()
        raw = nib.Nifti1Header(data[:348], check=False)
        for key, value in header.items():
            raw[key] = value
        (self / name).write_bytes(raw.binaryblock + data[348:])
        return self / name

    def text(self, name: str, header: str, data: bytes) -> Path:
        """Save a header of text with voxels behind it."""
        (self / name).write_bytes(header.encode() + data)
        return self / name


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    """An empty folder."""
    return Folder(tmp_path)


@pytest.fixture
def assert_refused(capfd: pytest.CaptureFixture) -> Callable[[Path, str], None]:
    """Assert that an image is refused with one sentence that has certain words."""

    def check(path: Path, words: str) -> None:
        with pytest.raises(InputError, match=words) as refusal:
            read_mask(path)
        message = str(refusal.value)
        assert message.startswith((f"{path.name}: ", f"{path}: "))
        assert message.endswith(".")
        assert "\n" not in message  # one kind of fault, one sentence
        assert capfd.readouterr().err == ""

    return check
