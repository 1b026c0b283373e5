"""The same mask gives the same mesh: to the last bit, and whatever the number of threads."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

pytestmark = pytest.mark.slow

SPACING = 3.0
"""mm; coarse, so that the whole pipeline takes seconds."""

ACROSS_THREADS = 1e-6
"""mm; sums in another order may differ by rounding, and by nothing else."""

LEVELS = (1, 3)
THREADS = ("NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")

PROGRAM = """
import sys
import numpy as np
from heartgen import personalize_levels, samples
make = {"lv": samples.lifelike_lv, "biv": samples.biv}[sys.argv[1]]
levels = [int(k) for k in sys.argv[2].split(",")]
results = personalize_levels(make(float(sys.argv[3])).mask, levels)
np.savez(sys.argv[4], **{k: r.mesh.dofs for k, r in zip(sys.argv[2].split(","), results)})
"""

Dofs = dict[str, np.ndarray]


def dofs_of(heart: str, threads: int, out: Path) -> Dofs:
    """Degrees of freedom of the meshes of a phantom, made by a process with so many threads."""
    levels = ",".join(map(str, LEVELS))
    answer = subprocess.run(
        [sys.executable, "-c", PROGRAM, heart, levels, str(SPACING), str(out)],
        env=os.environ | dict.fromkeys(THREADS, str(threads)),
        capture_output=True,
        text=True,
        check=False,
    )
    assert answer.returncode == 0, answer.stderr
    with np.load(out) as file:
        return dict(file)


@pytest.fixture(scope="module", params=["lv", "biv"])
def runs(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Dofs, Dofs, Dofs]:
    """One thread, two threads, two threads again."""
    folder = tmp_path_factory.mktemp(request.param)
    return tuple(
        dofs_of(request.param, threads, folder / f"{n}.npz") for n, threads in enumerate((1, 2, 2))
    )


def test_the_same_mask_gives_the_same_mesh_to_the_last_bit(runs: tuple[Dofs, Dofs, Dofs]) -> None:
    _, two, again = runs
    for lod in two:
        np.testing.assert_array_equal(two[lod], again[lod], err_msg=f"level of detail {lod}")


def test_threads_do_not_change_the_mesh(runs: tuple[Dofs, Dofs, Dofs]) -> None:
    one, two, _ = runs
    for lod in one:
        apart = np.abs(one[lod] - two[lod]).max()
        assert apart < ACROSS_THREADS, f"level of detail {lod}: {apart:.3g} mm apart"
