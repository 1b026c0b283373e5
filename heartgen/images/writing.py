"""Masks out to images that any viewer opens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK

from heartgen.images.mask import Mask


def write_mask(mask: Mask, path: str | Path) -> None:
    """Write a mask as an image of 0 and 1.

    Parameters
    ----------
    mask : Mask
    path : path
        Ends in ``.nii.gz`` or another ending that SimpleITK knows.
    """
    image: Any = SimpleITK.GetImageFromArray(mask.voxels.astype(np.uint8).transpose(2, 1, 0))
    image.SetSpacing(mask.spacing.tolist())
    image.SetOrigin(mask.affine[:3, 3].tolist())
    image.SetDirection((mask.affine[:3, :3] / mask.spacing).ravel().tolist())
    SimpleITK.WriteImage(image, str(path), useCompression=True)
