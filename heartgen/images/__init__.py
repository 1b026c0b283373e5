"""Masks in the world: reading, checking, and the surfaces they imply."""

from heartgen.images.mask import Finding, Mask
from heartgen.images.reading import mask_from_array, read_mask

__all__ = ["Finding", "Mask", "mask_from_array", "read_mask"]
