"""Read one mask after the other under a memory limit; run by test_fuzz_headers.py.

Takes a path per line on stdin and answers with a line each: mask, refused, or what was raised.
"""

from __future__ import annotations

import resource
import sys
import warnings
from collections.abc import Callable

from heartgen import Mask, read_labels, read_mask
from heartgen.errors import InputError

ADDRESS_SPACE = 4 * 1024**3  # bytes: ample for small images, and less than a hostile header wants


def outcome(path: str) -> str:
    said = answer(lambda: read_mask(path))
    if said != "refused":
        return said
    # What is no mask may be a label map, or a cine.
    again = answer(lambda: read_labels(path, "auto", frame="ES"))
    return said if again == "mask" else again


def answer(read: Callable[[], Mask]) -> str:
    try:
        mask = read()
    except InputError as error:
        return "refused" if str(error).strip() else "raised: an error without words"
    except BaseException as error:
        return f"raised: {type(error).__name__}: {error}".replace("\n", " ")
    return "mask" if isinstance(mask, Mask) and mask.voxels.any() else "raised: no mask"


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_AS, (ADDRESS_SPACE, ADDRESS_SPACE))
    warnings.simplefilter("error")
    for line in sys.stdin:
        print(outcome(line.rstrip("\n")), flush=True)
