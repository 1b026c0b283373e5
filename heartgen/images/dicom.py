"""DICOM segmentation objects (SEG), through highdicom."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from heartgen.images.checks import check_size, report
from heartgen.images.files import refuse
from heartgen.images.labels import describe_label, find_labels
from heartgen.images.volume import Label, Volume

SEGMENTATIONS = ("1.2.840.10008.5.1.4.1.1.66.4", "1.2.840.10008.5.1.4.1.1.66.7")
"""SOP classes Segmentation Storage and Label Map Segmentation Storage (DICOM PS3.6)."""

DEFLATED = "1.2.840.10008.1.2.1.99"
"""Transfer syntax in which the whole file is packed, so that its size is not known beforehand."""

LISTED = 20
"""Files or segments named in a message."""
