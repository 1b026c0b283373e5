"""A server whose fits are light: what is tested is who does them, not what comes out.

usage: python -m tests.service.light SECONDS [options of heartgen serve]
"""

from __future__ import annotations

import json
import os
import random
import sys
import time
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any

from heartgen.service.work import Order

SUMMARY = {
    "accuracy": {"mean": 0.1, "max": 0.2},
    "quality": {"mean": 0.6, "min": 0.4},
    "fairness": {"circumferential_median": 1.0},
    "success": True,
    "mask_sha256": "0" * 64,
    "findings": [],
    "seconds": {"all": 0.1},
}


def light_work(seconds: float) -> Any:
    """Work that takes so long, and leaves a result as the real one does; with a line for each."""

    def work(order: Order) -> list[dict[str, Any]]:
        time.sleep(seconds * random.uniform(0.5, 1.5))
        folder, rows = order.job.folder, [{"status": "success"}]
        assert folder is not None
        stage = folder / ".stage" / uuid.uuid4().hex
        stage.mkdir(parents=True)
        for name in ("mesh.exf", "mesh.vtu"):
            (stage / name).write_bytes(os.urandom(100_000))
        (stage / "report.json").write_text(json.dumps(SUMMARY))
        (stage / "rows.json").write_text(json.dumps({"key": "", "rows": rows}))
        with (folder.parent / "done.log").open("a") as log:
            log.write(f"{order.identifier} {order.job.name}\n")
        with suppress(OSError):  # a twin was faster
            stage.rename(folder / order.job.name)
        return rows

    return work


def main() -> None:
    """Serve."""
    import cloudpickle

    from heartgen.cli import main as command
    from heartgen.service import dispatcher

    cloudpickle.register_pickle_by_value(sys.modules[light_work.__module__])
    dispatcher.work = light_work(float(sys.argv.pop(1)))
    Path(os.environ.get("HEARTGEN_DATA", "heartgen-data")).mkdir(parents=True, exist_ok=True)
    command()


if __name__ == "__main__":
    main()
