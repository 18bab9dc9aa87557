"""A study that is killed on purpose: ``python study_kills.py FOLDER [workers]``."""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.system.processes import process_pool
from machines.study.engine import compute
from machines.study.store import Store

TOTAL, BLOCK = 1003, 10


def evaluate(first: int, end: int) -> dict[str, Array]:
    """A hundredth of a second per block."""
    time.sleep(0.01)
    x = np.arange(first, end, dtype=float)
    return {"sine": np.sin(x), "root": np.sqrt(x)}


def main(folder: Path, workers: int) -> None:
    """Compute or go on."""
    store = Store.begin(folder, {"study": "killed"}, TOTAL, BLOCK)
    if workers == 1:
        compute(store, evaluate)
    else:
        with process_pool(workers) as pool:
            compute(store, evaluate, pool, workers)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
