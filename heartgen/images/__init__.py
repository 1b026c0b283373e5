"""Masks in the world: reading, checking, and the surfaces they imply."""

from heartgen.images.mask import Finding, Mask
from heartgen.images.reading import mask_from_array, read_labels, read_mask
from heartgen.images.schemes import Scheme

__all__ = ["Finding", "Mask", "Scheme", "mask_from_array", "read_labels", "read_mask"]
