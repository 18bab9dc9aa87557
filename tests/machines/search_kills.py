"""A search that is killed on purpose: ``python search_kills.py FOLDER [workers]``; its problems have known fronts."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jointlib.arrays import Array
from jointlib.system.processes import process_pool
from machines.study.run import search_all
from machines.study.store import Store
from machines.study.study import Study
from machines.study.study_file import read_study

STUDY = """
schema = "jointlib/study/1"
base = "none.toml"
[[objective]]
quantity = "weight"
goal = "min"
[[objective]]
quantity = "static-compliance"
goal = "min"
[sampling]
method = "pareto"
"""
FACTOR = '[[factor]]\nname = "x{i}"\npath = "x[{i}]"\nrange = [0.0, 1.0]\n'


@dataclass(frozen=True)
class Zdt:
    """ZDT1 and ZDT2 (Zitzler, Deb and Thiele 2000): f1 = x0, f2 = g (1 − (f1/g)^p), g = 1 + 9 · mean of the rest."""

    power: float
    pause: float = 0.0

    def numbers(self, designs: Array) -> Array:
        """Quantiles are the variables."""
        return designs

    def of(self, numbers: Array, first: int) -> dict[str, Array]:
        """Both objectives, after a pause per design."""
        time.sleep(self.pause * len(numbers))
        g = 1 + 9 * np.mean(numbers[:, 1:], axis=1)
        return {"weight": numbers[:, 0], "static-compliance": g * (1 - (numbers[:, 0] / g) ** self.power)}


def study(folder: Path, factors: int, count: int, population: int, more: str = "") -> Study:
    """A study over so many variables from 0 to 1."""
    path = folder / "zdt.study.toml"
    keys = f"count = {count}\npopulation = {population}\n{more}\n"
    path.write_text(STUDY + keys + "".join(FACTOR.format(i=i) for i in range(factors)))
    return read_study(path)


def main(folder: Path, workers: int) -> None:
    """Search or go on: 12 generations of 20 designs."""
    opened = read_study(folder / "zdt.study.toml")
    store = Store.begin(folder / "r", {"study": "killed"}, opened.total, 4)
    if workers == 1:
        search_all(opened, store, Zdt(0.5, 0.004), None, 1)
    else:
        with process_pool(workers) as pool:
            search_all(opened, store, Zdt(0.5, 0.004), pool, workers)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 1)
